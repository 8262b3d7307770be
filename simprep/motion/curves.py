"""Curves through key values in time, smooth to the second derivative: accelerations do not jump."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BPoly, pchip_interpolate

from simprep.arrays import FloatArray

Curve = Callable[[FloatArray], FloatArray]
"""Times (T,) [s] to values (T,) or (T, n)."""


def minimum_jerk(share: ArrayLike) -> FloatArray:
    """Minimum-jerk step from 0 to 1 (Flash & Hogan 1985, J Neurosci 5:1688, eq. for rest-to-rest reaching).

    Args:
        share: elapsed share of the movement, clipped to [0, 1].
    """
    s = np.clip(np.asarray(share, dtype=np.float64), 0.0, 1.0)
    return np.asarray(s**3 * (10 - 15 * s + 6 * s * s))


def smooth_step(share: FloatArray) -> FloatArray:
    """Cubic step from 0 to 1, at rest at both ends, for weights. `share` (...) of the way is 0 to 1."""
    return np.asarray(share * share * (3 - 2 * share))


def dying_away(share: FloatArray, value: FloatArray | float, slope: FloatArray | float) -> FloatArray:
    """Cubic (Hermite) curve from a value and a slope to rest at 0.

    Args:
        share: (...) of the way, 0 to 1.
        value: at 0.
        slope: at 0, per whole way.
    """
    return np.asarray(value * (1 + 2 * share) * (1 - share) ** 2 + slope * share * (1 - share) ** 2)


def key_curve(times: Sequence[float], values: ArrayLike, period: float | None = None) -> Curve:
    """Quintic curve through key values: monotone-preserving slopes (PCHIP), zero acceleration at the keys.

    The curve rests at local extremes and at both ends, and outside the keys it holds the end values. Between two
    resting keys it is the minimum-jerk step.

    Args:
        times: (K,) increasing key times [s].
        values: (K,) or (K, n) key values.
        period: repeat with this period [s]; the keys then span one period without its end.
    """
    t = np.asarray(times, dtype=np.float64)
    v = np.asarray(values, dtype=np.float64)
    if period is not None:
        t = np.concatenate([t - period, t, t + period, [t[0] + 2 * period]])
        v = np.concatenate([v, v, v, v[:1]])
    slope = pchip_interpolate(t, v, t, der=1)
    if period is None:
        slope[[0, -1]] = 0.0
    spline = BPoly.from_derivatives(t, np.stack([v, slope, np.zeros_like(v)], axis=1))
    first, last = t[0], t[-1]

    def evaluate(at: FloatArray) -> FloatArray:
        at = np.asarray(at, dtype=np.float64)
        inside = np.mod(at, period) if period is not None else np.clip(at, first, last)
        return np.asarray(spline(inside))

    return evaluate


def constant(value: float = 0.0) -> Curve:
    """The curve that always has one value."""
    return lambda at: np.full(np.shape(at), value)
