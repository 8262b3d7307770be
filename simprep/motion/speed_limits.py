"""Imported motions within the largest speeds of a body's joints."""

import numpy as np

from simprep.arrays import FloatArray
from simprep.character import Character

SHARE = 0.95
"""Share of a joint's largest speed that an import uses; smoothing and tracking need the rest."""


def within_speed_limits(
    qpos: FloatArray, fps: float, character: Character, cyclic: bool = False
) -> tuple[FloatArray, list[str]]:
    """Poses (T, nq) whose joints turn no faster than they can, and the names of the joints that were slowed.

    A joint that is too fast starts earlier and arrives later: the mean of the path that lags behind and of the one that
    runs ahead, both of which keep the limit.

    Args:
        qpos: (T, nq) poses.
        fps: frames per second [1/s].
        character: the body; without speed limits nothing changes.
        cyclic: the last frame is followed by the first.
    """
    if not character.velocity_limits:
        return qpos, []
    most = SHARE * np.array(character.velocity_limits) / fps  # (joints,) in a frame
    count = len(qpos)
    angles = np.tile(qpos[:, 7:], (3, 1)) if cyclic else qpos[:, 7:]
    fast = np.flatnonzero((np.abs(np.diff(angles, axis=0)) > most).any(axis=0))
    if not len(fast):
        return qpos, []
    limited = (_lagging(angles[:, fast], most[fast]) + _lagging(angles[::-1, fast], most[fast])[::-1]) / 2
    out = qpos.copy()
    out[:, 7 + fast] = limited[count : 2 * count] if cyclic else limited
    return out, [character.joints[index] for index in fast]


def _lagging(angles: FloatArray, most: FloatArray) -> FloatArray:
    out = angles.copy()
    for frame in range(1, len(out)):
        out[frame] = np.clip(out[frame], out[frame - 1] - most, out[frame - 1] + most)
    return out
