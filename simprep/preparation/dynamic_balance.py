"""Dynamic balance: the COM's displacement that brings the XcoM over the coming support, and the pelvis that helps.

The paper's C_b draws the COM to the centre of support as it is in the frame. A walking body has its COM elsewhere with good reason:
it falls towards the next foothold. What counts is the extrapolated COM (Hof et al. 2005), and the support that it will meet: here the
mean centre of support over the coming half step. The XcoM of a COM displaced by d(t) moves by d + d' / omega0, so the cost is
quadratic in d, and one Gauss-Newton step over the whole motion finds its least.
"""

import numpy as np
from scipy.ndimage import gaussian_filter1d, minimum_filter1d, uniform_filter1d
from scipy.sparse import csc_array, diags_array, eye_array, vstack
from scipy.sparse.linalg import spsolve

from simprep.arrays import FloatArray
from simprep.character import SIDES, Character
from simprep.humanoid_model import GRAVITY
from simprep.motion.kinematics import Kinematics, forward_kinematics
from simprep.motion.limb_ik import legs, solve_leg
from simprep.motion.rotations import rotation_matrix
from simprep.preparation.settings import DEFAULT_SETTINGS, PreparationSettings

_LOWEST_PENDULUM_M = 0.2
_MISSED_M = 2e-4  # a foot this far from its place is not where it stood
_SMOOTH_S = 0.1  # over which the pelvis holds back where the legs cannot follow
_TRIES = 8


class DynamicBalance:
    """The dynamic cost of a motion as a function of its COM's displacement d (T, 2).

    cost(d) = mean of |XcoM - coming support|^2 [m^2] over frames with support ahead, + smoothing and size of d.

    Args:
        com: (T, 3) of the motion as it is [m].
        centres: (T, 2) centres of support [m]; NaN in flight.
        fps: frames per second [1/s].
        settings: `look_ahead`, `com_reach`, `support_smoothing`.
    """

    def __init__(
        self, com: FloatArray, centres: FloatArray, fps: float, settings: PreparationSettings = DEFAULT_SETTINGS
    ) -> None:
        n = len(com)
        self.support = coming_support(centres, max(1, round(settings.look_ahead * fps)))
        omega = np.sqrt(GRAVITY / np.maximum(com[:, 2], _LOWEST_PENDULUM_M))
        rate = _rate(n, fps)
        self._extrapolate = csc_array(eye_array(n) + diags_array(1 / omega) @ rate)
        self.xcom = np.asarray(self._extrapolate @ com[:, :2])
        known = np.isfinite(self.support[:, 0])
        self._weight = known / max(1, int(known.sum()))
        wanted = np.where(known[:, None], self.support - self.xcom, 0.0)
        length = np.linalg.norm(wanted, axis=1, keepdims=True)
        self._wanted = wanted * np.minimum(1.0, settings.com_reach / np.maximum(length, 1e-12))
        tau = settings.support_smoothing * fps
        self._bend = csc_array(tau**2 * _second_difference(n) / np.sqrt(n))
        self._size = 0.1 / np.sqrt(n)

    def distance(self, displacement: FloatArray) -> FloatArray:
        """Distance (T,) of the XcoM to the coming support with the COM displaced [m]; NaN without support ahead."""
        moved = self.xcom + self._extrapolate @ displacement
        return np.asarray(np.linalg.norm(moved - self.support, axis=1))

    def cost(self, displacement: FloatArray) -> float:
        """What `solve` minimises [m^2]; wishes beyond `com_reach` are cut to it."""
        missed = self._extrapolate @ displacement - self._wanted
        bent = self._bend @ displacement
        return float((self._weight @ missed**2).sum() + (bent**2).sum() + (self._size**2 * displacement**2).sum())

    def gradient(self, displacement: FloatArray) -> FloatArray:
        """Gradient (T, 2) of `cost` [m]."""
        missed = self._extrapolate @ displacement - self._wanted
        pull = self._extrapolate.T @ (self._weight[:, None] * missed)
        return np.asarray(2 * (pull + self._bend.T @ (self._bend @ displacement) + self._size**2 * displacement))

    def solve(self) -> FloatArray:
        """The displacement (T, 2) of least cost: one Gauss-Newton step, as the cost is quadratic [m]."""
        rows = vstack(
            [
                diags_array(np.sqrt(self._weight)) @ self._extrapolate,
                self._bend,
                self._size * eye_array(len(self._wanted)),
            ]
        )
        right = self._extrapolate.T @ (self._weight[:, None] * self._wanted)
        return np.asarray(spsolve(csc_array(rows.T @ rows), right)).reshape(-1, 2)


def coming_support(centres: FloatArray, frames: int) -> FloatArray:
    """Mean centre of support (T, 2) of each frame and the coming ones [m]; flight is left out, NaN where all of it is flight.

    Args:
        centres: (T, 2) [m]; NaN in flight.
        frames: how many, this one included.
    """
    known = np.isfinite(centres[:, 0])
    padded = np.concatenate([np.where(known[:, None], centres, 0.0), np.repeat(centres[-1:], frames - 1, axis=0)])
    there = np.concatenate([known, np.repeat(known[-1:], frames - 1)]).astype(float)
    padded = np.where(there[:, None] > 0, padded, 0.0)
    total = np.concatenate([np.zeros((1, 2)), np.cumsum(padded, axis=0)])
    count = np.concatenate([[0.0], np.cumsum(there)])
    n = len(centres)
    number = count[frames : frames + n] - count[:n]
    mean = (total[frames : frames + n] - total[:n]) / np.maximum(number, 1.0)[:, None]
    return np.where(number[:, None] > 0, mean, np.nan)


def shift_pelvis(
    qpos: FloatArray, kinematics: Kinematics, shift: FloatArray, fps: float, character: Character
) -> tuple[FloatArray, Kinematics, FloatArray]:
    """Move the pelvis on the floor while both feet stay exactly as they are, in the air too; hips, knees and ankles follow.

    Where a leg is too short, or a joint at its limit, the pelvis moves less, smoothly in time.

    Args:
        qpos: (T, nq).
        kinematics: of `qpos`.
        shift: (T, 2) wanted [m].
        fps: frames per second [1/s].
        character: whose poses they are.

    Returns:
        The poses, their kinematics, and the share (T,) of the shift that was made.
    """
    feet = np.array(character.feet)
    half = max(1, round(_SMOOTH_S * fps))
    most = np.ones(len(qpos))
    rotation = rotation_matrix(kinematics.xquat)
    for _ in range(_TRIES):
        lowest = minimum_filter1d(most, 2 * half + 1, mode="nearest")
        share = np.minimum(gaussian_filter1d(lowest, half / 3, truncate=3.0, mode="nearest"), most)
        moved = np.flatnonzero((share > 0) & (np.abs(shift).max(axis=1) > 0))
        out = qpos.copy()
        out[:, :2] += share[:, None] * shift
        pelvis = kinematics.xpos[moved, 0].copy()
        pelvis[:, :2] += share[moved, None] * shift[moved]
        for side, leg in enumerate(legs(character)):
            shank = character.segment(f"{SIDES[side]}_shank")
            angles = solve_leg(
                leg, pelvis, rotation[moved, 0], kinematics.xpos[moved, feet[side]], rotation[moved, feet[side]],
                rotation[moved, shank, :, 1],
            )  # fmt: skip
            out[moved[:, None], 7 + leg.hinges] = np.clip(angles, leg.low, leg.high)
        after = forward_kinematics(out, character)
        missed = np.abs(after.foot_points - kinematics.foot_points).max(axis=(1, 2, 3)) > _MISSED_M
        if not missed.any():
            return out, after, np.asarray(share)
        most = np.where(missed, np.where(most > 0.1, 0.6 * share, 0.0), most)
    return qpos.copy(), kinematics, np.zeros(len(qpos))


def pelvis_shift(displacement: FloatArray, share: FloatArray, fps: float, reach: float) -> FloatArray:
    """Shift of the pelvis (T, 2) that helps to displace the COM: as far as it, at most `reach`, eased in by `share` (T,) [m]."""
    length = np.linalg.norm(displacement, axis=1, keepdims=True)
    bounded = displacement * (reach * np.tanh(length / max(reach, 1e-12)) / np.maximum(length, 1e-12))
    smooth = uniform_filter1d(bounded, max(1, round(0.05 * fps)), axis=0, mode="nearest")
    return np.asarray(share[:, None] * smooth)


def _rate(n: int, fps: float) -> csc_array:
    """Central differences over time (n, n) [1/s], one-sided at the ends."""
    frames = np.arange(n)
    after, before = np.minimum(frames + 1, n - 1), np.maximum(frames - 1, 0)
    value = fps / np.maximum(after - before, 1)
    values = np.concatenate([value, -value])
    return csc_array((values, (np.tile(frames, 2), np.concatenate([after, before]))), shape=(n, n))


def _second_difference(n: int) -> csc_array:
    rows = np.arange(max(n - 2, 0))
    values = np.repeat([1.0, -2.0, 1.0], len(rows))
    return csc_array((values, (np.tile(rows, 3), np.concatenate([rows, rows + 1, rows + 2]))), shape=(max(n - 2, 1), n))
