"""The largest push that a body should survive, predicted from its laws of motion, before it is pushed.

The COM is a pendulum on the pressure under the feet, and the pressure cannot leave the support polygon. So the place that the COM
heads for, the XcoM or capture point, must not get so far outside that the pressure, or the steps that follow, cannot fetch it back
(Hof et al. 2005; Koolen et al. 2012, Int J Robotics Res 31:1094).
"""

from collections.abc import Callable

import numpy as np

from simprep.arrays import FloatArray

STEP_S = 0.3
"""Least time to the landing of a step, as Hof et al. (2010, J Exp Biol 213:2655) find it in people [s]."""
REACH_M = 0.6
"""Longest step: two thirds of a leg [m]."""
LARGEST_N = 20000.0
"""No larger push is predicted [N]."""
_WATCHED_S = 3.0
_LOST_M = 1.0
_DT_S = 0.005


def capture_push(
    support: FloatArray,
    xcom: FloatArray,
    direction: FloatArray,
    omega_squared: float,
    mass: float,
    duration: float,
    steps: bool = False,
) -> float:
    """Largest force that the best use of the feet survives [N]; 0 where the body would have to step without any push.

    While the push lasts, the pressure is as far in its direction as the polygon reaches. After it, the XcoM must lie within
    the polygon. With steps, it may be ahead by what any number of further steps can fetch back: REACH / (exp(omega STEP_S) - 1)
    (Koolen et al. 2012). Hides strength, reaction time, and arms that swing.

    Args:
        support: (k, 2) corners of the support polygon [m].
        xcom: (2,) extrapolated COM before the push [m].
        direction: (2,) unit vector of the push.
        omega_squared: of the pendulum [1/s^2], above 0.
        mass: of the body [kg].
        duration: of the push [s].
        steps: whether the body may step.
    """
    omega = float(np.sqrt(omega_squared))
    edge = float((support @ direction).max() - xcom @ direction)
    ahead = REACH_M / float(np.expm1(omega * STEP_S)) if steps else 0.0
    growth = float(np.exp(omega * duration))
    return float(np.clip(mass * omega_squared * (edge * growth + ahead) / (growth - 1), 0.0, LARGEST_N))


def closed_loop_push(
    matrix: FloatArray,
    support: FloatArray,
    direction: FloatArray,
    omega_squared: tuple[float, float],
    mass: float,
    duration: float,
) -> float:
    """Largest force after which the identified closed loop comes back, its pressure clipped to the support polygon [N].

    The edge of the region of attraction along the push. The pressure that the loop asks for follows from the plant; where it lies
    outside the polygon, it is brought to the edge towards its place at rest. Nothing steps. Found by bisection, to 1 N.

    Args:
        matrix: (4, 4) closed loop of forward and left error, then their rates (`simprep.metrics.com_laws.loop_matrix`).
        support: (k, 2) corners of the polygon, counter-clockwise, relative to the pressure at rest, which is inside [m].
        direction: (2,) unit vector of the push, forward and left.
        omega_squared: of the plant, of both axes [1/s^2].
        mass: of the body [kg].
        duration: of the push [s].
    """

    def comes_back(force: float) -> bool:
        error, rate, stiff = np.zeros(2), np.zeros(2), np.asarray(omega_squared)
        pushed = direction * force / mass
        for step in range(round(_WATCHED_S / _DT_S)):
            wanted = matrix[2:] @ np.concatenate([error, rate])
            pressure = within(support, error - wanted / stiff)
            rate = rate + _DT_S * (stiff * (error - pressure) + (pushed if step * _DT_S < duration - 1e-9 else 0.0))
            error = error + _DT_S * rate
            if float(error @ error) > _LOST_M**2:
                return False
        return bool(np.abs(error).max() < 0.05)

    return _largest(comes_back)


def within(polygon: FloatArray, point: FloatArray) -> FloatArray:
    """A point (2,), or where it is outside a convex polygon (k, 2) about the origin, the edge on its way to the origin [m].

    Args:
        polygon: corners, counter-clockwise; the origin is inside.
        point: (2,).
    """
    edges = np.roll(polygon, -1, axis=0) - polygon
    outward = np.stack([edges[:, 1], -edges[:, 0]], axis=1)
    room = np.einsum("ki,ki->k", outward, polygon)  # of the origin, at least 0
    used = outward @ point
    excess = float(np.max(np.where(used > 0, used / np.maximum(room, 1e-12), 0.0)))
    return point if excess <= 1 else point / excess


def _largest(survives: Callable[[float], bool]) -> float:
    low, high = 0.0, LARGEST_N
    if not survives(0.0):
        return 0.0
    while high - low > 1.0:
        middle = (low + high) / 2
        low, high = (middle, high) if survives(middle) else (low, middle)
    return low
