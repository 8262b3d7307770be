"""Inverse kinematics of whole clips: our joints to their targets, within their limits, above the floor.

Every frame is a small quadratic programme, iterated until it settles. The clip is cut into parts, of which one frame each is
solved at a time, so that numpy works on many poses at once.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from simprep.arrays import BoolArray, FloatArray, IndexArray
from simprep.character import ROLES, SIDES, Character
from simprep.errors import MotionError
from simprep.motion.closed_form import closed_form
from simprep.motion.foot_stance import knee_offset
from simprep.motion.hand_paths import lead_hands
from simprep.motion.retarget_problem import PLACE, ROWS, TURN, Equations, Floor, Pose, integrated, rotation_vectors
from simprep.motion.targets import Targets, unit

LARGEST_STEP = 0.5
"""Largest turn of anything in one step; larger steps are shortened [rad]."""
FULL_STEPS = 4
"""Number of whole steps. Further ones are halved: where spine joints turn against each other, whole ones oscillate."""
UNBOUNDED = 1e30
"""No bound, to the solver."""
PART = 16
"""Frames that are solved one after the other, at least: each starts from the one before it."""
MOST_PARTS = 128
FIRST = 0.1
"""Share of the tolerances for the first frame of a part, which starts from nothing but its closed form."""

TILT = {role: slice(rows.start, rows.start + 2) for role, rows in TURN.items()}
HEADING = {role: rows.start + 2 for role, rows in TURN.items()}
FEET = [number for number, role in enumerate(TURN) if role.endswith("foot")]
FEET_TURN = slice(TURN["left_foot"].start, TURN["right_foot"].stop)


@dataclass(frozen=True)
class RetargetSettings:
    """Weights and effort of the inverse kinematics.

    Attributes:
        position_cost: weight of a joint position [1/m].
        trunk_cost: the same for the spine, neck and head, which other skeletons divide differently.
        head_cost: weight of the head's orientation [1/rad].
        hand_cost: weight of a hand's orientation [1/rad], and of the hinges of an untold one near the floor.
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


class Weights:
    """Weights of the rows, frame by frame, and of the pull to rest.

    Args:
        character: the body.
        settings: of the inverse kinematics.
        targets: tell which orientations the source tells.
        standing: (T, 2) which feet stand.
        led: (T, joints) how firmly hinges chosen beforehand are pulled: with 1 as if the source told their hand.
    """

    def __init__(
        self, character: Character, settings: RetargetSettings, targets: Targets, standing: BoolArray,
        led: FloatArray | None = None,
    ) -> None:  # fmt: skip
        self.settings, self.standing, self.led, model = settings, standing, led, character.model
        self.twisted = _twisted(targets)
        cost = np.full(ROWS, settings.position_cost)
        for role in ROLES:
            if not character.has(role):
                cost[PLACE[role]] = 0.0
            elif role in ("abdomen", "thorax", "neck", "head"):
                cost[PLACE[role]] = settings.trunk_cost
        costs = {"head": settings.head_cost, "hand": settings.hand_cost, "foot": settings.foot_cost}
        for (role, rows), told in zip(TURN.items(), targets.oriented):
            cost[rows] = costs[role.rpartition("_")[2]] * told
            if role.endswith("foot"):
                cost[HEADING[role]] = settings.foot_turn_cost * told
        self.base = cost
        # a foot that cannot turn sideways would tilt the whole body to lie flat
        self.tilts = [character.anatomical(f"{side}_ankle_inversion") is not None for side in SIDES]
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

    def pulls(self, frames: IndexArray) -> FloatArray:
        """Squared weights (N, nv) of the pull of these frames to rest."""
        out = np.tile(self.pull, (len(frames), 1))
        if self.led is not None:
            np.maximum(out[:, 6:], self.settings.hand_cost**2 * self.led[frames], out=out[:, 6:])
        return out

    def rows(self, frames: IndexArray) -> FloatArray:
        """Weights of the rows of these frames (N, ROWS)."""
        settings = self.settings
        out = np.tile(self.base, (len(frames), 1))
        for number, side in enumerate(SIDES):
            stands = self.standing[frames, number]
            yields = 1 + (self.twisted[frames, number] / settings.twist) ** 2
            foot = f"{side}_foot"
            for rows, factor in (
                (PLACE[foot], settings.stance_cost),
                (TILT[foot], settings.stance_tilt_cost if self.tilts[number] else 1.0),
                (slice(HEADING[foot], HEADING[foot] + 1), settings.stance_turn_cost / yields),
            ):
                out[:, rows] *= np.where(stands, factor, 1.0)[:, None]
        return out

    def giving_way(self, turn: FloatArray, frames: IndexArray) -> FloatArray:
        """Factors (N, 6) on the weights of the feet's orientations: less than 1 where a foot cannot be turned as wanted.

        A reweighted robust loss, lest such a foot moves the body.

        Args:
            turn: (N, 2, 3) errors of the feet's orientations [rad].
            frames: (N,) frames.
        """
        off = np.linalg.norm(turn, axis=-1) / self.settings.beyond
        factor = np.where(self.standing[frames] & (off > 1.0), 1 / (1 + off**2), 1.0)
        return np.asarray(factor.repeat(3, axis=1))


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
    start, led = closed_form(targets, character), None
    if floor:
        start, led = lead_hands(start, targets.oriented[1:3], targets.fps, character)
    weights = Weights(character, settings, targets, standing, led)
    solver = _Solver(character, weights, floor)
    out, unsettled = np.empty_like(start), np.zeros(len(start), dtype=bool)
    parts = min(MOST_PARTS, max(1, len(start) // PART))
    edges = np.linspace(0, len(start), parts + 1).astype(np.intp)
    frame, after = edges[:-1].copy(), edges[1:]
    qpos, cost = start[frame], solver.weights.rows(frame)
    number, gave_way = np.zeros(parts, dtype=np.intp), np.zeros(parts, dtype=bool)
    at = np.arange(parts)  # parts with frames left
    lead = np.zeros(model.nv)
    while len(at):
        now = frame[at]
        share = np.where(number[at] < FULL_STEPS, 1.0, 0.5)
        strict = np.where(now == edges[at], FIRST, 1.0)
        qpos[at], settled = solver.step(
            qpos[at], start[now], cost[at], weights.pulls(now), targets.positions[now], targets.orientations[now],
            share, strict,
        )  # fmt: skip
        number[at] += 1
        # a settled frame whose standing feet cannot turn as wanted goes on with less weight on them, once
        asked = np.flatnonzero(settled & ~gave_way[at] & standing[now].any(axis=1))
        if len(asked):
            one = at[asked]
            gave_way[one] = True
            turn = solver.feet_turn(qpos[one], targets.orientations[now[asked]])
            factor = solver.weights.giving_way(turn, now[asked])
            cost[one, FEET_TURN] *= factor
            settled[asked] &= (factor >= 1.0).all(axis=1)
        done = np.flatnonzero(settled | (number[at] >= settings.iterations))
        for index in done:
            part, last = at[index], now[index]
            out[last], unsettled[last] = qpos[part], not settled[index]
            if last + 1 == after[part]:
                continue
            # start with the last frame's deviation from closed form; it changes the start, not the result
            mujoco.mj_differentiatePos(model, lead, 1.0, start[last], out[last])
            qpos[part] = start[last + 1]
            if np.abs(lead[3:]).max() < settings.lead:
                mujoco.mj_integratePos(model, qpos[part], lead, 1.0)
                np.clip(qpos[part, 7:], model.jnt_range[1:, 0], model.jnt_range[1:, 1], out=qpos[part, 7:])
        new = at[done]
        frame[new] += 1
        number[new], gave_way[new] = 0, False
        left = new[frame[new] < after[new]]
        cost[left] = solver.weights.rows(frame[left])
        at = at[frame[at] < after[at]]
    return Solution(out, unsettled)


class _Solver:
    """Newton steps of many poses at once.

    Args:
        character: the body.
        weights: of the rows.
        floor: keep the body above the floor.
    """

    def __init__(self, character: Character, weights: Weights, floor: bool) -> None:
        self.weights, self.model = weights, character.model
        self.equations = Equations(character)
        self.floor = Floor(self.equations) if floor else None

    def feet_turn(self, qpos: FloatArray, orientations: FloatArray) -> FloatArray:
        """Errors of the feet's orientations (B, 2, 3) [rad] of poses (B, nq), to targets (B, 5, 3, 3)."""
        pose = self.equations.poses(qpos)
        current = pose.xmat[:, self.equations.turned[FEET]]
        return rotation_vectors(current @ np.swapaxes(orientations[:, FEET], -1, -2))

    def step(
        self,
        qpos: FloatArray,
        rest: FloatArray,
        cost: FloatArray,
        pull: FloatArray,
        positions: FloatArray,
        orientations: FloatArray,
        share: FloatArray,
        strict: FloatArray,
    ) -> tuple[FloatArray, BoolArray]:
        """Poses after a Newton step, and which of them have settled (B,).

        Args:
            qpos: (B, nq) poses.
            rest: (B, nq) poses that everything is pulled to a little.
            cost: (B, ROWS) weights.
            pull: (B, nv) squared weights of the way to rest.
            positions: (B, 17, 3) of the roles [m].
            orientations: (B, 5, 3, 3) of the roles in `ORIENTED`.
            share: (B,) share of the step that is taken.
            strict: (B,) share of the tolerances that the whole step must be within.
        """
        pose = self.equations.poses(qpos)
        error = cost * self.equations.errors(pose, positions, orientations)
        gradient = np.concatenate([np.zeros((len(qpos), 6)), pull[:, 6:] * (qpos[:, 7:] - rest[:, 7:])], axis=1)
        low, high = np.full((2, len(qpos), self.model.nv), UNBOUNDED)
        low *= -1
        np.subtract(self.model.jnt_range[1:, 0], qpos[:, 7:], out=low[:, 6:])
        np.subtract(self.model.jnt_range[1:, 1], qpos[:, 7:], out=high[:, 6:])
        hessians = []
        for system in self.equations.systems:
            weighted = cost[:, system.rows, None] * self.equations.derivative(pose, system)
            hessian = np.swapaxes(weighted, -1, -2) @ weighted
            diagonal = np.arange(len(system.columns))
            hessian[:, diagonal, diagonal] += pull[:, system.columns]
            hessians.append(hessian)
            gradient[:, system.columns] += (error[:, None, system.rows] @ weighted)[:, 0]
        change = self._minima(pose, hessians, gradient, low, high)
        # a full step from afar would leave the range of the linearisation
        largest = np.abs(change[:, 3:]).max(axis=1)
        settled = np.asarray((np.abs(change[:, 3:]) < strict[:, None] * self.weights.tolerance[3:]).all(axis=1))
        scale = np.minimum(share, LARGEST_STEP / np.maximum(largest, LARGEST_STEP))
        return integrated(qpos, change * scale[:, None]), settled

    def _minima(
        self, pose: Pose, hessians: list[FloatArray], gradient: FloatArray, low: FloatArray, high: FloatArray
    ) -> FloatArray:
        """Minima (B, nv) of the quadratic programmes within bounds and above the floor."""
        count, nv = gradient.shape
        if self.floor is not None:
            which, rows, height = self.floor.rows(pose)
        else:
            which, rows, height = np.zeros(0, dtype=np.intp), np.zeros((0, nv)), np.zeros(0)
        first = np.searchsorted(which, np.arange(count + 1))
        change = np.zeros((count, nv))
        systems = self.equations.systems
        whole = np.zeros(count, dtype=bool)  # poses in which the floor ties the systems together
        for system in systems[1:]:
            whole[which[(rows[:, system.columns] != 0).any(axis=1)]] = True
        for number, (system, hessian) in enumerate(zip(systems, hessians)):
            columns = system.columns
            part = np.linalg.solve(hessian, -gradient[:, columns, None])[..., 0]
            fits = np.asarray(((part >= low[:, columns]) & (part <= high[:, columns])).all(axis=1))
            if number == 0 and len(which):
                sinks = (rows[:, columns] * part[which]).sum(axis=1) < -height
                fits[which[sinks]] = False
            change[:, columns] = part
            for index in np.flatnonzero(~fits & ~whole):
                near = slice(first[index], first[index + 1]) if number == 0 else slice(0, 0)
                change[index, columns] = _minimum(
                    hessian[index], gradient[index, columns], rows[near, columns], height[near],
                    low[index, columns], high[index, columns],
                )  # fmt: skip
        for index in np.flatnonzero(whole):
            joined = np.zeros((nv, nv))
            for system, hessian in zip(systems, hessians):
                joined[np.ix_(system.columns, system.columns)] = hessian[index]
            near = slice(first[index], first[index + 1])
            change[index] = _minimum(joined, gradient[index], rows[near], height[near], low[index], high[index])
        return change


def _twisted(targets: Targets) -> FloatArray:
    """How far each knee folds to the side of its foot's direction (T, 2) [m]."""
    out = np.empty((len(targets.positions), 2))
    for number, side in enumerate(SIDES):
        hip, knee, ankle = (targets.positions[:, ROLES.index(f"{side}_{part}")] for part in ("thigh", "shank", "foot"))
        aside = targets.orientations[:, 3 + number, :, 1] * [1.0, 1.0, 0.0]
        out[:, number] = (knee_offset(hip, knee, ankle) * unit(aside)[:, :2]).sum(axis=1)
    return out


def _minimum(
    hessian: FloatArray, gradient: FloatArray, rows: FloatArray, height: FloatArray, low: FloatArray, high: FloatArray
) -> FloatArray:
    """Minimum of a quadratic programme with bounds on its variables, above the floor: rows x >= -height.

    Raises:
        MotionError: there is none.
    """
    change = _solve(
        hessian, gradient, -rows, np.concatenate([low, np.full(len(rows), -UNBOUNDED)]), np.concatenate([high, height])
    )
    if change is None and len(rows):  # far below the floor: first return to where the linearisation holds
        change = _solve(hessian, gradient, rows[:0], low, high)
    if change is None:
        raise MotionError("inverse kinematics found no solution for a frame")
    return change


def _solve(
    hessian: FloatArray, gradient: FloatArray, rows: FloatArray, low: FloatArray, high: FloatArray
) -> FloatArray | None:
    """Minimum of a quadratic programme with bounds on its variables, followed by those on its rows."""
    import daqp

    sense = np.zeros(len(high), dtype=np.int32)
    x, _, status, _ = daqp.solve(
        np.ascontiguousarray(hessian), np.ascontiguousarray(gradient), np.ascontiguousarray(rows), high, low, sense
    )
    x = np.asarray(x)
    return x if status > 0 and x.shape == gradient.shape and np.isfinite(x).all() else None
