"""Moves on the floor: a shift and a turn about the vertical, fitted to where a body is, and made little by little."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from simprep.arrays import BoolArray, FloatArray
from simprep.character import Character
from simprep.motion.curves import minimum_jerk
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.rotations import multiply_quat, wrap_angle
from simprep.motion.turns import about_vertical, turned

STANDING_WEIGHT, TRUNK_WEIGHT = 4.0, 1.0
"""How much a standing foot and a part of the trunk count where a body is compared with its reference. Feet count most:
who leans has not moved."""
PEAK = 1.875
"""Largest speed of a minimum-jerk step, as a multiple of its mean."""
PEAK_ACCELERATION = 10 / np.sqrt(3)
"""Its largest acceleration, as a multiple of its length over the square of its time."""


@dataclass(frozen=True)
class FloorMove:
    """A turn about a point of the floor, then a shift.

    Attributes:
        shift: (2,) [m].
        turn: counter-clockwise seen from above [rad].
        pivot: (2,) where the turn leaves everything in place [m].
    """

    shift: FloatArray
    turn: float
    pivot: FloatArray

    @property
    def size_m(self) -> float:
        """How far the pivot moves [m]."""
        return float(np.linalg.norm(self.shift))

    def part(self, share: float) -> "FloorMove":
        """A part of the move, about the same pivot."""
        return FloorMove(share * self.shift, share * self.turn, self.pivot)

    def points(self, points: FloatArray, share: FloatArray | float = 1.0) -> FloatArray:
        """Points (..., 2) moved by shares (...) of the move."""
        share = np.asarray(share, dtype=np.float64)
        around = turned(np.asarray(points, dtype=np.float64) - self.pivot, share * self.turn)
        return np.asarray(self.pivot + around + share[..., None] * self.shift)

    def poses(self, qpos: FloatArray, share: FloatArray) -> FloatArray:
        """Poses (F, nq) moved by shares (F,) of the move."""
        out = qpos.copy()
        out[:, :2] = self.points(qpos[:, :2], share)
        out[:, 3:7] = multiply_quat(about_vertical(share * self.turn), qpos[:, 3:7])
        return out

    def undone(self, qpos: FloatArray, share: FloatArray) -> FloatArray:
        """The poses (F, nq) that `poses` made into these."""
        out = qpos.copy()
        back = qpos[:, :2] - self.pivot - share[:, None] * self.shift
        out[:, :2] = self.pivot + turned(back, -share * self.turn)
        out[:, 3:7] = multiply_quat(about_vertical(-share * self.turn), qpos[:, 3:7])
        return out

    def beyond(self, dead_m: float, dead_rad: float) -> "FloorMove":
        """What is left of the move where so much of shift and turn is let be."""
        left = max(0.0, 1 - dead_m / max(self.size_m, 1e-12))
        turn = float(np.sign(self.turn)) * max(0.0, abs(self.turn) - dead_rad)
        return FloorMove(left * self.shift, turn, self.pivot)

    def within(self, seconds: float, speed: float, spin: float, acceleration: float = np.inf) -> "FloorMove":
        """As much of the move as a minimum-jerk step of so many seconds makes within limits.

        Args:
            seconds: that it takes [s].
            speed: largest speed of the shift [m/s].
            spin: largest angular velocity of the turn [rad/s].
            acceleration: largest one of the shift [m/s^2].
        """
        farthest = min(speed * seconds / PEAK, acceleration * seconds**2 / PEAK_ACCELERATION)
        most = spin * seconds / PEAK
        return FloorMove(
            self.shift * min(1.0, farthest / max(self.size_m, 1e-12)),
            float(np.clip(self.turn, -most, most)),
            self.pivot,
        )


@dataclass(frozen=True)
class GradualMove:
    """A move made along a minimum-jerk step.

    Attributes:
        move: the whole.
        first: frame at which it begins.
        frames: how many it takes.
        until: frame from which on nothing more of it is made; None: it is made whole.
    """

    move: FloorMove
    first: int
    frames: int
    until: int | None = None

    def share(self, frames: ArrayLike) -> FloatArray:
        """How much of the move is made at frames (...)."""
        at = np.asarray(frames, dtype=np.float64)
        if self.until is not None:
            at = np.minimum(at, self.until)
        return minimum_jerk((at - self.first) / max(self.frames, 1))

    def ahead(self, frame: float) -> FloorMove:
        """What of it is still to come."""
        return self.move.part(max(0.0, float(self.share(np.inf)) - float(self.share(frame))))


def fit_move(points: FloatArray, to: FloatArray, weights: FloatArray) -> FloorMove:
    """The move that brings points (N, 2) nearest to others (N, 2), by least squares; the pivot is their mean.

    Source: the planar case of the orthogonal Procrustes problem (Schönemann 1966, Psychometrika 31:1).

    Args:
        points: (N, 2) [m].
        to: (N, 2) [m].
        weights: (N,) not negative, not all 0.
    """
    weights = weights / weights.sum()
    middle, goal = weights @ points, weights @ to
    a, b = points - middle, to - goal
    dot = float(weights @ (a * b).sum(axis=1))
    cross = float(weights @ (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]))
    return FloorMove(goal - middle, float(np.arctan2(cross, dot)), middle)


def move_between(reference: FloatArray, body: FloatArray, standing: BoolArray, character: Character) -> FloorMove:
    """Where a body is against its reference, on the floor: the move that brings the reference to the body.

    Pelvis, thorax and feet are compared, standing feet most. A body that leans with its feet in place has hardly moved.

    Args:
        reference: (nq,) pose.
        body: (nq,) pose.
        standing: (2,) feet that stand.
        character: whose poses they are.
    """
    found = forward_kinematics(np.stack([reference, body]), character)
    trunk = [character.segment(role) for role in ("pelvis", "thorax") if character.has(role)]
    parts = [*character.feet, *trunk]
    feet = np.where(standing, STANDING_WEIGHT, 0.0) if np.any(standing) else np.zeros(2)
    weights = np.concatenate([feet + 0.1, np.full(len(trunk), TRUNK_WEIGHT)])
    move = fit_move(found.xpos[0, parts, :2], found.xpos[1, parts, :2], weights)
    return FloorMove(move.shift, float(wrap_angle(move.turn)), move.pivot)
