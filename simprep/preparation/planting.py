"""Keep supporting feet where they stand: where each foot should be in every frame, then inverse kinematics.

In a stance the foot may roll from heel to toe as the motion has it, about the points that carry it, which stay put. Its
heading is kept. What the source itself slides is kept in proportion to 1 - weight, so that an unprepared motion comes
out unchanged. Between stances the correction fades smoothly.
"""

from copy import copy
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from simprep.arrays import BoolArray, FloatArray
from simprep.character import SIDES, Character
from simprep.motion.contacts import stances
from simprep.motion.curves import dying_away, minimum_jerk
from simprep.motion.kinematics import Kinematics, changed_kinematics, forward_kinematics
from simprep.motion.limb_ik import Leg, leg_of_each, legs, solve_leg
from simprep.motion.rotations import axis_rotation, rotation_matrix, unwrapped
from simprep.motion.turns import turned
from simprep.preparation.settings import DEFAULT_SETTINGS, PreparationSettings

_CARRY_M = 0.004  # a foot point this much higher than the lowest carries 1/e of its share
_NOTHING = 1e-9
_PASSES = 5
_DEEP_M = 0.0005
_FAR_M = 0.002
_ASTRAY_M = 1e-4  # the point that carries a standing foot is missed by more than this
_STEEP = 0.5
_HEEL_PIVOTS, _BALL_PIVOTS, _TOE_PIVOTS = 1e-3, 0.03, 1.0  # how much a carrying point takes part in a pivot


@dataclass(frozen=True)
class Standing:
    """How feet stand where motions are stitched again and again; the defaults change nothing.

    Attributes:
        ease_in: time within which the lowering of the pelvis sets in, where the first frame is given already [s].
        deepest: farthest lowering of the pelvis [m].
        turning: (T, 2) `foot_heading`, of which a standing foot keeps every change, as in the pivot of a kick [rad];
            None: what the source turns, in proportion to 1 - weight.
        landing: (T, 2, 4) corrections, as `Planted.corrections`, of a foot that lands in this frame; None: 0.
        yielding: where a joint limit keeps a foot from its place, it turns instead, about the point that carries it.
    """

    ease_in: float = 0.0
    deepest: float = np.inf
    turning: FloatArray | None = None
    landing: FloatArray | None = None
    yielding: bool = False


_AS_EVER = Standing()


@dataclass(frozen=True)
class Planted:
    """A motion whose supporting feet stand still.

    Attributes:
        qpos: (T, nq).
        foot_error: (T, 2) distance of each ankle from where it should be, supporting or not [m].
        pelvis_drop: (T,) how far the pelvis was lowered so that the legs reach [m].
        kinematics: of `qpos`.
        corrections: (T, 2, 4) how far each foot was shifted [m] and turned about the vertical [rad].
    """

    qpos: FloatArray
    foot_error: FloatArray
    pelvis_drop: FloatArray
    kinematics: Kinematics
    corrections: FloatArray


def plant_feet(
    qpos: FloatArray,
    source: Kinematics | None,
    contacts: BoolArray,
    weight: FloatArray,
    reference_height: FloatArray,
    fps: float,
    character: Character,
    settings: PreparationSettings = DEFAULT_SETTINGS,
    start: FloatArray | None = None,
    standing: Standing = _AS_EVER,
) -> Planted:
    """Move the legs (and lower the pelvis where they cannot reach) so that supporting feet stay put.

    Args:
        qpos: (T, nq) the motion to correct.
        source: kinematics of the motion it was made from, whose contacts these are; None: of `qpos` itself.
        contacts: (T, 2) supporting feet.
        weight: (T,) how far `qpos` is from the source: 0 = it is the source, 1 = nothing of it is left.
        reference_height: (2,) or (T, 2) height of each sole above the floor at weight 1 [m].
        fps: frames per second [1/s].
        character: whose poses they are.
        settings: times and clearances.
        start: (2, 4) corrections of the first frame, where a stance goes on from an earlier part of the motion.
        standing: how feet stand in the middle of a longer motion.
    """
    before = forward_kinematics(qpos, character)
    rotation = rotation_matrix(before.xquat)
    source = before if source is None else source
    goal = np.empty((len(qpos), 2, 3))
    goal_rotation = np.empty((len(qpos), 2, 3, 3))
    changed = np.zeros((len(qpos), 2), dtype=bool)
    corrections = np.zeros((len(qpos), 2, 4))
    start = np.zeros((2, 4)) if start is None else start
    for side, (leg, foot) in enumerate(zip(legs(character), character.feet)):
        pivots = standing.turning is not None
        track = _Track(leg, before.xpos[:, foot], rotation[:, foot], pivots)
        if source is before:
            origin = track
        else:
            origin = _Track(leg, source.xpos[:, foot], rotation_matrix(source.xquat[:, foot]), pivots)
        height = reference_height[..., side]
        value = _corrections(
            track, origin, contacts[:, side], weight, height, fps, settings, start[side], standing, side
        )
        corrections[:, side] = value
        shift, turn = value[:, :3], value[:, 3]
        goal[:, side] = track.ankle + shift
        goal_rotation[:, side] = axis_rotation("z", turn) @ track.rotation
        changed[:, side] = (np.abs(shift).max(axis=1) > _NOTHING) | (np.abs(turn) > _NOTHING)
    drop = np.minimum(_pelvis_drop(before, goal, changed, fps, character, settings), standing.deepest)
    if standing.ease_in > 0:
        drop *= minimum_jerk(np.arange(len(qpos)) / (standing.ease_in * fps))
    changed |= (drop > _NOTHING)[:, None]
    out = qpos.copy()
    out[:, 2] -= drop
    pelvis = before.xpos[:, 0] - drop[:, None] * np.array([0.0, 0.0, 1.0])
    aim = goal.copy()
    missed = changed
    after = before
    moved = missed.any(axis=1) | (drop != 0)
    shanks = np.array([character.segment(f"{side}_shank") for side in SIDES])
    for _ in range(2 * _PASSES if standing.yielding else _PASSES):
        frames, sides = np.nonzero(missed)
        leg = leg_of_each(character, sides)
        angles = solve_leg(
            leg,
            pelvis[frames],
            rotation[frames, 0],
            aim[frames, sides],
            goal_rotation[frames, sides],
            rotation[frames, shanks[sides], :, 1],
            _STEEP if standing.yielding else 0.0,
        )
        out[frames[:, None], 7 + leg.hinges] = np.clip(angles, leg.low, leg.high)
        after = changed_kinematics(after, out, np.flatnonzero(moved), character)
        missed = changed & _keep_carrying_points(aim, goal, goal_rotation, after, character)
        if standing.yielding:
            missed |= changed & _yield(aim, goal, goal_rotation, after, contacts, character)
        moved = missed.any(axis=1)
        if not moved.any():
            break
    error = np.linalg.norm(after.xpos[:, character.feet] - goal, axis=-1)
    return Planted(out, error, drop, after, corrections)


def foot_heading(rotation: FloatArray) -> FloatArray:
    """Turn of feet (T, ..., 3, 3) about the vertical (swing-twist decomposition): (T, ...) [rad], continuous over T.

    It is defined for every tilt but upside down, while the toe's direction on the floor vanishes when the heel is high.
    """
    sine, cosine = rotation[..., 1, 0] - rotation[..., 0, 1], rotation[..., 0, 0] + rotation[..., 1, 1]
    return unwrapped(np.arctan2(sine, cosine))


def _keep_carrying_points(
    aim: FloatArray, goal: FloatArray, goal_rotation: FloatArray, after: Kinematics, character: Character
) -> BoolArray:
    """Feet (T, 2) that a joint limit has tilted into the floor; `aim` changes so that their lowest points come right."""
    missed = np.zeros(aim.shape[:2], dtype=bool)
    for side, leg in enumerate(legs(character)):
        wanted = goal[:, side, None] + np.einsum("tij,kj->tki", goal_rotation[:, side], leg.points)  # (T, N, 3)
        wanted[..., 2] -= leg.radii
        found = after.foot_points[:, side]
        lowest = found[..., 2].argmin(axis=1)
        frames = np.flatnonzero(found[..., 2].min(axis=1) < wanted[..., 2].min(axis=1) - _DEEP_M)
        aim[frames, side] += wanted[frames, lowest[frames]] - found[frames, lowest[frames]]
        missed[frames, side] = True
    return missed


def _yield(
    aim: FloatArray,
    goal: FloatArray,
    goal_rotation: FloatArray,
    after: Kinematics,
    contacts: BoolArray,
    character: Character,
) -> BoolArray:
    """Feet (T, 2) that a limit keeps from their place; they want the orientation they got, about the carrying point.

    `aim`, `goal` (T, 2, 3) and `goal_rotation` (T, 2, 3, 3) change in place.
    """
    feet = np.array(character.feet)
    ankles = after.xpos[:, feet]
    off = np.linalg.norm(ankles - goal, axis=-1) > _FAR_M
    frames, sides = np.nonzero(off | contacts)
    leg = leg_of_each(character, sides)
    wanted = goal_rotation[frames, sides]
    found = rotation_matrix(after.xquat[frames, feet[sides]])
    points = wanted @ leg.points.swapaxes(1, 2)  # (N, 3, points)
    now = found @ leg.points.swapaxes(1, 2)
    share = _carrying(points[:, 2] - leg.radii) * _pivot(leg)
    share /= share.sum(axis=1, keepdims=True)
    swung = ((points - now) * share[:, None]).sum(axis=2)
    # a limit may leave the ankle where it should be and turn the point that carries away
    off[frames, sides] |= np.linalg.norm(goal[frames, sides] - ankles[frames, sides] + swung, axis=1) > _ASTRAY_M
    picked = off[frames, sides]
    frames, sides = frames[picked], sides[picked]
    place = goal[frames, sides] + swung[picked]
    deep = place[:, 2] + (now[picked, 2] - leg.radii[picked]).min(axis=1)
    place[:, 2] -= np.minimum(deep, 0.0)
    goal[frames, sides] = aim[frames, sides] = place
    goal_rotation[frames, sides] = found[picked]
    return np.asarray(off)


def _carrying(height: FloatArray) -> FloatArray:
    """How much points (..., N) carry of a foot, in no unit, by their heights [m]: most the lowest."""
    return np.asarray(np.exp(-(height - height.min(axis=-1, keepdims=True)) / _CARRY_M))


class _Track:
    """One foot over time, with the places of its points relative to the ankle."""

    def __init__(self, leg: Leg, ankle: FloatArray, rotation: FloatArray, pivots: bool) -> None:
        self.leg, self.ankle, self.rotation = leg, ankle, rotation
        self.points = np.einsum("tij,kj->tki", rotation, leg.points)  # (T, N, 3)
        self.heading = foot_heading(rotation) if pivots else unwrapped(np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0]))

    def part(self, frames: slice) -> "_Track":
        """Some of its frames."""
        some = copy(self)
        some.ankle, some.rotation, some.points = self.ankle[frames], self.rotation[frames], self.points[frames]
        some.heading = self.heading[frames]
        return some

    @property
    def sole(self) -> FloatArray:
        """(T,) height of the lowest point relative to the ankle."""
        return np.asarray((self.points[..., 2] - self.leg.radii).min(axis=1))

    def rolling(self, turn: FloatArray, pivoting: bool = False) -> FloatArray:
        """(T - 1, 2) ankle displacement per frame that keeps the carrying points in place, the foot turned by `turn`.

        Pivoting, it turns about its toe where that carries.
        """
        plan = turned(self.points[..., :2], turn[:, None])  # (T, N, 2)
        share = _carrying(self.points[..., 2] - self.leg.radii)
        share /= share.sum(axis=1, keepdims=True)
        between = (share[1:] + share[:-1]) / 2
        steps = -(between[..., None] * np.diff(plan, axis=0)).sum(axis=1)
        if pivoting:
            pivot = between * _pivot(self.leg)
            apart = between - pivot / pivot.sum(axis=1, keepdims=True)
            middle = ((plan[1:] + plan[:-1]) / 2 * apart[..., None]).sum(axis=1)
            angle = np.diff(self.heading + turn)[:, None]
            steps += angle * np.stack([-middle[:, 1], middle[:, 0]], axis=-1)
        return np.asarray(steps)


def _corrections(
    track: _Track,
    origin: _Track,
    contact: BoolArray,
    weight: FloatArray,
    reference_height: FloatArray | float,
    fps: float,
    settings: PreparationSettings,
    start: FloatArray,
    standing: Standing,
    side: int,
) -> FloatArray:
    """Shift of the ankle and turn of the foot about the vertical, (T, 4); `start` are those of the first frame, in stance."""
    n = len(contact)
    value = np.zeros((n, 4))  # x, y, z, heading
    turning = None if standing.turning is None else standing.turning[:, side]
    landings = value if standing.landing is None else standing.landing[:, side]
    height = (1 - weight) * (origin.ankle[:, 2] + origin.sole) + weight * reference_height
    runs = stances(contact)
    for first, after in runs:
        part = slice(first, after)
        begin = start if first == 0 else landings[first].copy()
        keep = 1 - (weight[part][1:] + weight[part][:-1]) / 2
        steps = keep * np.diff(origin.heading[part]) if turning is None else np.diff(turning[part])
        own = _from_zero(steps)
        turn = begin[3] + own - (track.heading[part] - track.heading[first])
        stance = track.part(part)
        walked = stance.rolling(turn, turning is not None)
        if keep.any():
            before = origin.part(part)
            slip = np.diff(before.ankle[:, :2], axis=0) - before.rolling(np.zeros(after - first))
            twist = (track.heading[part] + turn - origin.heading[part])[:-1]
            walked += keep[:, None] * turned(slip, twist)
        place = _from_zero(walked)
        value[part, :2] = begin[:2] + place - (stance.ankle[:, :2] - stance.ankle[0, :2])
        value[part, 2] = height[part] - (stance.ankle[:, 2] + stance.sole)
        value[part, 3] = turn
    ease = max(2, round(settings.foot_ease * fps))
    edges = [(0, 0), *runs, (n, n)]
    for (landing, left), (landed, stop) in pairwise(edges):
        if landed > left:
            _bridge(value, landing, left, landed, stop, ease)
    moved = track.ankle[:, :2] + value[:, :2]
    travel = np.zeros(n)
    for (_, left), (landed, _) in pairwise(runs):
        distance = np.linalg.norm(moved[landed] - moved[left - 1])
        phase = np.arange(1, landed - left + 1) / (landed - left + 1)
        travel[left:landed] = min(settings.step_clearance, 0.3 * distance) * np.sin(np.pi * phase) ** 2
    sole = track.ankle[:, 2] + track.sole + value[:, 2]
    floor = np.minimum(0.0, height) + weight * travel
    touched = ~contact & ((weight > 0) | (np.abs(value).max(axis=1) > _NOTHING))
    value[:, 2] += np.where(touched, np.maximum(floor - sole, 0.0), 0.0)
    return value


def _pivot(leg: Leg) -> FloatArray:
    """(..., N) how much each point of the sole takes part in a pivot: most the foremost ones, least the rearmost."""
    forward = leg.points[..., 0]
    share = np.where(forward == forward.max(axis=-1, keepdims=True), _TOE_PIVOTS, _BALL_PIVOTS)
    return np.where(forward == forward.min(axis=-1, keepdims=True), _HEEL_PIVOTS, share)


def _bridge(value: FloatArray, start: int, left: int, landed: int, stop: int, ease: int) -> None:
    """Fill a swing, frames left to landed - 1, so that the corrections at both its ends fade with continuous speed."""
    length = min(landed - left + 1, ease)
    frames = np.arange(1, length)
    share = (frames / length)[:, None]
    if left > 0:
        held = value[left - 1]
        slope = held - value[left - 2] if left - start >= 2 else np.zeros(4)
        value[left + frames - 1] += dying_away(share, held, slope * length)
    if landed < len(value):
        held = value[landed]
        slope = held - value[landed + 1] if stop - landed >= 2 else np.zeros(4)
        value[landed - frames] += dying_away(share, held, slope * length)


def _from_zero(steps: FloatArray) -> FloatArray:
    return np.concatenate([np.zeros((1, *steps.shape[1:])), steps]).cumsum(axis=0)


def _pelvis_drop(
    before: Kinematics,
    goal: FloatArray,
    changed: BoolArray,
    fps: float,
    character: Character,
    settings: PreparationSettings,
) -> FloatArray:
    """How far to lower the pelvis, smoothly in time, so that no leg has to be longer than it is."""
    need = np.zeros(len(goal))
    for side, leg in enumerate(legs(character)):
        hip = before.xpos[:, character.segment(f"{SIDES[side]}_thigh")]
        ankle = before.xpos[:, character.feet[side]]
        reach = np.maximum(settings.leg_reach * (leg.thigh + leg.shank), np.linalg.norm(ankle - hip, axis=1))
        line = goal[:, side] - hip
        plan = (line[:, :2] ** 2).sum(axis=1)
        depth = np.sqrt(np.maximum(reach**2 - plan, 0.0))
        need = np.maximum(need, np.where(changed[:, side], -line[:, 2] - depth, 0.0))
    if not (need > _NOTHING).any():
        return np.zeros(len(goal))
    half = max(1, round(0.1 * fps))
    wide = maximum_filter1d(need, 2 * half + 1, mode="nearest")
    return np.asarray(gaussian_filter1d(wide, half / 3, truncate=3.0, mode="nearest"))
