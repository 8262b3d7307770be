"""What `balance` wants of a body at each moment: a reference worked out in advance, and the tasks that follow from it."""

from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.ndimage import gaussian_filter1d

from simprep.arrays import FloatArray, IndexArray
from simprep.errors import SettingError
from simprep.humanoid_model import GRAVITY
from simprep.motion.rotations import rotation_matrix
from simprep.physics.bodies import SceneBody
from simprep.physics.contact_forces import Tasks
from simprep.physics.inverse_dynamics import contact_candidates
from simprep.physics.reference import Reference


@dataclass(frozen=True)
class BalanceSettings:
    """Configuration of `balance`. Stiffness is of the acceleration, in 1/s²; damping is critical (twice its root).

    Attributes:
        rate: how often it decides [1/s], rounded to whole steps.
        smoothing: standard deviation of the Gaussian over velocities before their derivative is taken [s].
        joint: stiffness of the joints towards the reference.
        orientation: of the root's orientation.
        com: of the COM's horizontal place.
        height: of its height.
        foot: of a swinging foot's place.
        landing: of the points that should touch the floor already, towards it.
        slip: damping of the contact points, which should rest [1/s].
        joint_weight: price of squared errors of each joint's acceleration.
        root_weight: of the root's linear acceleration.
        orientation_weight: of its angular one.
        com_weight: of the COM's.
        contact_weight: of the contact points', four times, shared by all.
        landing_weight: of the late points', shared by all.
        foot_weight: of a swinging foot's.
        step_share: share of the error of the extrapolated COM by which a swinging foot is put elsewhere.
        longest_step: largest such change [m].
        step_height: feet that the reference lifts higher than this swing freely [m]; step_band: the height below it over which
            the price falls to 0 [m].
        reach: points up to this height above the floor can bear load [m].
        planned: if the reference has them up to this height [m].
        late: points that the reference has up to this height should touch the floor [m].
        friction: coefficient of the pyramid in which contact forces are planned.
        regularisation: price of squared contact forces (`simprep.physics.contact_forces.best_motion`).

    Raises:
        SettingError: a number that is not positive; shares, weights and prices may be 0.
    """

    rate: float = 96.0
    smoothing: float = 0.03
    joint: float = 400.0
    orientation: float = 100.0
    com: float = 40.0
    height: float = 100.0
    foot: float = 400.0
    landing: float = 900.0
    slip: float = 20.0
    joint_weight: float = 2.0
    root_weight: float = 1.0
    orientation_weight: float = 50.0
    com_weight: float = 30.0
    contact_weight: float = 30.0
    landing_weight: float = 50.0
    foot_weight: float = 50.0
    step_share: float = 1.0
    longest_step: float = 0.6
    step_height: float = 0.15
    step_band: float = 0.05
    reach: float = 0.005
    planned: float = 0.01
    late: float = 0.004
    friction: float = 0.9
    regularisation: float = 0.002

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            may_be_0 = name.endswith("weight") or name in ("step_share", "longest_step", "smoothing", "regularisation")
            if not (0 <= value < np.inf if may_be_0 else 0 < value < np.inf):
                raise SettingError(f"balance: {name} {value}; valid: {'0 or more' if may_be_0 else 'above 0'}")


@dataclass(frozen=True)
class BalanceReference:
    """A reference with what `balance` needs at every step.

    Attributes:
        reference: the reference, N + 1 steps.
        qacc: (N + 1, nv) its accelerations.
        com_velocity: (N + 1, 3) of the whole body [m/s].
        com_acceleration: (N + 1, 3) [m/s²].
        foot_velocity: (N + 1, 2, 3) of the left and right foot's segment [m/s].
        foot_acceleration: (N + 1, 2, 3) [m/s²].
        segment: (points,) whose points may touch the floor, as index in the body's segments.
        place: (points, 3) in the segment's frame [m].
        radius: (points,) of a ball about it [m].
        height: (N + 1, points) of the balls' lowest points in the reference [m].
    """

    reference: Reference
    qacc: FloatArray
    com_velocity: FloatArray
    com_acceleration: FloatArray
    foot_velocity: FloatArray
    foot_acceleration: FloatArray
    segment: IndexArray
    place: FloatArray
    radius: FloatArray
    height: FloatArray


def balance_reference(reference: Reference, body: SceneBody, settings: BalanceSettings) -> BalanceReference:
    """Work out what `balance` needs of a reference.

    Args:
        reference: what the body tracks.
        body: who.
        settings: smoothing, and which points count as planned contacts.
    """
    model, fps, kinematics = body.character.model, reference.motion.fps, reference.kinematics
    sigma = settings.smoothing * fps
    candidates = contact_candidates(model)
    segment = np.array([owner - 1 for owner, *_ in candidates], dtype=np.intp)
    turns = rotation_matrix(model.geom_quat[[geom for _, geom, *_ in candidates]])
    centres = np.array([centre for *_, centre, _ in candidates])
    place = model.geom_pos[[geom for _, geom, *_ in candidates]] + np.einsum("nij,nj->ni", turns, centres)
    radius = np.array([radius for *_, radius in candidates])
    upward = rotation_matrix(kinematics.xquat)[:, :, 2]
    height = np.einsum("tni,ni->tn", upward[:, segment], place) + kinematics.xpos[:, segment, 2] - radius
    used = np.flatnonzero(height.min(axis=0) < settings.planned)
    com_velocity, com_acceleration = _derivatives(kinematics.com, fps, sigma)
    foot_velocity, foot_acceleration = _derivatives(kinematics.xpos[:, list(body.feet)], fps, sigma)
    return BalanceReference(
        reference=reference,
        qacc=np.gradient(_smooth(reference.qvel, sigma), 1 / fps, axis=0),
        com_velocity=com_velocity,
        com_acceleration=com_acceleration,
        foot_velocity=foot_velocity,
        foot_acceleration=foot_acceleration,
        segment=segment[used],
        place=place[used],
        radius=radius[used],
        height=np.ascontiguousarray(height[:, used]),
    )


def _smooth(values: FloatArray, sigma: float) -> FloatArray:
    return np.asarray(gaussian_filter1d(values, sigma, axis=0, mode="nearest") if sigma > 0 else values)


def _derivatives(path: FloatArray, fps: float, sigma: float) -> tuple[FloatArray, FloatArray]:
    """Velocity as it is, and acceleration of the smoothed velocity."""
    velocity = np.gradient(path, 1 / fps, axis=0)
    return velocity, np.gradient(_smooth(velocity, sigma), 1 / fps, axis=0)


def balance_tasks(
    goal: BalanceReference,
    step: int,
    body: SceneBody,
    data: mujoco.MjData,
    inertia: FloatArray,
    bias: FloatArray,
    settings: BalanceSettings,
) -> tuple[Tasks, FloatArray]:
    """What accelerations are wanted in a state, and the Jacobians (points, 3, nv) of the points that can bear load.

    Args:
        goal: the reference.
        step: where in it the body should be.
        body: whose tasks.
        data: the state, with everything that depends on positions and velocities, and `cacc` of no acceleration.
        inertia: (nv, nv) of the body.
        bias: (nv,) of the body.
        settings: stiffness and prices.
    """
    s, reference, kinematics = settings, goal.reference, goal.reference.kinematics
    own, root, size = body.qvel, body.segments.start, len(bias)
    qvel = data.qvel[own]
    error, late_by = np.zeros(size), reference.qvel[step] - qvel
    mujoco.mj_differentiatePos(body.character.model, error, 1.0, data.qpos[body.qpos], reference.qpos[step])
    stiffness, price = np.full(size, s.joint), np.full(size, s.joint_weight)
    stiffness[:3], stiffness[3:6] = s.com, s.orientation
    price[:3], price[3:6] = s.root_weight + 1e-3, s.orientation_weight
    wanted = goal.qacc[step] + stiffness * error + 2 * np.sqrt(stiffness) * late_by
    rows: list[tuple[FloatArray, FloatArray, FloatArray]] = []  # A, prices, a

    # the root's linear rows of the equations of motion are those of the COM
    mass = inertia[0, 0]
    to_com, com = inertia[:3] / mass, data.subtree_com[root]
    com_velocity = to_com @ qvel
    behind, slower = kinematics.com[step] - com, goal.com_velocity[step] - com_velocity
    com_stiffness = np.array([s.com, s.com, s.height])
    drift = bias[:3] / mass - [0.0, 0.0, GRAVITY]
    com_wanted = goal.com_acceleration[step] + com_stiffness * behind + 2 * np.sqrt(com_stiffness) * slower
    rows.append((to_com, np.full(3, s.com_weight), com_wanted - drift))

    segments = root + goal.segment
    points = data.xpos[segments] + np.einsum("nij,nj->ni", data.xmat[segments].reshape(-1, 3, 3), goal.place)
    points[:, 2] -= goal.radius
    low, planned = points[:, 2] < s.reach, goal.height[step] < s.planned
    bearing = np.flatnonzero(low & planned)
    jacobians = _jacobians(data, points[bearing], segments[bearing], own)
    if len(bearing):
        flat = jacobians.reshape(-1, size)
        rows.append((flat, np.full(len(flat), 4 * s.contact_weight / len(bearing)), -s.slip * (flat @ qvel)))
    late = np.flatnonzero(~low & (goal.height[step] < s.late))
    if len(late) and s.landing_weight:
        down = _jacobians(data, points[late], segments[late], own)[:, 2]
        downward = -s.landing * points[late, 2] - 2 * np.sqrt(s.landing) * (down @ qvel)
        rows.append((down, np.full(len(late), s.landing_weight / len(late)), downward))
    if len(bearing) and s.foot_weight:
        pendulum = np.sqrt(max(float(com[2]), 0.2) / GRAVITY)
        aside = -s.step_share * (behind + pendulum * slower)[:2]
        aside *= min(1.0, s.longest_step / max(float(np.hypot(*aside)), 1e-9))
        supporting = set(goal.segment[planned].tolist())
        for side, foot in enumerate(body.feet):
            near = np.clip((s.step_height - reference.clearance[step, foot]) / s.step_band, 0.0, 1.0)
            if foot not in supporting and near > 0:
                rows.append(_swing(goal, step, side, foot, aside, data, body, s, s.foot_weight * float(near)))
    matrix, prices, target = (np.concatenate(part) for part in zip(*rows))
    weighted = matrix.T * prices
    normal = weighted @ matrix
    normal[np.diag_indices(size)] += price
    return Tasks(normal, weighted @ target + price * wanted), jacobians


def _swing(
    goal: BalanceReference,
    step: int,
    side: int,
    foot: int,
    aside: FloatArray,
    data: mujoco.MjData,
    body: SceneBody,
    settings: BalanceSettings,
    price: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A swinging foot goes where the reference has it, and further in the direction in which the body falls."""
    segment = body.segments.start + foot
    place = goal.reference.kinematics.xpos[step, foot] - data.xpos[segment]
    place[:2] += aside
    jacobian = _jacobians(data, data.xpos[segment][None], np.array([segment]), body.qvel)[0]
    turning = np.empty(6)
    mujoco.mj_objectAcceleration(data.model, data, mujoco.mjtObj.mjOBJ_XBODY, segment, turning, 0)
    drift = turning[3:] - [0.0, 0.0, GRAVITY]  # MuJoCo's accelerations are those against free fall
    speed = goal.foot_velocity[step, side] - jacobian @ data.qvel[body.qvel]
    wanted = goal.foot_acceleration[step, side] + settings.foot * place + 2 * np.sqrt(settings.foot) * speed
    return jacobian, np.full(3, price), wanted - drift


def _jacobians(data: mujoco.MjData, points: FloatArray, segments: IndexArray, own: slice) -> FloatArray:
    """Jacobians (points, 3, nv of the body) of points (points, 3) of model bodies (points,)."""
    all_bodies = np.empty((len(points), 3, data.model.nv))
    for jacobian, point, segment in zip(all_bodies, points, segments.tolist()):
        mujoco.mj_jac(data.model, data, jacobian, None, point, segment)
    return np.asarray(all_bodies[:, :, own])
