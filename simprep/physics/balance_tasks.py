"""What `balance` wants of a body at a moment, as weighted accelerations."""

import mujoco
import numpy as np

from simprep.arrays import FloatArray, IndexArray
from simprep.humanoid_model import GRAVITY
from simprep.physics.balance_goals import BalanceReference, BalanceSettings
from simprep.physics.balance_steps import ExtraStep, both_stand, foot_to_move, lacking
from simprep.physics.bodies import SceneBody
from simprep.physics.contact_forces import Tasks


def balance_tasks(
    goal: BalanceReference,
    step: int,
    body: SceneBody,
    data: mujoco.MjData,
    inertia: FloatArray,
    bias: FloatArray,
    settings: BalanceSettings,
    extra: ExtraStep | None = None,
) -> tuple[Tasks, FloatArray, ExtraStep | None]:
    """What accelerations are wanted in a state, the Jacobians (points, 3, nv) of the points that can bear load, and the extra step.

    Args:
        goal: the reference.
        step: where in it the body should be.
        body: whose tasks.
        data: the state, with everything that depends on positions and velocities, and `cacc` of no acceleration.
        inertia: (nv, nv) of the body.
        bias: (nv,) of the body.
        settings: stiffness and prices.
        extra: a step that was begun and that the reference does not have.
    """
    s, reference, kinematics = settings, goal.reference, goal.reference.kinematics
    own, root, size = body.qvel, body.segments.start, len(bias)
    qvel = data.qvel[own]
    error, late_by = np.zeros(size), reference.qvel[step] - qvel
    mujoco.mj_differentiatePos(body.character.model, error, 1.0, data.qpos[body.qpos], reference.qpos[step])
    # where the feet stand elsewhere than in the reference, so should the body
    resting = set(goal.segment[goal.height[step] < s.planned].tolist())
    stance = [foot for foot in body.feet if foot in resting]
    moved = np.zeros(2)
    if stance:
        moved = (data.xpos[[root + foot for foot in stance], :2] - kinematics.xpos[step, stance, :2]).mean(axis=0)
    error[:2] += moved + goal.plan.shift[step]
    late_by[:2] += goal.plan.speed[step]
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
    drift = bias[:3] / mass - [0.0, 0.0, GRAVITY]
    com_wanted = goal.com_acceleration[step].copy()
    com_wanted[:2] += goal.plan.acceleration(step, -behind[:2] - moved, -slower[:2])
    com_wanted[2] += s.height * behind[2] + 2 * np.sqrt(s.height) * slower[2]
    rows.append((to_com, np.full(3, s.com_weight), com_wanted - drift))

    segments = root + goal.segment
    points = data.xpos[segments] + np.einsum("nij,nj->ni", data.xmat[segments].reshape(-1, 3, 3), goal.place)
    points[:, 2] -= goal.radius
    low, planned = points[:, 2] < s.reach, goal.height[step] < s.planned
    pendulum = np.sqrt(max(float(com[2]), 0.2) / GRAVITY)
    astray = -(behind[:2] + goal.plan.shift[step]) - pendulum * (slower[:2] + goal.plan.speed[step])
    if extra and step >= extra.end:
        extra = None
    steady = extra is None and goal.lifted_in[step].min() > s.extra_soon
    standing = low & planned
    if steady and standing.any() and both_stand(goal.segment, body.feet, low, planned):
        out_of_reach = lacking(astray, goal.plan.pressure[step], points[standing, :2])
        if out_of_reach > s.extra_lacking:
            side = foot_to_move(astray, data.xpos[[root + foot for foot in body.feet], :2])
            extra = ExtraStep(side, step, step + round(s.extra_s * reference.motion.fps))
    free = np.zeros(len(planned), dtype=bool) if extra is None else goal.segment == body.feet[extra.side]
    planned &= ~free
    bearing = np.flatnonzero(low & planned)
    jacobians = _jacobians(data, points[bearing], segments[bearing], own)
    if len(bearing):
        flat = jacobians.reshape(-1, size)
        rows.append((flat, np.full(len(flat), 4 * s.contact_weight / len(bearing)), -s.slip * (flat @ qvel)))
    late = np.flatnonzero(~low & (goal.height[step] < s.late) & ~free)
    if len(late) and s.landing_weight:
        down = _jacobians(data, points[late], segments[late], own)[:, 2]
        downward = -s.landing * points[late, 2] - 2 * np.sqrt(s.landing) * (down @ qvel)
        rows.append((down, np.full(len(late), s.landing_weight / len(late)), downward))
    if len(bearing) and s.foot_weight:
        share = s.step_share * min(1.0, s.longest_step / max(s.step_share * float(np.hypot(*astray)), 1e-9))
        supporting = set(goal.segment[planned].tolist())
        for side, foot in enumerate(body.feet):
            near = float(np.clip((s.step_height - reference.clearance[step, foot]) / s.step_band, 0.0, 1.0))
            place = np.append(share * astray, 0.0)
            if extra and side == extra.side:
                near, place[2] = 1.0, extra.lift(step, s.extra_height)
            if foot not in supporting and near > 0:
                rows.append(_swing(goal, step, side, foot, place, data, body, s, s.foot_weight * near))
    matrix, prices, target = (np.concatenate(part) for part in zip(*rows))
    weighted = matrix.T * prices
    normal = weighted @ matrix
    normal[np.diag_indices(size)] += price
    return Tasks(normal, weighted @ target + price * wanted), jacobians, extra


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
    place += aside
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
