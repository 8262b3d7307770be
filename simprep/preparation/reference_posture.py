"""The reference posture of a target motion: the posture that carries its style (paper, section 4.2)."""

from dataclasses import dataclass

import numpy as np

from simprep.arrays import BoolArray, FloatArray
from simprep.character import SIDES
from simprep.errors import MotionError
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.rotations import in_heading
from simprep.motion.support import inside, support_points
from simprep.preparation.blending import split_heading
from simprep.preparation.settings import DEFAULT_SETTINGS, PreparationSettings

TARGET_EVENT = "target"

_LEG_PARTS = ("thigh", "shank", "foot")


@dataclass(frozen=True)
class ReferencePosture:
    """The reference posture T_p of a target motion.

    Attributes:
        qpos: (nq,) the posture.
        frame: its frame in the target motion.
        target_frame: T_t, the first frame of the target movement.
        found: whether a frame met all three conditions; otherwise the first frame of the motion was taken.
        reason: why this frame, in words.
        sole_height: (2,) height of the left and right sole above the floor in this posture [m].
        contacts: (2,) feet that support in this posture.
    """

    qpos: FloatArray
    frame: int
    target_frame: int
    found: bool
    reason: str
    sole_height: FloatArray
    contacts: BoolArray


def target_frame(target: Motion) -> int:
    """T_t: the marked first frame of the target movement.

    Raises:
        MotionError: the motion does not mark it.
    """
    if TARGET_EVENT not in target.events:
        places = forward_kinematics(target.qpos, target.character).xpos
        steps = np.linalg.norm(np.diff(places, axis=0, prepend=places[:1]), axis=2)
        frame, segment = np.unravel_index(steps.argmax(), steps.shape)
        raise MotionError(
            f"{target.name}: the first frame of the target movement is not marked; give the motion an event "
            f"{TARGET_EVENT!r} (command line: --target-frame N), valid: 0 to {len(target) - 1}; its fastest part is the "
            f"{target.character.segments[segment].replace('_', ' ')}, at frame {frame}: the movement begins before that"
        )
    return target.events[TARGET_EVENT]


def reference_posture(target: Motion, settings: PreparationSettings = DEFAULT_SETTINGS) -> ReferencePosture:
    """Find the reference posture by scanning back from T_t to the first frame T_0.

    The first frame is taken whose COM is inside the support polygon, whose contacts are those of T_0, and whose leg joints
    (positions relative to the root, in its heading) differ from those of T_0 by a sum of squares of at most
    `settings.leg_threshold`; T_0 if there is none.

    Raises:
        MotionError: the first frame of the target movement is not marked.
    """
    marked = target_frame(target)
    kinematics = forward_kinematics(target.qpos[: marked + 1], target.character)
    contacts = target.contacts[: marked + 1]
    balanced = inside(*support_points(kinematics.foot_points, contacts), kinematics.com[:, :2])
    same_contacts = (contacts == contacts[0]).all(axis=1)
    heading, _ = split_heading(target.qpos[: marked + 1, 3:7])
    leg_joints = [target.character.segment(f"{side}_{part}") for side in SIDES for part in _LEG_PARTS]
    offset = kinematics.xpos[:, leg_joints] - kinematics.xpos[:, :1]  # (T, 6, 3)
    local = in_heading(offset, heading)
    difference = ((local - local[0]) ** 2).sum(axis=(1, 2))
    fits = balanced & same_contacts & (difference <= settings.leg_threshold)
    found = bool(fits.any())
    frame = int(np.flatnonzero(fits)[-1]) if found else 0
    if found:
        reason = (
            f"frame {frame}: the first, back from the target movement at {marked}, with the COM inside the support "
            f"polygon, the contacts of frame 0 and the legs within {settings.leg_threshold:g} m^2 of it "
            f"({difference[frame]:.3f})"
        )
    else:
        reason = (
            f"frame 0: none of frames 0 to {marked} meets all conditions (COM inside the support polygon: "
            f"{balanced.sum()}, contacts of frame 0: {same_contacts.sum()}, legs within {settings.leg_threshold:g} "
            f"m^2: {(difference <= settings.leg_threshold).sum()} of {marked + 1} frames)"
        )
    return ReferencePosture(
        qpos=target.qpos[frame],
        frame=frame,
        target_frame=marked,
        found=found,
        reason=reason,
        sole_height=np.maximum(kinematics.foot_points[frame, :, :, 2].min(axis=1), 0.0),
        contacts=target.contacts[frame],
    )
