"""What the transition model needs of a stream of two: roots, headings, local joint positions, centres of mass."""

from collections.abc import Sequence

import numpy as np

from simprep.arrays import FloatArray
from simprep.duel.labels.segmentation import stream_kinematics
from simprep.duel.model.action_features import PairTracks
from simprep.duel.stream.stream import DuelStream
from simprep.motion.edit import yaw
from simprep.motion.kinematics import Kinematics
from simprep.motion.turns import turned


def local_joints(kinematics: Kinematics, heading: FloatArray) -> FloatArray:
    """Joint positions (T, joints, 3) relative to the root joint, in axes that turn with the heading (T,) only [m]."""
    offset = kinematics.xpos[:, 1:] - kinematics.xpos[:, :1]
    flat = turned(offset[..., :2], -heading[:, None])
    return np.concatenate([flat, offset[..., 2:]], axis=-1)


def pair_tracks(stream: DuelStream, kinematics: Sequence[Kinematics] | None = None) -> PairTracks:
    """Tracks of a stream, with joint positions relative to the root joint, in axes that turn with the heading only.

    So the lean of the pelvis stays visible in them. `kinematics` is of both players, where already computed.

    Raises:
        MotionError: more than two people.
    """
    stream.check_pair()
    both = kinematics or stream_kinematics(stream)
    heading = [yaw(one.xquat[:, 0]) for one in both]
    return PairTracks(
        fps=stream.fps,
        root=np.stack([one.xpos[:, 0] for one in both], axis=1),
        heading=np.stack(heading, axis=1),
        joints=np.stack([local_joints(*pair) for pair in zip(both, heading, strict=True)], axis=1),
        com=np.stack([one.com for one in both], axis=1),
    )
