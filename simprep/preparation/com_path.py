"""Where the posture optimisation should move the COM: a smooth path that is nearer to the support centre in every frame.

The centre of the support polygon jumps by half a step whenever a foot lands or lifts. A body cannot follow, and a centre
smoothed in time pulls the COM away from the raw one around every jump. A COM displaced by d is nearer to a centre at e
(both from where the COM was) exactly if d lies inside the disc about e whose edge passes through 0. So the smooth path
d(t) near the raw pull that keeps within all discs is taken: a convex problem, solved for the whole motion at once.
"""

import numpy as np
from scipy.linalg import cholesky_banded
from scipy.linalg.lapack import dpbtrs

from simprep.arrays import FloatArray

_MARGIN_M = 0.005  # the path comes nearer by at least this ...
_MARGIN_SHARE = 0.2  # ... or by this share of the distance, where that is less
_ITERATIONS = 200  # stopping early leaves a fraction of a millimetre where centres jump; exactness there costs jerk
_SETTLED_M = 1e-14  # per iteration: rounding
_PENALTY = 3.0
_REPAIR_MARGIN = 0.2  # share of the margin that a repair keeps


def smooth_path_in_discs(wanted: FloatArray, centre: FloatArray, radius: FloatArray, tau: float) -> FloatArray:
    """Path x (T, 2) that minimises sum |x - wanted|^2 + tau^4 sum |second difference of x|^2 with |x - centre| <= radius.

    By the alternating direction method of multipliers (Boyd et al. 2011, section 5.2), one banded solve per iteration. It
    stays smooth where it stops early, so it may miss a disc by less than a millimetre. Where no two discs disagree, it is
    `wanted` after a low-pass filter of second order.

    Args:
        wanted: (T, 2) [m].
        centre: (T, 2) [m].
        radius: (T,) [m]; infinite where the path is free.
        tau: time constant [frames].
    """
    n = len(wanted)
    bound = np.isfinite(radius)
    wanted, centre = np.ascontiguousarray(wanted.T), np.where(bound, centre.T, 0.0)  # rows are x and y: LAPACK's order
    bands = np.zeros((3, n))
    bands[0] = 1.0 + _PENALTY * bound
    for i, a in enumerate((1.0, -2.0, 1.0)):
        for j, b in enumerate((1.0, -2.0, 1.0)[: i + 1]):
            if n > 2:
                bands[i - j, j : n - 2 + j] += tau**4 * a * b
    factor = cholesky_banded(bands, lower=True)
    x = z = wanted
    dual = np.zeros_like(wanted)
    penalty = np.tile(_PENALTY * bound, (2, 1))
    for number in range(_ITERATIONS):
        before, x = x, dpbtrs(factor, (wanted + penalty * (z - dual)).T, lower=True, overwrite_b=True)[0].T
        if number % 10 == 9 and np.abs(x - before).max() < _SETTLED_M:
            break
        free = x + dual
        offset = free - centre
        square = offset * offset
        length = np.sqrt(square[0] + square[1])
        offset *= np.minimum(1.0, radius / np.maximum(length, 1e-12))
        z = centre + offset
        dual = free - z
    return np.asarray(x.T)


def displacement_path(pull: FloatArray, reach: float, tau: float) -> FloatArray:
    """Smooth displacement (T, 2) [m] of the COM, nearer to the support centre in every frame; in flight it dies away.

    Args:
        pull: (T, 2) from the COM to the support centre of its frame [m]; NaN in flight.
        reach: longest displacement asked for [m].
        tau: time constant [frames].
    """
    distance = np.linalg.norm(np.nan_to_num(pull), axis=1)
    wanted = np.nan_to_num(pull) * np.minimum(1.0, reach / np.maximum(distance, 1e-12))[:, None]
    return smooth_path_in_discs(wanted, pull, _radius(pull, np.ones(len(pull))), tau)


def displacement_repair(moved: FloatArray, pull: FloatArray, share: FloatArray, tau: float) -> FloatArray:
    """Small smooth addition (T, 2) [m] to a displacement that puts the COM nearer to the support centre; 0 where share is.

    Args:
        moved: (T, 2) displacement of the COM [m].
        pull: (T, 2) from the COM before it to the support centre [m]; NaN in flight.
        share: (T,) how much of the posture change is used, 0 to 1.
        tau: time constant [frames].
    """
    radius = np.where(share > 0, _radius(pull, share * _REPAIR_MARGIN), np.inf)
    centre, none = pull - moved, np.zeros_like(moved)
    if not (np.linalg.norm(centre, axis=1) > radius).any():  # near enough everywhere
        return none
    return smooth_path_in_discs(none, centre, radius, tau) * (share > 0)[:, None]


def _radius(pull: FloatArray, share: FloatArray) -> FloatArray:
    """Radii (T,) of the discs, a margin within the COM's distance; infinite in flight."""
    distance = np.linalg.norm(pull, axis=1)
    return np.where(np.isnan(distance), np.inf, distance - share * np.minimum(_MARGIN_M, _MARGIN_SHARE * distance))
