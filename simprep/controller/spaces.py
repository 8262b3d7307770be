"""States and actions of the behaviour controller, and their quantisation (paper, section 6.1 and Table I)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from simprep.arrays import FloatArray, IntArray
from simprep.motion.turns import turned

Cells = IntArray

ALPHA_STEP = 0.2
ALPHA_LEVELS = 6
"""0, 0.2 ... 1.0. The paper's Table I prints 5, its 19 200 states need 6."""
CORE_NODES = 4
DISTANCE_STEP_M = 0.4
DISTANCES = 5
GOAL_ANGLES = 8
INFLUENCE_ANGLES = 4
GOAL_CELLS = DISTANCES * GOAL_ANGLES
INFLUENCE_CELLS = DISTANCES * INFLUENCE_ANGLES
STATES = ALPHA_LEVELS * CORE_NODES * GOAL_CELLS * INFLUENCE_CELLS
ACTIONS = CORE_NODES * ALPHA_LEVELS

REACH_M = DISTANCE_STEP_M
"""The goal or the source of influence is reached when nearer than this: the first distance cell [m]."""
RANGE_M = 2.6
"""A source of influence this far away or farther has no influence yet [m]. The last ring of 40 cm would end at 2 m; one
step of a walk is added, as a walking character might else step over that ring."""
AT_INFLUENCE = ALPHA_LEVELS - 1
"""The level forced on reaching the source of influence: 1.0."""
SETTLES_S = 0.5
"""The forced level is held so long, until the filter on alpha has settled and the target can be launched [s]."""


@dataclass(frozen=True)
class Observation:
    """What the controller sees: s = {alpha, Next(m), d_g, theta_g, d_i, theta_i} (paper, Eq. 11), unquantised.

    Attributes:
        alpha: level of preparation now, 0 to 1.
        node: index of the core node performed last.
        goal_distance: to the goal [m].
        goal_angle: of the goal from the heading, counter-clockwise [rad].
        influence_distance: to the source of influence [m]; infinite where there is none.
        influence_angle: of the source of influence from the heading, counter-clockwise [rad].
    """

    alpha: float
    node: int
    goal_distance: float
    goal_angle: float
    influence_distance: float
    influence_angle: float


@dataclass(frozen=True)
class Action:
    """What the controller does next: a = {m, alpha} (paper, Eq. 12), index of a core node and level 0, 0.2 ... 1."""

    node: int
    alpha: float


def observe(
    position: ArrayLike, heading: float, goal: ArrayLike, influence: ArrayLike | None, alpha: float, node: int
) -> Observation:
    """The observation of a character on the floor.

    Args:
        position: (2,) of its root [m].
        heading: the way it walks, without the pelvis's swing (`preparation.trajectory.heading_trend`) [rad].
        goal: (2,) [m].
        influence: (2,) source of influence [m]; None for none.
        alpha: level of preparation commanded last.
        node: index of the core node performed last.
    """
    goal_distance, goal_angle = (float(value) for value in polar(relative(goal, position, heading)))
    if influence is None:
        return Observation(alpha, node, goal_distance, goal_angle, np.inf, np.pi)
    distance, angle = (float(value) for value in polar(relative(influence, position, heading)))
    return Observation(alpha, node, goal_distance, goal_angle, distance, angle)


def relative(point: ArrayLike, position: ArrayLike, heading: ArrayLike) -> FloatArray:
    """Points on the floor (..., 2) as seen by a character: forward and left of it [m].

    Args:
        point: (..., 2) [m].
        position: (..., 2) of the character [m].
        heading: (...) [rad].
    """
    offset = np.asarray(point, dtype=np.float64) - np.asarray(position, dtype=np.float64)
    return turned(offset, -np.asarray(heading))


def polar(point: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distance [m] and angle [rad, -pi to pi] of points (..., 2)."""
    return np.hypot(point[..., 0], point[..., 1]), np.arctan2(point[..., 1], point[..., 0])


def goal_cell(distance: ArrayLike, angle: ArrayLike) -> Cells:
    """Cell (...) of the goal, ring * 8 + sector: 5 rings of 40 cm, the last endless; 8 sectors of 45 deg from ahead.

    Args:
        distance: (...) [m].
        angle: (...) [rad].
    """
    return np.asarray(_ring(distance) * GOAL_ANGLES + _sector(angle, GOAL_ANGLES))


def influence_cell(distance: ArrayLike, angle: ArrayLike) -> Cells:
    """Cell (...) of the source of influence, ring * 4 + sector: 5 rings of 40 cm; 4 sectors of 90 deg from ahead.

    A source out of range (2.6 m or more) counts as behind, in the last ring: nothing to prepare for yet.

    Args:
        distance: (...) [m].
        angle: (...) [rad].
    """
    sector = np.where(np.asarray(distance) >= RANGE_M, INFLUENCE_ANGLES // 2, _sector(angle, INFLUENCE_ANGLES))
    return np.asarray(_ring(distance) * INFLUENCE_ANGLES + sector)


def alpha_level(alpha: ArrayLike) -> Cells:
    """Nearest of the 6 levels, (...) 0 to 5."""
    return np.asarray(np.clip(np.round(np.asarray(alpha) / ALPHA_STEP), 0, AT_INFLUENCE).astype(np.int64))


def encode(observation: Observation) -> tuple[int, int, int, int]:
    """The state of an observation: alpha level, core node, goal cell, influence cell."""
    return (
        int(alpha_level(observation.alpha)),
        observation.node,
        int(goal_cell(observation.goal_distance, observation.goal_angle)),
        int(influence_cell(observation.influence_distance, observation.influence_angle)),
    )


def state_index(level: ArrayLike, node: ArrayLike, goal: ArrayLike, influence: ArrayLike) -> Cells:
    """Number of a state, 0 to 19 199; the last cell varies fastest."""
    return np.ravel_multi_index(
        (np.asarray(level), np.asarray(node), np.asarray(goal), np.asarray(influence)),  # type: ignore[arg-type]
        (ALPHA_LEVELS, CORE_NODES, GOAL_CELLS, INFLUENCE_CELLS),
    ).astype(np.int64)


def decode(state: ArrayLike) -> tuple[Cells, Cells, Cells, Cells]:
    """Inverse of `state_index`: alpha level, core node, goal cell, influence cell."""
    shape = (ALPHA_LEVELS, CORE_NODES, GOAL_CELLS, INFLUENCE_CELLS)
    level, node, goal, influence = np.unravel_index(np.asarray(state), shape)
    return level, node, goal, influence


def cell_samples(sectors: int, radial: int, angular: int) -> FloatArray:
    """Midpoints of an even grid of every cell in distance and angle: forward and left of the character [m].

    The shape is (5 * sectors, angular * radial, 2); the distance varies fastest. The last ring ends at `RANGE_M`.

    Args:
        sectors: 8 for the goal, 4 for the source of influence.
        radial: points in distance per cell.
        angular: points in angle per cell.
    """
    ring, sector, j, i = np.meshgrid(
        np.arange(DISTANCES), np.arange(sectors), np.arange(angular), np.arange(radial), indexing="ij"
    )
    edges = np.append(np.arange(DISTANCES) * DISTANCE_STEP_M, RANGE_M)
    distance = edges[ring] + (i + 0.5) / radial * np.diff(edges)[ring]
    angle = (sector - 0.5 + (j + 0.5) / angular) * 2 * np.pi / sectors
    points = np.stack([distance * np.cos(angle), distance * np.sin(angle)], axis=-1)
    return points.reshape(DISTANCES * sectors, radial * angular, 2)


def _ring(distance: ArrayLike) -> Cells:
    nearest = np.minimum(np.asarray(distance, dtype=np.float64), RANGE_M) / DISTANCE_STEP_M
    return np.minimum(np.floor(nearest + 1e-9), DISTANCES - 1).astype(np.int64)


def _sector(angle: ArrayLike, sectors: int) -> Cells:
    return np.floor(np.asarray(angle) * sectors / (2 * np.pi) + 0.5).astype(np.int64) % sectors
