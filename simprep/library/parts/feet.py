"""Paths of one foot: stances that roll over heel and toe without slipping, and swings between them."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline

from simprep.arrays import BoolArray, FloatArray
from simprep.character import SIDES, Character
from simprep.humanoid_model import humanoid
from simprep.library.parts.limbs import SIGNS
from simprep.motion.curves import Curve, constant, minimum_jerk
from simprep.motion.rotations import axis_rotation

_DIFFERENCE_S = 1e-3  # step of the numerical derivatives at the ends of a swing


@dataclass(frozen=True)
class Stance:
    """One stay of a foot on the floor.

    Attributes:
        start, end: touch-down and lift-off [s].
        x, y: ankle of the flat foot, world [m].
        toe_out: angle of the foot from world x, outward positive [rad].
    """

    start: float
    end: float
    x: float
    y: float
    toe_out: float


@dataclass(frozen=True)
class FootPath:
    """Where one foot is at any time.

    Attributes:
        side: `left` or `right`.
        stances: in order of time; before the first and after the last the foot stays.
        pitch: foot pitch, toe up positive [rad]; in stance the foot rolls over the heel (positive) or the toe
            (negative), whose sphere does not move.
        pivot: further toe-out in stance [rad]; only while heel or toe is up, about the sphere that carries.
        via: (time [s], axis 0 to 2, value [m]) points that the ankle passes in the swings.
        character: the body.
    """

    side: str
    stances: tuple[Stance, ...]
    pitch: Curve = field(default_factory=constant)
    pivot: Curve = field(default_factory=constant)
    via: Sequence[tuple[float, int, float]] = ()
    character: Character = humanoid()

    def at(self, times: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Ankle position (T, 3) [m], foot rotation (T, 3, 3) and whether the foot bears load (T,) at times (T,) [s]."""
        times = np.asarray(times, dtype=np.float64)
        starts = np.array([stance.start for stance in self.stances])
        index = np.clip(np.searchsorted(starts, times + 1e-9, side="right") - 1, 0, None)
        ends = np.array([stance.end for stance in self.stances])
        swing = (times > ends[index] - 1e-9) & (index < len(starts) - 1)
        position = np.empty((len(times), 3))
        turn = np.empty(len(times))
        for number, stance in enumerate(self.stances):
            mine = (index == number) & ~swing
            position[mine] = self._stance_position(stance, times[mine])
            turn[mine] = stance.toe_out + self.pivot(times[mine])
            mine = (index == number) & swing
            if mine.any():
                following = self.stances[number + 1]
                position[mine] = self._swing_position(stance, following, times[mine])
                begin = stance.toe_out + self.pivot(np.array([stance.end]))
                end = following.toe_out + self.pivot(np.array([following.start]))
                share = (times[mine] - stance.end) / (following.start - stance.end)
                turn[mine] = begin + (end - begin) * minimum_jerk(share)
        return position, self._rotation(turn, self.pitch(times)), ~swing

    def _rotation(self, toe_out: FloatArray, pitch: FloatArray) -> FloatArray:
        return axis_rotation("z", SIGNS[self.side] * toe_out) @ axis_rotation("y", -pitch)

    def _stance_position(self, stance: Stance, times: FloatArray) -> FloatArray:
        centres, _ = foot_spheres(self.side, self.character)
        heel, toe = centres[np.argmin(centres[:, 0])], centres[np.argmax(centres[:, 0])]
        pitch = self.pitch(times)
        pivot = np.where(pitch[:, None] > 0, heel, toe)
        flat = np.array([stance.x, stance.y, ankle_height(self.character)])
        still = flat + np.einsum("ij,tj->ti", self._rotation(np.array(stance.toe_out), np.array(0.0)), pivot)
        turned = self._rotation(stance.toe_out + self.pivot(times), pitch)
        return np.asarray(still - np.einsum("tij,tj->ti", turned, pivot))

    def _swing_position(self, before: Stance, after: Stance, times: FloatArray) -> FloatArray:
        out = np.empty((len(times), 3))
        h = _DIFFERENCE_S
        left = self._stance_position(before, before.end - h * np.array([0.0, 1.0, 2.0]))
        right = self._stance_position(after, after.start + h * np.array([0.0, 1.0, 2.0]))
        v0, a0 = (3 * left[0] - 4 * left[1] + left[2]) / (2 * h), (left[0] - 2 * left[1] + left[2]) / h**2
        v1, a1 = (-3 * right[0] + 4 * right[1] - right[2]) / (2 * h), (right[0] - 2 * right[1] + right[2]) / h**2
        for axis in range(3):
            points = [(t, v) for t, a, v in self.via if a == axis and before.end < t < after.start]
            points = [(before.end, left[0, axis]), *sorted(points), (after.start, right[0, axis])]
            knots, values = np.array(points).T
            begin: Any = [(1, v0[axis]), (2, a0[axis])]
            end: Any = [(1, v1[axis]), (2, a1[axis])]
            spline = make_interp_spline(knots, values, k=5, bc_type=(begin, end))
            out[:, axis] = spline(times)
        return out


def foot_spheres(side: str, character: Character = humanoid()) -> tuple[FloatArray, FloatArray]:
    """Centres (N, 3) in the foot frame and radii (N,) of the spheres of a foot, ordered as `Character.soles` [m].

    Args:
        side: `left` or `right`.
        character: the body.
    """
    model = character.model
    ids = character.sole_geoms[SIDES.index(side)]
    return np.array(model.geom_pos[ids]), np.array(model.geom_size[ids, 0])


def ankle_height(character: Character = humanoid()) -> float:
    """Height of the ankle centre above the floor when the foot is flat [m]."""
    centres, radii = foot_spheres("left", character)
    return float((radii - centres[:, 2]).max())


def both_feet(paths: Sequence[FootPath], times: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
    """`FootPath.at` of the left and the right foot together: (T, 2, 3) [m], (T, 2, 3, 3) and (T, 2)."""
    position, rotation, contacts = (np.stack(one, axis=1) for one in zip(*(path.at(times) for path in paths)))
    return position, rotation, contacts


def lowest_point(side: str, rotation: FloatArray, character: Character = humanoid()) -> FloatArray:
    """Height (T,) of the lowest point of a foot relative to its ankle centre, negative [m].

    Args:
        side: `left` or `right`.
        rotation: (T, 3, 3) of the foot.
        character: the body.
    """
    centres, radii = foot_spheres(side, character)
    return np.asarray(((rotation @ centres.T)[:, 2, :] - radii).min(axis=-1))
