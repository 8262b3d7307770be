"""Wrists and forearms that a file leaves open, over a whole clip: hands that stay over the floor and turn steadily.

Many files end at the wrist. Then nothing but the floor says how a hand is turned, and it says so poorly: a hand folds up
or down, to any side, and the best fold of one frame is far from that of the next. So the turn of the hand is chosen here
for all frames at once, before the inverse kinematics: dynamic programming over a grid of poses finds the way, and a fit
of all frames smooths it. Where the hand cannot fold out of the floor, or turns over in it, the arm is lifted later.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np
from scipy.ndimage import maximum_filter1d
from scipy.optimize import Bounds, minimize

from simprep.arrays import BoolArray, FloatArray, IndexArray
from simprep.character import SIDES, Character
from simprep.geoms import bearing_points
from simprep.motion.contacts import stances
from simprep.motion.kinematics import body_clearance, forward_kinematics
from simprep.motion.rotations import cross, rotation_matrix
from simprep.threads import blas_on_one_thread

NEAR_M = 0.03
"""A hand whose rest is nearer to the floor than this is led [m]: the inverse kinematics moves it by less."""
LEAD_S = 0.5
"""So long before and after: it has to come from its rest and go back."""
CLEAR_M = 0.005
"""Height at which hands are led over the floor, lest they bear down and move the arm [m]."""
DEEP = 0.25
"""Share of its length by which a hand is half as bad in the floor as it can get."""
TURN_S = 0.05
"""Weight of hinge speed [s]: a hand that turns over, through the floor, does so at about 1 / TURN_S = 20 rad/s."""
REST = 0.1
"""Weight of the hinge angles themselves: what the floor does not ask for goes to 0 within TURN_S / REST = 0.5 s."""
SWITCH_S = 0.15
"""Price of a turn when the way is chosen [s/rad]: for half a turn, the hand may be DEEP in the floor for half a second."""
STEPS = 300
"""Most steps of the fit."""


@dataclass(frozen=True)
class Hand:
    """Geometry of a hand and the hinges between it and the elbow.

    Attributes:
        body: its segment, and forearm: that of the forearm.
        joints: (J,) indices of the hinges, outwards; none of them is a hinge of the limb.
        axes: (J, 3) their axes in the reference pose.
        low: (J,) lower limits, counted from the reference pose [rad].
        high: (J,) upper limits [rad].
        points: (P, 3) points of the hand that touch a floor first, from the wrist, in the reference pose [m].
        radii: (P,) of these [m].
        rest: (3, 3) the hand's orientation in the reference pose.
    """

    body: int
    forearm: int
    joints: IndexArray
    axes: FloatArray
    low: FloatArray
    high: FloatArray
    points: FloatArray
    radii: FloatArray
    rest: FloatArray

    @property
    def length(self) -> float:
        """From the wrist to the farthest of the points [m]."""
        return float(np.linalg.norm(self.points, axis=1).max())

    def turned(self, angles: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The points (..., P, 3) [m] and the axes (..., J, 3) at hinge angles (..., J)."""
        turn = np.broadcast_to(np.eye(3), (*angles.shape[:-1], 3, 3))
        axes = []
        for hinge, axis in enumerate(self.axes):
            axes.append(turn @ axis)
            half = angles[..., hinge, None] / 2
            turn = turn @ rotation_matrix(np.concatenate([np.cos(half), np.sin(half) * axis], axis=-1))
        return self.points @ np.swapaxes(turn, -1, -2), np.stack(axes, axis=-2)


@lru_cache(maxsize=16)
def hand_of(character: Character, side: str) -> Hand | None:
    """A hand of a body; None if no hinge is its own or nothing of it can touch the floor."""
    role = f"{side}_hand"
    if not character.has(role):
        return None
    model = character.model
    body, forearm = character.segment(role), character.segment(f"{side}_forearm")
    joints = np.sort(character.joint_indices(character.group(f"{side}_arm")))[4:]
    standing = forward_kinematics(character.standing_qpos[None], character)
    rest = rotation_matrix(standing.xquat[0, body])
    points, radii = [], []
    for geom in np.flatnonzero((model.geom_bodyid == body + 1) & (model.geom_contype > 0)).tolist():
        turn = rotation_matrix(model.geom_quat[geom])
        for point, radius in bearing_points(model, geom):
            points.append(rest @ (model.geom_pos[geom] + turn @ point))
            radii.append(radius)
    if not len(joints) or not points:
        return None
    low, high = model.jnt_range[1 + joints].T - model.qpos0[7 + joints]
    return Hand(
        body, forearm, joints, character.reference_axes[joints], low, high, np.array(points), np.array(radii), rest
    )


def lead_hands(qpos: FloatArray, told: BoolArray, fps: float, character: Character) -> tuple[FloatArray, FloatArray]:
    """Poses whose untold hands stay over the floor z = 0 as far as they can, and where they were led.

    Args:
        qpos: (T, nq) poses, with the hinges of untold hands in the reference pose.
        told: (2,) whether the source tells how the left and the right hand are turned: then it stays.
        fps: frames per second [1/s].
        character: the body.

    Returns:
        The poses (T, nq), and how firmly they ask for each hinge (T, joints): 0 where nothing was changed, 1 where the hand
        is over the floor, more where it passes through it, so that the arm gives way.
    """
    led = np.zeros((len(qpos), len(character.joints)))
    hands = [hand_of(character, side) for side in SIDES]
    if all(hand is None or known for hand, known in zip(hands, told)):
        return qpos, led
    out, clearance = qpos.copy(), body_clearance(qpos, character)
    kinematics = forward_kinematics(qpos, character)
    for hand, known in zip(hands, told):
        if hand is None or known:
            continue
        # what is in the floor will be lifted, and the wrist with it
        lift = np.maximum(-clearance[:, hand.forearm], 0.0)
        height = kinematics.xpos[:, hand.body, 2] + lift
        up = (rotation_matrix(kinematics.xquat[:, hand.body]) @ hand.rest.T)[:, 2]  # in the reference pose's axes
        near = clearance[:, hand.body] + lift < NEAR_M
        near = maximum_filter1d(near, 2 * round(LEAD_S * fps) + 1)
        for first, after in stances(near):
            rows = slice(first, after)
            ends = (first > 0, after < len(qpos))
            angles = hand_path(hand, height[rows], up[rows], fps, ends)
            out[rows, 7 + hand.joints] = character.model.qpos0[7 + hand.joints] + angles
            points, _ = hand.turned(angles)
            depth = _depth(hand, points, height[rows, None], up[rows]).max(axis=1)
            led[rows, hand.joints] = (1 + depth**2)[:, None]
    return out, led


def hand_path(hand: Hand, height: FloatArray, up: FloatArray, fps: float, at_rest: tuple[bool, bool]) -> FloatArray:
    """Hinge angles (T, J) of a hand that stays over the floor, within the limits, and turns steadily [rad].

    Minimises the time integral of d^2 / (1 + d^2) + (TURN_S * speed)^2 + (REST * angle)^2 by L-BFGS-B (scipy), from the
    best way through a grid. Here d is the depth in the floor over DEEP times the hand's length. Since the first term
    never exceeds 1, no turn is worth much more than a speed of 1 / TURN_S.

    Args:
        hand: its geometry.
        height: (T,) of the wrist over the floor [m].
        up: (T, 3) the vertical in the frame that the hand has with all angles 0, in the axes of the reference pose.
        fps: frames per second [1/s].
        at_rest: whether all angles are 0 before the first and after the last frame.
    """
    start = np.clip(_best_way(hand, height, up, fps), hand.low, hand.high)
    stiffness = (TURN_S * fps) ** 2
    ends = np.array(at_rest, dtype=np.float64) * stiffness

    def cost(flat: np.ndarray[tuple[int], np.dtype[np.float64]]) -> tuple[float, FloatArray]:
        angles = flat.reshape(start.shape)
        points, axes = hand.turned(angles)
        depth = _depth(hand, points, height[:, None], up)
        held = 1 + depth**2
        change = np.diff(angles, axis=0)
        # (axis x point) up = axis (point x up)
        lever = cross(((depth / held**2)[..., None] * points).mean(axis=1), up) / (DEEP * hand.length)
        slope = -2 * (axes @ lever[..., None])[..., 0] + 2 * REST**2 * angles
        slope[1:] += 2 * stiffness * change
        slope[:-1] -= 2 * stiffness * change
        slope[0] += 2 * ends[0] * angles[0]
        slope[-1] += 2 * ends[1] * angles[-1]
        value = (depth**2 / held).mean(axis=1).sum() + stiffness * (change**2).sum() + REST**2 * (angles**2).sum()
        value += ends[0] * (angles[0] ** 2).sum() + ends[1] * (angles[-1] ** 2).sum()
        return float(value), slope.ravel()

    bounds = Bounds(np.tile(hand.low, len(start)).tolist(), np.tile(hand.high, len(start)).tolist())
    with blas_on_one_thread():  # sums of long clips would depend on the number of threads
        found = minimize(cost, start.ravel(), jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": STEPS})
    return np.asarray(found.x).reshape(start.shape)


def _depth(hand: Hand, points: FloatArray, height: FloatArray, up: FloatArray) -> FloatArray:
    """How deep the points (..., P, 3) of a hand are in the floor (..., P), in units of DEEP times its length."""
    low = (points @ up[..., None])[..., 0] - hand.radii
    return np.asarray(np.maximum(CLEAR_M - height - low, 0.0) / (DEEP * hand.length))


def _best_way(hand: Hand, height: FloatArray, up: FloatArray, fps: float) -> FloatArray:
    """The way (T, J) through a grid of poses with the least depth, angle and change [rad]."""
    sides = [np.unique([low, low / 2, 0.0, high / 2, high]) for low, high in zip(hand.low, hand.high)]
    grid = np.array(list(product(*sides)))  # (G, J)
    points, _ = hand.turned(grid)
    step = SWITCH_S * np.linalg.norm(grid[:, None] - grid, axis=-1)  # (from, to)
    least = REST**2 * (grid**2).sum(axis=1)
    came_from = np.empty((len(height), len(grid)), dtype=np.intp)
    total = np.zeros(len(grid))
    for frame in range(len(height)):
        depth = _depth(hand, points, height[frame], up[frame])  # (G, P)
        through = total[:, None] + step
        came_from[frame] = through.argmin(axis=0)
        total = through[came_from[frame], range(len(grid))] + ((depth**2).mean(axis=1) + least) / fps
    way = np.empty(len(height), dtype=np.intp)
    way[-1] = int(total.argmin())
    for frame in range(len(height) - 1, 0, -1):
        way[frame - 1] = came_from[frame, way[frame]]
    return np.asarray(grid[way])
