"""Targets that begin near the floor: a body lets itself down the way the target gets up.

A transition of some tenths of a second would make the body dive: its COM would sink faster than it can fall. The target's own
way up, played backwards, leads down as well: accelerations are the same backwards, and so are the contact forces they need.
"""

from dataclasses import replace

import numpy as np

from simprep.arrays import FloatArray
from simprep.humanoid_model import GRAVITY
from simprep.motion.kinematics import Kinematics, forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.rotations import in_heading
from simprep.preparation.blending import split_heading


def let_down(target: Motion, entry: int, pose: FloatArray, window: float) -> tuple[Motion, int]:
    """A target and the frame with which it is entered, so that the body need not sink faster than it can fall.

    Where it need not, both are as given. Else the target is led in by what follows its entry, backwards, from where its COM is as
    high as the body's; of several such frames, from the one in whose heading the segments lie most like the body's. A target that
    never rises so high is left as it is.

    Args:
        target: any motion.
        entry: frame with which it is to be entered.
        pose: (nq,) of the body that enters it.
        window: time of the transition [s].
    """
    reach = GRAVITY * window**2 / 6  # a cubic that covers h in T accelerates by at most 6 h / T^2
    own = forward_kinematics(pose[None], target.character)
    at_entry = forward_kinematics(target.qpos[entry : entry + 1], target.character)
    if own.com[0, 2] - at_entry.com[0, 2] <= reach:
        return target, entry
    later = forward_kinematics(target.qpos[entry:], target.character)
    apart = np.abs(later.com[:, 2] - own.com[0, 2])
    if apart.min() > reach:
        return target, entry
    distance = ((_shape(later, target.qpos[entry:]) - _shape(own, pose[None])) ** 2).sum(axis=(1, 2))
    begin = int(np.argmin(np.where(apart <= reach, distance, np.inf)))
    frames = entry + np.concatenate([np.arange(begin, 0, -1), np.arange(len(target) - entry)])
    events = {name: at - entry + begin for name, at in target.events.items() if at >= entry}
    return replace(target, qpos=target.qpos[frames], contacts=target.contacts[frames], events=events), 0


def _shape(kinematics: Kinematics, qpos: FloatArray) -> FloatArray:
    """Segments (T, segments, 3) about the COM, in the axes of each pose's heading."""
    return in_heading(kinematics.xpos - kinematics.com[:, None], split_heading(qpos[:, 3:7])[0])
