"""Where the COM should go, seen ahead: the reference's own path, bent so that the floor can hold it (time-varying LQR).

A reference may ask for what no floor gives: a walk that stops within half a second needs its zero moment point (ZMP) 0.3 m before
the feet. A body that follows it as long as it can falls then. One that looks ahead brakes earlier.

The horizontal distance e of the COM from the reference's obeys the inverted pendulum e'' = w² (e - u), where u is the distance
of the centre of pressure from the ZMP that the reference needs, and w² its vertical force over mass and COM height. A
linear-quadratic regulator along the whole reference, backwards in time, weighs e and e' against the distance of the centre of
pressure from the point of the reference's support polygon that is nearest to that ZMP (after Kajita et al. 2003, who preview
the ZMP of a chosen gait). In flight w is 0, and nothing can be done.
"""

from dataclasses import dataclass

import numpy as np

from simprep.arrays import BoolArray, FloatArray
from simprep.humanoid_model import GRAVITY
from simprep.motion.support import nearest_point
from simprep.physics.reference import Reference
from simprep.physics.whole_body import FLIGHT_SHARE, whole_body, zero_moment_point

_STEPS_S = 1 / 96
"""Steps of the regulator [s], rounded to whole simulation steps."""
_MOST_WEIGHTS = 3.0
"""Largest vertical force that the pendulum knows, in body weights."""
_LOWEST_M = 0.2
_END_PRICE = 50.0
"""Price of the squared distance of the extrapolated COM at the reference's end, when nothing can be seen beyond [s]."""


@dataclass(frozen=True)
class ComPlan:
    """The COM's way along a reference, and how to stay on it, at every simulation step; horizontal, world frame.

    Attributes:
        stiffness: (N + 1,) w² of the pendulum [1/s²].
        lead: (N + 1, 2) u without any error [m].
        gain: (N + 1, 2) how much u changes with e and with e' [s].
        shift: (N + 1, 2) e if all goes as planned [m].
        speed: (N + 1, 2) e' [m/s].
        pressure: (N + 1, 2) centre of pressure then [m].
    """

    stiffness: FloatArray
    lead: FloatArray
    gain: FloatArray
    shift: FloatArray
    speed: FloatArray
    pressure: FloatArray

    def acceleration(self, step: int, distance: FloatArray, speed: FloatArray) -> FloatArray:
        """Acceleration (2,) of the COM, on top of the reference's, that is wanted of a body with errors e and e' (2,) [m/s²]."""
        u = self.lead[step] + self.gain[step, 0] * distance + self.gain[step, 1] * speed
        return np.asarray(self.stiffness[step] * (distance - u))


def com_plan(
    reference: Reference, qacc: FloatArray, points: FloatArray, bears: BoolArray, margin: float, place_price: float
) -> ComPlan:
    """Plan the COM's way along a reference.

    Args:
        reference: N + 1 steps.
        qacc: (N + 1, nv) its accelerations.
        points: (N + 1, P, 2) its contact points on the floor [m].
        bears: (N + 1, P) which of them can bear load.
        margin: the centre of pressure stays this far within the corners of the support polygon [m].
        place_price: of e², as a share of the price of the squared distance of the centre of pressure.
    """
    fps, model = reference.motion.fps, reference.motion.character.model
    stride = max(1, round(_STEPS_S * fps))
    rows = np.arange(0, len(qacc), stride)
    needed = whole_body(model, reference.qpos[rows], reference.qvel[rows], qacc[rows])
    weight = GRAVITY * float(model.body_mass.sum())
    borne = (needed.force[:, 2] > FLIGHT_SHARE * weight) & bears[rows].any(axis=1)
    zmp = np.where(borne[:, None], zero_moment_point(needed.com, needed.force, needed.torque, weight), 0.0)
    lift = np.minimum(needed.force[:, 2] / weight, _MOST_WEIGHTS)
    stiffness = np.where(borne, lift * GRAVITY / np.maximum(needed.com[:, 2], _LOWEST_M), 0.0)
    inner = _inner(points[rows], bears[rows], margin)
    wanted = np.where(borne[:, None], nearest_point(inner, bears[rows], zmp) - zmp, 0.0)
    pendulum = float(np.sqrt(max(needed.com[-1, 2], _LOWEST_M) / GRAVITY))
    gain, lead = _regulator(stiffness, wanted, stride / fps, place_price, pendulum)
    shift, speed, used = _planned(stiffness, gain, lead, stride / fps)
    at = np.minimum(np.arange(len(qacc)) // stride, len(rows) - 1)
    return ComPlan(*(part[at] for part in (stiffness, lead, gain, shift, speed, zmp + used)))


def _inner(points: FloatArray, mask: BoolArray, margin: float) -> FloatArray:
    """Points drawn towards the mean of those that count by a length, at most to it."""
    centre = np.where(mask[..., None], points, 0.0).sum(axis=1) / np.maximum(mask.sum(axis=1), 1)[:, None]
    outward = points - centre[:, None]
    length = np.linalg.norm(outward, axis=-1, keepdims=True)
    return np.asarray(centre[:, None] + outward * np.maximum(0.0, 1 - margin / np.maximum(length, 1e-6)))


def _steps(stiffness: float, dt: float) -> tuple[FloatArray, FloatArray]:
    """The pendulum's step: (e, e') after it is A (e, e') + B u."""
    return np.array([[1 + 0.5 * stiffness * dt**2, dt], [stiffness * dt, 1.0]]), np.array(
        [-0.5 * stiffness * dt**2, -stiffness * dt]
    )


def _regulator(
    stiffness: FloatArray, wanted: FloatArray, dt: float, place_price: float, pendulum: float
) -> tuple[FloatArray, FloatArray]:
    """Gains (n, 2) and leads (n, 2) that make the sum of (u - wanted)² + place_price e² least (backward Riccati recursion)."""
    towards = np.array([1.0, pendulum])
    value = _END_PRICE * np.outer(towards, towards) + np.diag([place_price, 0.0])
    slope = np.zeros((2, 2))  # (state, axis)
    price = np.diag([place_price * dt, 0.0])
    gain, lead = np.zeros((len(wanted), 2)), np.zeros((len(wanted), 2))
    for i in range(len(wanted) - 1, -1, -1):
        a, b = _steps(float(stiffness[i]), dt)
        constant = value @ np.outer(b, wanted[i]) + slope
        curvature = dt + b @ value @ b
        feedback = (b @ value @ a) / curvature
        gain[i], lead[i] = -feedback, wanted[i] - (b @ constant) / curvature
        closed = a - np.outer(b, feedback)
        value, slope = price + a.T @ value @ closed, closed.T @ constant
    return gain, lead


def _planned(
    stiffness: FloatArray, gain: FloatArray, lead: FloatArray, dt: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """e, e' and u, each (n, 2), of a body that begins on the reference and is not disturbed."""
    state = np.zeros((2, 2))  # (state, axis)
    shift, speed, used = np.zeros((3, *lead.shape))
    for i in range(len(lead)):
        shift[i], speed[i] = state
        used[i] = lead[i] + gain[i] @ state
        a, b = _steps(float(stiffness[i]), dt)
        state = a @ state + np.outer(b, used[i])
    return shift, speed, used
