"""What can be cleaned of a motion: spikes, angles beyond limits, sliding soles, float and penetration. All is reported."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import median_filter

from simprep.arrays import BoolArray, FloatArray
from simprep.character import SIDES, Character
from simprep.check.limits import joint_velocity, velocity_limits
from simprep.check.subject import STANDING, subject
from simprep.errors import SimprepError
from simprep.motion.contacts import detect_contacts, stances
from simprep.motion.kinematics import body_clearance, forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.set_down import set_down
from simprep.physics.reference import lift_offset
from simprep.preparation.planting import plant_feet

SPIKE_FRAMES = 5
"""A spike is out of the median of so many frames, and back within them."""
SPIKE_ROOT_M = 0.05
LEAST_RAD = 0.1
"""Smaller departures from the median are no spikes [rad]."""
LIFT_SIGMA_S = 0.1
SLIDE_M = 0.02
"""Feet that slide less in a stance stay as they are: holosoma's precision of contact [m]."""
DEEP_M, HIGH_M = 0.001, 0.005
"""Penetration and float that are mended [m]."""


@dataclass(frozen=True)
class Mended:
    """A cleaned motion.

    Attributes:
        motion: after all changes.
        changes: what was changed, a line each, with numbers; empty if nothing was.
    """

    motion: Motion
    changes: tuple[str, ...]


def mend(motion: Motion) -> Mended:
    """Clean a motion; contacts are found again.

    Not mended are misreadings (quaternion order, axes, frame rate): the file must be read as it was meant.

    Args:
        motion: of any character.

    Raises:
        MotionError: too short.
    """
    one = subject(motion)
    qpos, changes = _without_spikes(motion.qpos, motion.fps, velocity_limits(one)[0], motion.character.joints)
    qpos, more = in_range(qpos, motion.character)
    changes += more
    qpos, more = _on_floor(qpos, motion)
    changes += more
    qpos, more = _still_soles(qpos, motion)
    changes += more
    if more:
        qpos, again = _on_floor(qpos, motion)
        changes += [f"{line}, after the soles" for line in again]
    if not changes:
        return Mended(motion, ())
    contacts = motion.contacts & detect_contacts(qpos, motion.fps, motion.character)
    return Mended(replace(motion, qpos=qpos, contacts=contacts, source=f"mended: {motion.source}"), tuple(changes))


def in_range(qpos: FloatArray, character: Character) -> tuple[FloatArray, list[str]]:
    """Poses (T, 7 + J) [m, wxyz, rad] with every joint set back into its range, and what was changed: one line, or none."""
    low, high = character.limits.T
    beyond = np.maximum(low - qpos[:, 7:], qpos[:, 7:] - high)
    if beyond.max() <= 1e-9:
        return qpos, []
    joint = int(np.argmax(beyond.max(axis=0)))
    out = np.hstack([qpos[:, :7], np.clip(qpos[:, 7:], low, high)])
    return out, [
        f"limits: {int((beyond > 1e-9).any(axis=0).sum())} joints set back into their range, "
        f"{character.joints[joint]} by up to {np.degrees(beyond.max()):.1f} deg"
    ]


def _without_spikes(
    qpos: FloatArray, fps: float, limits: FloatArray, joints: tuple[str, ...]
) -> tuple[FloatArray, list[str]]:
    out, changes = qpos.copy(), []
    frames = np.arange(len(qpos))
    names = ("root x", "root y", "root z", *joints)
    columns = [0, 1, 2, *range(7, qpos.shape[1])]
    least = np.concatenate([np.full(3, SPIKE_ROOT_M), np.maximum(LEAST_RAD, limits / fps)])
    mended: dict[str, int] = {}
    for name, column, smallest in zip(names, columns, least, strict=True):
        values = qpos[:, column]
        bad: BoolArray = np.abs(values - median_filter(values, SPIKE_FRAMES, mode="nearest")) > smallest
        # the median of fast movement lags: a spike comes back, so its neighbours on both sides are good
        bad &= ~(np.r_[False, bad[:-1]] & np.r_[False, False, bad[:-2]])
        if bad.any() and not bad.all():
            out[bad, column] = np.interp(frames[bad], frames[~bad], values[~bad])
            mended[name] = int(bad.sum())
    if mended:
        shown = ", ".join(f"{name} ({count})" for name, count in list(mended.items())[:6])
        changes.append(f"spikes: {sum(mended.values())} values interpolated: {shown}")
    return out, changes


def _on_floor(qpos: FloatArray, motion: Motion) -> tuple[FloatArray, list[str]]:
    out, changes = qpos.copy(), []
    lowered = set_down(out, motion.fps, motion.character, motion.loop)
    if lowered.max() > HIGH_M:
        out[:, 2] -= lowered
        changes.append(
            f"float: set down by up to {1e3 * lowered.max():.0f} mm in {int((lowered > HIGH_M).sum())} frames"
        )
    depth = -body_clearance(out, motion.character).min(axis=1)
    if depth.max() > DEEP_M:
        out[:, 2] += lift_offset(depth, LIFT_SIGMA_S * motion.fps)
        changes.append(f"penetration: lifted by up to {1e3 * depth.max():.0f} mm")
    return out, changes


def _still_soles(qpos: FloatArray, motion: Motion) -> tuple[FloatArray, list[str]]:
    """Standing feet held in place, unless that takes more than the legs can."""
    standing = motion.contacts & detect_contacts(qpos, motion.fps, motion.character, STANDING)
    slid = _slid(qpos, standing, motion.character)
    if slid <= SLIDE_M:
        return qpos, []
    try:
        held = plant_feet(qpos, None, standing, np.ones(len(qpos)), np.zeros(2), motion.fps, motion.character)
    except SimprepError as error:
        return qpos, [f"soles: left as they are ({error})"]
    before, after = (joint_velocity(subject(replace(motion, qpos=poses))).value or 0.0 for poses in (qpos, held.qpos))
    if after > max(1.0, before):
        return qpos, [
            f"soles: left as they are, sliding by up to {1e3 * slid:.0f} mm: to hold them a joint would move at "
            f"{after:.1f} times its limit"
        ]
    return held.qpos, [
        f"soles: standing feet, which slid by up to {1e3 * slid:.0f} mm, held in place within {1e3 * held.foot_error.max():.0f} mm"
    ]


def _slid(qpos: FloatArray, standing: BoolArray, character: Character) -> float:
    """Farthest that the stillest point of a sole moves over a stance [m]."""
    points = forward_kinematics(qpos, character).foot_points[..., :2]
    ways = [
        float(np.linalg.norm(points[after - 1, side] - points[first, side], axis=-1).min())
        for side in range(len(SIDES))
        for first, after in stances(standing[:, side])
    ]
    return max(ways, default=0.0)
