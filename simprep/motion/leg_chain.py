"""The exact kinematics of a leg as a chain of hinges, and Newton's steps from angles near a foot's pose to those of it.

A robot's hip axes lean and miss each other by centimetres, so that the closed form of `simprep.motion.limb_ik`, which is for
three axes through one point, puts its foot centimetres aside.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from simprep.arrays import FloatArray, IndexArray
from simprep.character import Character
from simprep.motion.rotations import cross

_STEPS = 20
_NEAR = 1e-10  # closer than this [m, rad] needs no further step
_DAMPING = 1e-8
_BOLDER = 8.0  # how much more a step is damped that has failed
_LEVER_M = 0.1  # a turn of the foot by 1 rad counts as this
_IDEAL_M = 1e-9
_HIP, _KNEE, _ANKLE = 0, 3, 4  # hinges about y in the order of a leg's group


@dataclass(frozen=True)
class LegChain:
    """The hinges between pelvis and foot in the reference pose, from the pelvis outwards; everything in the pelvis frame.

    A chain of several legs has rows: every attribute but `order` has one more axis in front.

    Attributes:
        order: (K,) hinges of the leg's group as they come.
        axes: (K, 3) of the hinges.
        anchors: (K, 3) a point on each axis [m].
        foot: (3,) origin of the foot [m].
        rest: (3, 3) orientation of the foot.
    """

    order: IndexArray
    axes: FloatArray
    anchors: FloatArray
    foot: FloatArray
    rest: FloatArray

    @classmethod
    def of_character(cls, character: Character, side: str) -> "LegChain":
        """The chain of the group `left_leg` or `right_leg`.

        Args:
            character: the body.
            side: `left` or `right`.
        """
        data = mujoco.MjData(character.model)
        mujoco.mj_kinematics(character.model, data)
        hinges = character.joint_indices(character.group(f"{side}_leg"))
        order = np.argsort(hinges)
        pelvis, foot = (1 + character.segment(role) for role in ("pelvis", f"{side}_foot"))
        turn = data.xmat[pelvis].reshape(3, 3)
        ids = 1 + hinges[order]
        return cls(
            order=order,
            axes=data.xaxis[ids] @ turn,
            anchors=(data.xanchor[ids] - data.xpos[pelvis]) @ turn,
            foot=(data.xpos[foot] - data.xpos[pelvis]) @ turn,
            rest=turn.T @ data.xmat[foot].reshape(3, 3),
        )

    @classmethod
    def of_both(cls, left: "LegChain", right: "LegChain") -> "LegChain":
        """A chain with two rows, of legs whose hinges come in one order."""
        names = ("axes", "anchors", "foot", "rest")
        return cls(left.order, *(np.stack([getattr(left, name), getattr(right, name)]) for name in names))

    def rows(self, picked: IndexArray) -> "LegChain":
        """Some rows of a chain that has rows; a chain of one leg fits any."""
        if self.foot.ndim == 1:
            return self
        return LegChain(self.order, self.axes[picked], self.anchors[picked], self.foot[picked], self.rest[picked])

    def is_ideal(self, hip: FloatArray, thigh: float, shank: float) -> bool:
        """Whether every axis is a coordinate axis through its joint centre, and the foot's frame is the pelvis': then the
        closed form is exact.

        Args:
            hip: (3,) its centre [m].
            thigh: from hip to knee, straight down [m].
            shank: from knee to ankle [m].
        """
        down = np.array([0.0, 0.0, -1.0])
        centres = hip + np.array([0.0, 0.0, 0.0, thigh, *[thigh + shank] * (len(self.order) - 4)])[:, None] * down
        beside = np.linalg.norm(cross(self.axes, centres - self.anchors), axis=1)
        leaning = 1 - np.abs(self.axes).max(axis=1)
        others = np.abs(self.rest - np.eye(3)).max(), np.abs(self.foot - centres[-1]).max()
        return bool(max(beside.max(), leaning.max(), *others) < _IDEAL_M)

    def foot_poses(self, angles: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Places (N, 3) [m] and orientations (N, 3, 3) of the foot, and the Jacobian (N, 6, K) of place, then turn.

        Args:
            angles: (N, K) from the reference pose, in the order of the leg's group [rad].
        """
        count, hinges = angles.shape
        turn = np.tile(np.eye(3), (count, 1, 1))
        carried = np.zeros((count, 3))  # where the pelvis' origin has come
        axes, anchors = np.empty((count, hinges, 3)), np.empty((count, hinges, 3))
        for k, hinge in enumerate(self.order):
            axis, anchor = self.axes[..., k, :], self.anchors[..., k, :]
            axes[:, k] = (turn @ axis[..., None])[..., 0]
            anchors[:, k] = (turn @ anchor[..., None])[..., 0] + carried
            turn = turn @ Rotation.from_rotvec(angles[:, hinge, None] * axis).as_matrix()
            carried = anchors[:, k] - (turn @ anchor[..., None])[..., 0]
        place = (turn @ self.foot[..., None])[..., 0] + carried
        jacobian = np.empty((count, 6, hinges))
        jacobian[:, :3, self.order] = np.swapaxes(cross(axes, place[:, None] - anchors), -1, -2)
        jacobian[:, 3:, self.order] = np.swapaxes(axes, -1, -2)
        return place, turn @ self.rest, jacobian

    def reach(self, place: FloatArray, turn: FloatArray, start: FloatArray) -> FloatArray:
        """Angles (N, K) that bring the foot to places (N, 3) and orientations (N, 3, 3), near those to start from [rad].

        Where a pose is out of reach they are as near as the steps come. With five hinges the foot's turn about its own x axis
        is left as it comes. The steps are damped by the error itself, so that they do not swing where the leg is straight
        (Sugihara 2011, doi 10.1109/TRO.2011.2148230), and more where one has failed.

        Args:
            place: of the foot in the pelvis frame [m].
            turn: its orientation there.
            start: (N, K) from the reference pose, in the order of the leg's group [rad].
        """
        found = self._steps_from(place, turn, start)
        bends = np.broadcast_to(np.sign(self.axes[..., np.argsort(self.order), 1]), found.shape)
        wrong = np.flatnonzero(found[:, _KNEE] * bends[:, _KNEE] < 0)
        if not len(wrong):
            return found
        # a knee does not bend backwards: the same pose from its other side, where hip and ankle make up for it
        other, bends = found[wrong], bends[wrong]
        back = other[:, _KNEE] * bends[:, _KNEE]
        other[:, [_HIP, _ANKLE]] += bends[:, [_HIP, _ANKLE]] * back[:, None]
        other[:, _KNEE] *= -1
        other = self.rows(wrong)._steps_from(place[wrong], turn[wrong], other)
        right = other[:, _KNEE] * bends[:, _KNEE] >= 0
        found[wrong[right]] = other[right]
        return found

    def _steps_from(self, place: FloatArray, turn: FloatArray, start: FloatArray) -> FloatArray:
        """As `reach`, whichever way the knee bends."""
        found, left = start.copy(), np.arange(len(start))
        error, jacobian = self._missed(place, turn, found)
        caution = np.ones(len(start))
        for _ in range(_STEPS):
            size = (error**2).sum(axis=1)
            going = size > _NEAR**2
            left, error, jacobian, size, caution = (one[going] for one in (left, error, jacobian, size, caution))
            if not len(left):
                break
            normal = np.swapaxes(jacobian, -1, -2) @ jacobian
            normal += (caution * (0.5 * size + _DAMPING * _LEVER_M**2))[:, None, None] * np.eye(normal.shape[-1])
            step = np.linalg.solve(normal, np.swapaxes(jacobian, -1, -2) @ error[..., None])[..., 0]
            trial = found[left] + step
            after, there = self.rows(left)._missed(place[left], turn[left], trial)
            better = (after**2).sum(axis=1) < size
            found[left[better]] = trial[better]
            error[better], jacobian[better] = after[better], there[better]
            caution = np.where(better, np.maximum(caution / _BOLDER, 1.0), caution * _BOLDER)
        return found

    def _missed(self, place: FloatArray, turn: FloatArray, angles: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What is left to a pose (N, K), turns by their lever [m], and the Jacobian (N, K, K) of what was made."""
        at, turned, jacobian = self.foot_poses(angles)
        rest = Rotation.from_matrix(turn @ np.swapaxes(turned, -1, -2)).as_rotvec()
        error = np.concatenate([place - at, _LEVER_M * rest], axis=1)
        jacobian[:, 3:] *= _LEVER_M
        if angles.shape[1] == 6:
            return error, jacobian
        own = np.swapaxes(turned, -1, -2)[:, 1:]  # the foot's y and z axes
        return (
            np.concatenate([error[:, :3], (own @ error[:, 3:, None])[..., 0]], axis=1),
            np.concatenate([jacobian[:, :3], own @ jacobian[:, 3:]], axis=1),
        )
