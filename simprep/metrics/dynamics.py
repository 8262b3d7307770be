"""What of the external wrench that a motion needs the floor could not supply."""

import numpy as np

from simprep.arrays import BoolArray, FloatArray
from simprep.physics.inverse_dynamics import nonnegative_least_squares


def residual_wrench(
    com: FloatArray,
    force: FloatArray,
    torque: FloatArray,
    points: FloatArray,
    mask: BoolArray,
    friction: float = 1.0,
    lever: float = 1.0,
) -> tuple[FloatArray, FloatArray]:
    """Force (n,) [N] and torque about the COM (n,) [N m] that no floor contact at the supporting points could supply.

    Norms of what a non-negative least squares problem leaves of the needed wrench in each frame. Each point pushes
    along the four edges of MuJoCo's pyramidal friction cone, |fx| + |fy| <= friction * fz. Zero: floor contact could
    produce the motion. In flight the whole needed wrench remains, which is zero for a free fall. Hides strength: joint
    torques may be out of reach. What a hand on the floor supplies counts as residual.

    Args:
        com: (n, 3) [m].
        force: (n, 3) needed external force [N].
        torque: (n, 3) needed moment about the COM [N m].
        points: (n, P, 3) contact points [m].
        mask: (n, P) points that may push.
        friction: sliding friction coefficient.
        lever: length by which moments are divided to weigh them against forces [m].
    """
    edges = np.array([[friction, 0, 1], [-friction, 0, 1], [0, friction, 1], [0, -friction, 1]], dtype=np.float64)
    residual = np.concatenate([force, torque / lever], axis=1)
    arms = points - com[:, None]
    moments = np.cross(arms[:, :, None, :], edges) / lever  # (n, P, 4, 3)
    generators = np.concatenate([np.broadcast_to(edges, moments.shape), moments], axis=-1)  # (n, P, 4, 6)
    for frame in np.flatnonzero(mask.any(axis=1)):
        columns = generators[frame, mask[frame]].reshape(-1, 6).T
        pushes = nonnegative_least_squares(columns, residual[frame])
        residual[frame] -= columns @ pushes
    return np.linalg.norm(residual[:, :3], axis=1), lever * np.linalg.norm(residual[:, 3:], axis=1)
