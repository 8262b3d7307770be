"""Balance: where the centre of mass, its extrapolation and the zero moment point lie against the support polygon.

Only feet count as support. While hands, knees or obstacles bear load, these numbers understate balance.
"""

from dataclasses import dataclass

import numpy as np

from simprep.arrays import BoolArray, FloatArray
from simprep.humanoid_model import GRAVITY
from simprep.metrics.dynamics import residual_wrench
from simprep.metrics.smoothing import smooth_motion
from simprep.motion.edit import sample
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.support import signed_distance, support_centre, support_points
from simprep.physics.whole_body import whole_body, zero_moment_point

_LOWEST_PENDULUM_M = 0.2
_RESIDUAL_STRIDE = 2  # of the 60 Hz frames: the contact problem is solved at 30 Hz


@dataclass(frozen=True)
class Balance:
    """Balance of every frame at 60 Hz; NaN where the quantity does not exist (no foot supports; flight).

    Attributes:
        time: (n,) seconds from the first frame.
        com: (n, 3) centre of mass [m].
        support_centre: (n, 2) centre of the support polygon on the floor [m].
        foot_points: (n, 2 N, 2) foot points on the floor, left then right [m].
        support: (n, 2 N) which of them support.
        com_cos: (n,) COM to centre of support on the floor [m].
        com_to_edge: (n,) COM to the polygon's edge, positive inside [m].
        xcom: (n, 2) extrapolated centre of mass [m].
        margin: (n,) margin of stability: XcoM to the polygon's edge, positive inside [m].
        zmp: (n, 2) zero moment point that the motion needs [m].
        zmp_to_edge: (n,) ZMP to the polygon's edge, positive inside [m]; NaN near the ends of the motion.
        residual_time: (k,) times of the residual wrench, at 30 Hz [s].
        residual_force: (k,) needed external force that no contact of the supporting feet could supply [N].
        residual_torque: (k,) the same for the torque about the COM [N m].
    """

    time: FloatArray
    com: FloatArray
    support_centre: FloatArray
    foot_points: FloatArray
    support: BoolArray
    com_cos: FloatArray
    com_to_edge: FloatArray
    xcom: FloatArray
    margin: FloatArray
    zmp: FloatArray
    zmp_to_edge: FloatArray
    residual_time: FloatArray
    residual_force: FloatArray
    residual_torque: FloatArray


def extrapolated_com(com: FloatArray, velocity: FloatArray, gravity: float = GRAVITY) -> FloatArray:
    """Hof's extrapolated centre of mass on the floor (n, 2) [m]: XcoM = com + v / omega0, omega0 = sqrt(g / l).

    l is the height of the COM above the floor in that frame, at least 0.2 m. Hof et al. (2005, J Biomech 38:1) take leg
    length times a factor, which is close to it when upright. With the XcoM inside the support polygon, a linear
    inverted pendulum could stop without a step. Hides that people may step or have no wish to stop: walking has
    negative margins.

    Args:
        com: (n, 3) [m], floor at z = 0.
        velocity: (n, 3) [m/s].
        gravity: [m/s^2].
    """
    omega = np.sqrt(gravity / np.maximum(com[:, 2], _LOWEST_PENDULUM_M))
    return np.asarray(com[:, :2] + velocity[:, :2] / omega[:, None])


def balance(motion: Motion, friction: float = 1.0) -> Balance:
    """Balance of a kinematic or simulated motion at 60 Hz, from its poses and foot contacts alone.

    Args:
        motion: at least 2 frames.
        friction: of the floor, for the residual wrench.
    """
    model = motion.character.model
    smooth = smooth_motion(motion)
    body = whole_body(model, smooth.qpos, smooth.qvel, smooth.qacc)
    # positions come from the poses as they are: the filter would smear a foot's touch-down over its stance
    poses = forward_kinematics(sample(motion, smooth.time), motion.character)
    floor, mask = support_points(poses.foot_points, smooth.contacts)
    points = poses.foot_points.reshape(len(smooth.time), -1, 3)
    com = poses.com[:, :2]
    centre = support_centre(floor, mask)
    xcom = extrapolated_com(poses.com, body.com_velocity)
    zmp = zero_moment_point(poses.com, body.force, body.torque, float(model.body_mass.sum()) * GRAVITY)
    zmp[~smooth.interior] = np.nan
    rows = np.flatnonzero(smooth.interior)[::_RESIDUAL_STRIDE]
    force, torque = residual_wrench(
        poses.com[rows], body.force[rows], body.torque[rows], points[rows], mask[rows], friction
    )
    return Balance(
        time=smooth.time,
        com=poses.com,
        support_centre=centre,
        foot_points=floor,
        support=mask,
        com_cos=np.linalg.norm(com - centre, axis=1),
        com_to_edge=signed_distance(floor, mask, com),
        xcom=xcom,
        margin=signed_distance(floor, mask, xcom),
        zmp=zmp,
        zmp_to_edge=signed_distance(floor, mask, zmp),
        residual_time=smooth.time[rows],
        residual_force=force,
        residual_torque=torque,
    )


def posture_summary(series: Balance, frames: BoolArray | None = None) -> dict[str, float]:
    """Balance of the poses and velocities over the frames in which a foot supports, by name; NaN where there is none.

    - `com_cos_mm`: mean distance of the COM to the centre of support on the floor, the cost in Eq. 6 of the 2013 paper.
      Captures how centred the weight is; hides direction, and that walking means leaving the centre.
    - `com_inside_share`: share of those frames with the COM inside the polygon. Hides by how much, and all dynamics.
    - `com_to_edge_mm`: mean signed distance to the edge, positive inside. Hides the worst moment.
    - `margin_of_stability_mm`, `margin_of_stability_p5_mm`: mean and 5th percentile of Hof's margin
      (`extrapolated_com`).
    - `unsupported_share`: share of all frames in which no foot supports, which the numbers above leave out. Read it
      with them: a motion that jumps past its bad moments looks balanced.

    Args:
        series: from `balance`.
        frames: (n,) frames to use; None for all.
    """
    use = np.ones(len(series.time), dtype=bool) if frames is None else frames
    supported = use & series.support.any(axis=1)
    margin = series.margin[supported]
    return {
        "com_cos_mm": 1e3 * mean(series.com_cos[supported]),
        "com_inside_share": mean(series.com_to_edge[supported] >= 0),
        "com_to_edge_mm": 1e3 * mean(series.com_to_edge[supported]),
        "margin_of_stability_mm": 1e3 * mean(margin),
        "margin_of_stability_p5_mm": 1e3 * float(np.percentile(margin, 5)) if len(margin) else np.nan,
        "unsupported_share": 1.0 - mean(supported[use]),
    }


def plausibility_summary(series: Balance) -> dict[str, float]:
    """Whether floor contact could produce the motion, by name; NaN where a number does not exist.

    - `zmp_to_edge_mm`, `zmp_inside_share`: mean signed distance of the ZMP to the polygon's edge, positive inside, and
      share of frames inside. Both leave out frames in flight or without support, so read the residual too.
    - `residual_force_n`, `residual_torque_nm`: mean force and torque that no floor contact could supply
      (`residual_wrench`), flight included; `residual_force_p95_n`, `residual_torque_p95_nm`: 95th percentiles.
    """
    zmp = series.zmp_to_edge[np.isfinite(series.zmp_to_edge)]
    has = len(series.residual_force) > 0
    return {
        "zmp_to_edge_mm": 1e3 * mean(zmp),
        "zmp_inside_share": mean(zmp >= 0),
        "residual_force_n": mean(series.residual_force),
        "residual_force_p95_n": float(np.percentile(series.residual_force, 95)) if has else np.nan,
        "residual_torque_nm": mean(series.residual_torque),
        "residual_torque_p95_nm": float(np.percentile(series.residual_torque, 95)) if has else np.nan,
    }


def mean(values: FloatArray | BoolArray) -> float:
    """Mean; NaN for no values, without a warning."""
    return float(np.mean(values)) if len(values) else float("nan")


def centre_of_pressure_to_edge(series: Balance, time: FloatArray, centre_of_pressure: FloatArray) -> FloatArray:
    """Signed distance (n,) of a run's measured centre of pressure to the support polygon's edge, positive inside [m].

    Near zero the body pivots about an edge. Negative: something besides the two feet bears load, or a foot pushed with
    a part that the polygon lacks. NaN without support or pressure.

    Args:
        series: balance of the simulated motion; its times are those of the result.
        time: (N,) times of the measurements from the motion's first frame [s].
        centre_of_pressure: (N, 2) on the floor [m]; NaN where nothing presses.
    """
    nearest = np.clip(np.searchsorted(time, series.time - 1e-9), 0, len(time) - 1)
    return signed_distance(series.foot_points, series.support, centre_of_pressure[nearest])
