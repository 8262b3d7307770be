"""Inverse kinematics of whole clips with `mink`: our joints to their targets, within their limits, above the floor."""

from dataclasses import dataclass
from typing import Any

import mink
import mujoco
import numpy as np

from simprep.arrays import BoolArray, FloatArray
from simprep.character import ROLES, SIDES, Character
from simprep.errors import MotionError
from simprep.geoms import bearing_points
from simprep.motion.closed_form import closed_form
from simprep.motion.foot_stance import knee_offset
from simprep.motion.targets import ORIENTED, Targets, unit

LARGEST_STEP = 0.5
"""Largest turn of anything in one step; larger steps are shortened [rad]."""
FULL_STEPS = 4
"""Number of whole steps. Further ones are halved: where spine joints turn against each other, whole ones oscillate."""
UNBOUNDED = 1e30
"""No bound, to the solver."""

PLACE = {role: slice(3 * number, 3 * number + 3) for number, role in enumerate(ROLES)}
"""Rows of a body's position in the stacked error."""
TURN = {
    ROLES[index]: slice(3 * (len(ROLES) + number), 3 * (len(ROLES) + number) + 3)
    for number, index in enumerate(ORIENTED)
}
"""Rows of a body's rotation vector, world axes: the first two tilt it, the third is its heading."""
TILT = {role: slice(rows.start, rows.start + 2) for role, rows in TURN.items()}
HEADING = {role: rows.start + 2 for role, rows in TURN.items()}
ROWS = 3 * (len(ROLES) + len(ORIENTED))
FEET_TURN = slice(TURN["left_foot"].start, TURN["right_foot"].stop)


@dataclass(frozen=True)
class RetargetSettings:
    """Weights and effort of the inverse kinematics.

    Attributes:
        position_cost: weight of a joint position [1/m].
        trunk_cost: the same for the spine, neck and head, which other skeletons divide differently.
        head_cost: weight of the head's orientation [1/rad].
        hand_cost: weight of a hand's orientation [1/rad].
        foot_cost: weight of a foot's tilt [1/rad].
        foot_turn_cost: weight of a foot's heading [1/rad]; it turns the knee, as our shank has no torsion.
        twist: a knee this far beside the plane of its standing foot halves the weight of the foot's heading [m].
        beyond: a standing foot whose orientation is off by this much gets half the weight, once, lest it moves the
            whole body [rad].
        stance_cost: factor on the position of a standing foot.
        stance_tilt_cost: factor on its tilt.
        stance_turn_cost: factor on its heading.
        posture_cost: pull of every hinge to its closed form [1/rad]; decides what is open (twist of a straight limb).
        arm_cost: the same for shoulder and elbow, whose closed form is smooth where the shoulder's hinges align.
        neck_cost: the same for the rotations of neck and head, lest they imitate the side bending that our head lacks.
        iterations: largest number of steps per frame.
        tolerance: a step that turns no joint by more than this is the last [rad].
        loose_tolerance: the same for ankles and the rotation of hips, which hardly move a bone [rad].
        lead: a frame starts with the last frame's deviation from closed form if it is below this [rad].
    """

    position_cost: float = 1.0
    trunk_cost: float = 0.5
    head_cost: float = 0.15
    hand_cost: float = 0.03
    foot_cost: float = 0.1
    foot_turn_cost: float = 0.03
    twist: float = 0.02
    beyond: float = 0.1
    stance_cost: float = 10.0
    stance_tilt_cost: float = 10.0
    stance_turn_cost: float = 25.0
    posture_cost: float = 0.004
    arm_cost: float = 0.05
    neck_cost: float = 0.03
    iterations: int = 30
    tolerance: float = 0.02
    loose_tolerance: float = 0.12
    lead: float = 0.3


@dataclass(frozen=True)
class Solution:
    """Poses found by the inverse kinematics.

    Attributes:
        qpos: (T, nq).
        unsettled: (T,) frames whose last step still exceeded the tolerance.
    """

    qpos: FloatArray
    unsettled: BoolArray


class BodyTask(mink.Task):  # type: ignore[misc]
    """Positions of the 17 roles, orientations of some, and a pull to rest, as one task; faster than a task for each.

    The bones of the arms count by their directions and move the arms alone: an arm out of reach never bends the trunk.
    """

    def __init__(self, character: Character, settings: RetargetSettings, oriented: BoolArray) -> None:
        self.settings, model = settings, character.model
        cost = np.full(ROWS, settings.position_cost)
        for role in ROLES:
            if not character.has(role):
                cost[PLACE[role]] = 0.0
            elif role in ("abdomen", "thorax", "neck", "head"):
                cost[PLACE[role]] = settings.trunk_cost
        costs = {"head": settings.head_cost, "hand": settings.hand_cost, "foot": settings.foot_cost}
        for (role, rows), told in zip(TURN.items(), oriented):
            cost[rows] = costs[role.rpartition("_")[2]] * told
            if role.endswith("foot"):
                cost[HEADING[role]] = settings.foot_turn_cost * told
        self.base_cost = cost
        super().__init__(cost=self.base_cost.copy(), gain=1.0, lm_damping=0.0)
        self.pull = np.full(model.nv, settings.posture_cost**2)
        self.pull[:6] = 1e-9
        for arm in (character.group(f"{side}_arm") for side in SIDES):
            self.pull[6 + character.joint_indices(arm[:4])] = settings.arm_cost**2
        for index in map(character.anatomical, ("neck_rotation", "head_rotation")):
            if index is not None:
                self.pull[6 + index] = settings.neck_cost**2
        self.tolerance = np.full(model.nv, settings.tolerance)
        for leg in (character.group(f"{side}_leg") for side in SIDES):
            self.tolerance[6 + character.joint_indices([leg[2], *leg[4:]])] = settings.loose_tolerance
        self.bodies = np.array([1 + character.segment(role if character.has(role) else "pelvis") for role in ROLES])
        self.turned = self.bodies[list(ORIENTED)]
        self.positions = np.zeros((len(ROLES), 3))
        self.orientations = np.tile(np.eye(3), (len(ORIENTED), 1, 1))
        self.rest = np.array(model.qpos0)
        self.jacobian = np.zeros((ROWS, model.nv))
        self.places = [(self.jacobian[PLACE[role]], int(body)) for role, body in zip(ROLES, self.bodies)]
        self.turns = [(self.jacobian[rows], int(body)) for rows, body in zip(TURN.values(), self.turned)]
        self.weight = np.zeros_like(self.jacobian)
        self.bones = [ROLES.index(f"{side}_{part}") for side in SIDES for part in ("forearm", "hand")]
        self.joints_above = [bone - 1 for bone in self.bones]
        self.gave_way = False
        # a foot that cannot turn sideways would tilt the whole body to lie flat
        self.tilts = [character.anatomical(f"{side}_ankle_inversion") is not None for side in SIDES]
        self.mask = np.ones_like(self.jacobian)
        for side in SIDES:
            own = 6 + character.joint_indices(character.group(f"{side}_arm"))
            others = np.setdiff1d(np.arange(model.nv), own)
            for rows in (PLACE[f"{side}_forearm"], PLACE[f"{side}_hand"], TURN[f"{side}_hand"]):
                self.mask[rows, others] = 0.0

    def set_target(
        self,
        positions: FloatArray,
        orientations: FloatArray,
        standing: BoolArray,
        twisted: FloatArray,
        rest: FloatArray,
    ) -> None:
        """Targets of one frame.

        Args:
            positions: (17, 3) of the roles [m].
            orientations: (5, 3, 3) of the roles in `ORIENTED`.
            standing: (2,) which feet stand.
            twisted: (2,) how far each knee is beside the plane of its foot [m].
            rest: (nq,) pose that everything is pulled to a little.
        """
        self.positions, self.orientations, self.rest = positions, orientations, rest
        cost = self.base_cost.copy()
        for number in np.flatnonzero(standing):
            foot = f"{SIDES[number]}_foot"
            cost[PLACE[foot]] *= self.settings.stance_cost
            cost[TILT[foot]] *= self.settings.stance_tilt_cost if self.tilts[number] else 1.0
            yields = 1 + (twisted[number] / self.settings.twist) ** 2
            cost[HEADING[foot]] *= self.settings.stance_turn_cost / yields
        self.cost, self.gave_way = cost, False
        self.weight = cost[:, None] * self.mask

    def yields(self, configuration: Any, standing: BoolArray) -> bool:
        """Give way, once, to standing feet that cannot be turned as wanted (a reweighted robust loss); whether any is.

        Args:
            configuration: the settled pose.
            standing: (2,) which feet stand.
        """
        if self.gave_way or not standing.any():
            return False
        self.gave_way = True
        error = self.compute_error(configuration)[FEET_TURN].reshape(2, 3)
        off = np.linalg.norm(error, axis=1) / self.settings.beyond
        factor = np.where(standing & (off > 1.0), 1 / (1 + off**2), 1.0)
        self.cost[FEET_TURN] *= factor.repeat(3)
        self.weight = self.cost[:, None] * self.mask
        return bool((factor < 1.0).any())

    def compute_error(self, configuration: Any) -> FloatArray:
        """Current minus target: positions (of the arms' bones: vectors), then rotation vectors."""
        data = configuration.data
        current = data.xmat[self.turned].reshape(-1, 3, 3)
        turn = _rotation_vectors(current @ np.swapaxes(self.orientations, -1, -2))
        off = data.xpos[self.bodies] - self.positions
        off[self.bones] -= off[self.joints_above]
        return np.concatenate([off.ravel(), turn.ravel()])

    def compute_jacobian(self, configuration: Any) -> FloatArray:
        """Derivative of the error, not yet masked; that of the rotation vector is exact at the target."""
        model, data = configuration.model, configuration.data
        for rows, body in self.places:
            mujoco.mj_jacBody(model, data, rows, None, body)
        for rows, body in self.turns:
            mujoco.mj_jacBody(model, data, None, rows, body)
        for side in SIDES:  # a forearm's own origin does not depend on the shoulder's hinges, so its row is right
            self.jacobian[PLACE[f"{side}_hand"]] -= self.jacobian[PLACE[f"{side}_forearm"]]
        return self.jacobian

    def compute_qp_objective(self, configuration: Any) -> mink.Objective:
        """Weighted squares of the error and of the distance to rest."""
        weighted = self.weight * self.compute_jacobian(configuration)
        error = self.cost * self.compute_error(configuration)
        hessian = weighted.T @ weighted
        hessian.flat[:: len(hessian) + 1] += self.pull
        gradient = error @ weighted
        gradient[6:] += self.pull[6:] * (configuration.q[7:] - self.rest[7:])
        return mink.Objective(hessian, gradient)


def _rotation_vectors(matrices: FloatArray) -> FloatArray:
    """Rotation vectors (N, 3) of (N, 3, 3) matrices, short of half a turn; for a few ten times faster than scipy."""
    entries = matrices.reshape(-1, 9)
    axis = entries[:, [7, 2, 3]] - entries[:, [5, 6, 1]]  # 2 sin(angle) times the axis
    sine = np.sqrt(np.add.reduce(axis * axis, axis=1)) / 2
    angle = np.arctan2(sine, (np.add.reduce(entries[:, ::4], axis=1) - 1) / 2)
    return np.asarray(axis * (angle / np.maximum(2 * sine, 1e-12))[:, None])


class Floor:
    """Keeps colliding points above the floor: J_z dq >= -height for every point near it.

    Args:
        model: the model.
        near: points higher than this are left out [m].
    """

    def __init__(self, model: mujoco.MjModel, near: float = 0.06) -> None:
        points = [
            (geom, *one) for geom in np.flatnonzero(model.geom_contype).tolist() for one in bearing_points(model, geom)
        ]
        owner, centres, radii = zip(*points)
        self.model, self.near = model, near
        self.owner, self.centres, self.radius = np.array(owner), np.array(centres), np.array(radii)
        self.body = model.geom_bodyid[self.owner]
        self._jacobian = np.zeros((3, model.nv))

    def rows(self, data: mujoco.MjData) -> tuple[FloatArray, FloatArray]:
        """G (N, nv) and h (N,) of G dq <= h for the points near the floor."""
        place, turn = data.geom_xpos, data.geom_xmat
        above = np.add.reduce(turn[:, 6:].take(self.owner, axis=0) * self.centres, axis=1)
        height = place[:, 2].take(self.owner) + above - self.radius
        close = np.flatnonzero(height < self.near)
        rows = np.empty((len(close), self.model.nv))
        for row, number in enumerate(close.tolist()):
            geom = self.owner[number]
            centre = place[geom] + turn[geom].reshape(3, 3) @ self.centres[number]
            mujoco.mj_jac(self.model, data, self._jacobian, None, centre, int(self.body[number]))
            np.negative(self._jacobian[2], out=rows[row])
        return rows, height[close]


def solve(
    targets: Targets,
    standing: BoolArray,
    character: Character,
    settings: RetargetSettings | None = None,
    floor: bool = True,
) -> Solution:
    """Poses that follow the targets, every frame from its own closed form.

    Args:
        targets: where the joints should be.
        standing: (T, 2) whether each foot's target is a foothold to be met closely.
        character: the body.
        settings: weights and effort.
        floor: keep the body above the floor z = 0.

    Raises:
        MotionError: no solution (targets that are not finite).
    """
    settings = settings or RetargetSettings()
    model = character.model
    start = closed_form(targets, character)
    configuration = mink.Configuration(model, start[0])
    task = BodyTask(character, settings, targets.oriented)
    limit = Floor(model) if floor else None
    twisted = _twisted(targets)
    out = np.empty_like(start)
    unsettled = np.zeros(len(start), dtype=bool)
    lead = np.zeros(model.nv)
    for frame in range(len(start)):
        task.set_target(
            targets.positions[frame], targets.orientations[frame], standing[frame], twisted[frame], start[frame]
        )
        qpos = start[frame].copy()
        # start with the last frame's deviation from closed form; it changes the start, not the result
        if np.abs(lead[3:]).max() < settings.lead:
            mujoco.mj_integratePos(model, qpos, lead, 1.0)
            qpos[7:] = np.clip(qpos[7:], model.jnt_range[1:, 0], model.jnt_range[1:, 1])
        configuration.update(qpos)
        for number in range(settings.iterations):
            settled = _step(configuration, task, limit, 1.0 if number < FULL_STEPS else 0.5)
            if settled and not task.yields(configuration, standing[frame]):
                break
        else:
            unsettled[frame] = True
        out[frame] = configuration.q
        mujoco.mj_differentiatePos(model, lead, 1.0, start[frame], out[frame])
    return Solution(out, unsettled)


def _twisted(targets: Targets) -> FloatArray:
    """How far each knee folds to the side of its foot's direction (T, 2) [m]."""
    out = np.empty((len(targets.positions), 2))
    for number, side in enumerate(SIDES):
        hip, knee, ankle = (targets.positions[:, ROLES.index(f"{side}_{part}")] for part in ("thigh", "shank", "foot"))
        aside = targets.orientations[:, 3 + number, :, 1] * [1.0, 1.0, 0.0]
        out[:, number] = (knee_offset(hip, knee, ankle) * unit(aside)[:, :2]).sum(axis=1)
    return out


def _step(configuration: Any, task: BodyTask, floor: Floor | None, share: float) -> bool:
    """A share of one Newton step; returns whether the whole was within the tolerances."""
    model = configuration.model
    objective = task.compute_qp_objective(configuration)
    rows, height = floor.rows(configuration.data) if floor else (np.empty((0, model.nv)), np.empty(0))
    n, m = model.nv, len(height)
    low, high = np.full((2, n + m), UNBOUNDED)
    low *= -1
    np.subtract(model.jnt_range[1:, 0], configuration.q[7:], out=low[6:n])
    np.subtract(model.jnt_range[1:, 1], configuration.q[7:], out=high[6:n])
    high[n:] = height
    change = _solve(objective, rows, low, high)
    if change is None and len(rows):  # far below the floor: first return to where the linearisation holds
        change = _solve(objective, rows[:0], low[:n], high[:n])
    if change is None:
        raise MotionError("inverse kinematics found no solution for a frame")
    # a full step from afar would leave the range of the linearisation
    largest = float(np.abs(change[3:]).max())
    configuration.integrate_inplace(change * min(share, LARGEST_STEP / max(largest, LARGEST_STEP)), 1.0)
    return bool((np.abs(change[3:]) < task.tolerance[3:]).all())


def _solve(objective: mink.Objective, rows: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray | None:
    """Minimum of a quadratic programme with bounds on its variables, followed by those on its rows."""
    import daqp

    sense = np.zeros(len(high), dtype=np.int32)
    x, _, status, _ = daqp.solve(objective.H, objective.c, rows, high, low, sense)
    x = np.asarray(x)
    return x if status > 0 and x.shape == objective.c.shape and np.isfinite(x).all() else None
