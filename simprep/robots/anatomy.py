"""What the parts of an unknown robot are: legs, arms, trunk and head, from the tree of its joints, their axes and names."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.optimize import minimize

from simprep.arrays import FloatArray
from simprep.character import SIDES
from simprep.robots.frames import nearest_point
from simprep.robots.model import hinge_names

FINGERS = ("finger", "thumb", "index", "middle", "ring", "pinky", "little", "gripper", "jaw", "palm")
STRAIGHT = 0.2
"""Angles of the standing pose this near to a multiple of a right angle are taken to be one [rad]."""
_TURN = ("abduction", "flexion", "rotation")
_BENDING = ("bending", "flexion", "rotation")
_CARDAN = {"roll": 0, "pitch": 1, "yaw": 2}


@dataclass(frozen=True)
class Anatomy:
    """What was found.

    Attributes:
        movements: joint of each anatomical movement.
        roles: body of each role.
        standing: angles of the pose with hanging arms [rad].
        fingers: joints of the hands, which are to be locked.
        hands: where the hands begin if no wrist tells it: body and place (3,) in its frame [m].
        doubts: what to check.
    """

    movements: Mapping[str, str]
    roles: Mapping[str, str]
    standing: Mapping[str, float]
    fingers: tuple[str, ...]
    hands: Mapping[str, tuple[str, tuple[float, float, float]]]
    doubts: tuple[str, ...]


class CannotTell(ValueError):
    """The robot has no two legs with feet."""


def find_anatomy(model: mujoco.MjModel) -> Anatomy:
    """Recognise the parts of a robot that looks along x with z up.

    Args:
        model: of `simprep.robots.source.read_robot_model`.

    Raises:
        CannotTell: there are no two legs; the message says why.
    """
    return _Finder(model).found()


class _Finder:
    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self.data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, self.data)
        self.hinges = [model.joint(name).id for name in hinge_names(model)]
        self.root = int(model.jnt_bodyid[np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE)[0]])
        self.movements: dict[str, str] = {}
        self.roles: dict[str, str] = {"pelvis": model.body(self.root).name}
        self.doubts: list[str] = []

    def found(self) -> Anatomy:
        chains = self._chains()
        legs = self._legs(chains)
        arms = self._arms(chains, legs)
        shared = [joint for joint in legs["left"] if joint in legs["right"]]
        if shared:
            self.doubts.append("the root is above the waist, whose joints both legs share: locked")
            legs = {side: [joint for joint in chain if joint not in shared] for side, chain in legs.items()}
        fingers = [joint for joint in self.hinges if self._is_finger(joint)]
        for side, chain in legs.items():
            self._name_leg(side, chain)
        trunk: list[int] = []
        if arms:
            both = [joint for joint in arms["left"] if joint in arms["right"]]
            trunk = both
            for side, chain in arms.items():
                self._name_arm(side, [joint for joint in chain if joint not in both])
            first = next(joint for joint in arms["left"] if joint not in both)
            self.roles["thorax"] = self._body(int(self.model.body_parentid[self.model.jnt_bodyid[first]]))
        else:
            self.doubts.append("no two arms were found; imports need them")
        rest = [
            joint for joint in self.hinges
            if self._joint(joint) not in self.movements.values() and joint not in (*fingers, *trunk, *shared)
        ]  # fmt: skip
        self._name_central("lumbar", trunk)
        self._name_central("neck", rest)
        self._name_central_roles(trunk, rest)
        unknown = [self._joint(joint) for joint in self.hinges if joint not in fingers]
        unknown = [name for name in unknown if name not in self.movements.values()]
        if unknown:
            self.doubts.append(f"what these joints do was not found, so they are locked: {', '.join(unknown)}")
        standing, hands = self._hanging_arms(arms)
        locked = (*(self._joint(joint) for joint in fingers), *unknown)
        return Anatomy(self.movements, self.roles, standing, locked, hands, tuple(self.doubts))

    def _chains(self) -> list[list[int]]:
        """Hinges from the root to every leaf of the tree, fingers left out."""
        parents = {int(parent) for parent in self.model.body_parentid[1:]}
        chains = []
        for leaf in (body for body in range(1, self.model.nbody) if body not in parents):
            chain: list[int] = []
            body = leaf
            while body != self.root and body != 0:
                own = [joint for joint in self.hinges if self.model.jnt_bodyid[joint] == body]
                chain = own + chain
                body = int(self.model.body_parentid[body])
            chain = [joint for joint in chain if not self._is_finger(joint)]
            if chain and chain not in chains:
                chains.append(chain)
        return [one for one in chains if not any(one != other and one == other[: len(one)] for other in chains)]

    def _legs(self, chains: Sequence[list[int]]) -> dict[str, list[int]]:
        """The chain to the lowest leaf of each side."""
        legs = {}
        for side in SIDES:
            own = [chain for chain in chains if self._side(chain) == side]
            if not own:
                raise CannotTell(f"no chain of joints on the {side}; a robot looks along x, its left is y")
            legs[side] = min(own, key=lambda chain: float(self.data.xanchor[chain[-1], 2]))
        if any(len(chain) < 4 for chain in legs.values()):
            counts = ", ".join(f"{len(chain)} {side}" for side, chain in legs.items())
            raise CannotTell(f"legs of {counts} joints; at least 4 are needed: hip flexion and abduction, knee, ankle")
        return legs

    def _arms(self, chains: Sequence[list[int]], legs: Mapping[str, list[int]]) -> dict[str, list[int]]:
        arms = {}
        for side in SIDES:
            own = [chain for chain in chains if self._side(chain) == side and chain != legs[side]]
            if own:
                arms[side] = max(own, key=len)
        return arms if len(arms) == 2 else {}

    def _side(self, chain: Sequence[int]) -> str:
        """Side of the last joint of a chain: by its name, else by its place; empty in the middle."""
        words = _words(self._joint(chain[-1]))
        for side in SIDES:
            if side in words or side[0] in words:
                return side
        aside = float(self.data.xanchor[chain[-1], 1] - self.data.xpos[self.root, 1])
        return "" if abs(aside) < 0.02 else "left" if aside > 0 else "right"

    def _is_finger(self, joint: int) -> bool:
        words = {word for word in _words(self._joint(joint)) for finger in FINGERS if word.startswith(finger)}
        return bool(words)

    def _joint(self, joint: int) -> str:
        return str(self.model.joint(joint).name)

    def _body(self, body: int) -> str:
        return str(self.model.body(body).name)

    def _about(self, joint: int) -> int:
        """Number of the axis that a joint turns about: by its name (roll, pitch, yaw), else by its direction."""
        for word in _words(self._joint(joint)):
            if word in _CARDAN:
                return _CARDAN[word]
        axis = np.abs(self.data.xaxis[joint])
        if axis.max() < 0.9:
            self.doubts.append(f"the axis of {self._joint(joint)} leans by {np.degrees(np.arccos(axis.max())):.0f} deg")
        return int(axis.argmax())

    def _put(self, movement: str, joint: int) -> None:
        if movement in self.movements:
            self.doubts.append(f"{self._joint(joint)} and {self.movements[movement]} both look like {movement}")
        else:
            self.movements[movement] = self._joint(joint)

    def _name_leg(self, side: str, chain: Sequence[int]) -> None:
        bends = [joint for joint in chain if self._about(joint) == 1]
        named = [joint for joint in chain if "knee" in _words(self._joint(joint))]
        knee = named[0] if named else bends[1] if len(bends) > 1 else chain[len(chain) // 2]
        at = chain.index(knee)
        for joint in chain[:at]:
            self._put(f"{side}_hip_{_TURN[self._about(joint)]}", joint)
        self._put(f"{side}_knee_flexion", knee)
        for joint in chain[at + 1 :]:
            about = self._about(joint)
            if about == 2:
                self.doubts.append(
                    f"{self._joint(joint)} turns the foot about the vertical, for which there is no name"
                )
            else:
                self._put(f"{side}_ankle_{'dorsiflexion' if about == 1 else 'inversion'}", joint)
        bodies = [int(self.model.jnt_bodyid[joint]) for joint in chain]
        thigh, shank, foot = bodies[at - 1], bodies[at], bodies[-1]
        for part, body in (("thigh", thigh), ("shank", shank), ("foot", foot)):
            self.roles[f"{side}_{part}"] = self._body(body)

    def _name_arm(self, side: str, chain: Sequence[int]) -> None:
        named = [joint for joint in chain if "elbow" in _words(self._joint(joint))]
        bends = [joint for joint in named if self._about(joint) == 1 or len(named) == 1]
        elbow = bends[0] if bends else named[0] if named else chain[min(3, len(chain) - 1)]
        if not named:
            self.doubts.append(
                f"{self._joint(elbow)} is taken for the {side} elbow, since it is joint {chain.index(elbow) + 1} of the arm"
            )
        at = chain.index(elbow)
        for joint in chain[:at]:
            self._put(f"{side}_shoulder_{_TURN[self._about(joint)]}", joint)
        self._put(f"{side}_elbow_flexion", elbow)
        for joint in chain[at + 1 :]:
            self._put(f"{side}_{self._wrist(elbow, joint)}", joint)
        bodies = [int(self.model.jnt_bodyid[joint]) for joint in chain]
        self.roles[f"{side}_upper_arm"] = self._body(bodies[max(at - 1, 0)])
        self.roles[f"{side}_forearm"] = self._body(bodies[at])
        self.roles[f"{side}_hand"] = self._body(bodies[-1])

    def _wrist(self, elbow: int, joint: int) -> str:
        """Movement of a joint beyond the elbow: about the forearm's length, about the elbow's axis, or about the third."""
        axis, hinge = self.data.xaxis[joint], self.data.xaxis[elbow]
        along = self._end_of_arm(int(self.model.jnt_bodyid[elbow])) - self.data.xanchor[elbow]
        along /= max(float(np.linalg.norm(along)), 1e-9)
        shares = {
            "forearm_pronation": abs(float(axis @ along)),
            "wrist_deviation": abs(float(axis @ hinge)),
            "wrist_flexion": abs(float(axis @ np.cross(along, hinge))),
        }
        return max(shares, key=lambda name: shares[name])

    def _end_of_arm(self, body: int) -> FloatArray:
        """Where a forearm ends (3,), in the world: the anchor of the last joint beyond it, else its own far end [m]."""
        beyond = [joint for joint in self.hinges if self._is_below(int(self.model.jnt_bodyid[joint]), body)]
        beyond = [joint for joint in beyond if not self._is_finger(joint)]
        if beyond:
            return np.array(self.data.xanchor[beyond[-1]])
        start = self.data.xpos[body]
        geoms = [
            geom for geom in range(self.model.ngeom) if self._is_below(int(self.model.geom_bodyid[geom]), body, True)
        ]
        ends = [self.data.geom_xpos[geom] for geom in geoms] or [self.data.xipos[body]]
        far = max(ends, key=lambda end: float(np.linalg.norm(end - start)))
        return np.asarray(start + 1.3 * (far - start))

    def _is_below(self, body: int, above: int, itself: bool = False) -> bool:
        if body == above:
            return itself
        while body:
            body = int(self.model.body_parentid[body])
            if body == above:
                return True
        return False

    def _name_central(self, part: str, joints: Sequence[int]) -> None:
        for joint in joints:
            about = self._about(joint)
            first = f"{part}_{_BENDING[about]}"
            second = f"{'thorax' if part == 'lumbar' else 'head'}_{_BENDING[about]}"
            self._put(first if first not in self.movements else second, joint)

    def _name_central_roles(self, trunk: Sequence[int], rest: Sequence[int]) -> None:
        """Abdomen, neck and head, as far as they move by themselves."""
        known = {joint: movement for movement, joint in self.movements.items()}
        lumbar = [joint for joint in trunk if known.get(self._joint(joint), "").startswith("lumbar")]
        if lumbar and len(lumbar) < len(trunk):
            self.roles["abdomen"] = self._body(int(self.model.jnt_bodyid[lumbar[-1]]))
        bodies = [self._body(int(self.model.jnt_bodyid[joint])) for joint in rest if self._joint(joint) in known]
        if bodies:
            self.roles["neck"] = bodies[0]
            if bodies[-1] != bodies[0]:
                self.roles["head"] = bodies[-1]

    def _hanging_arms(
        self, arms: Mapping[str, list[int]]
    ) -> tuple[dict[str, float], dict[str, tuple[str, tuple[float, float, float]]]]:
        """Angles of shoulders and elbows with which the arms hang straight down; and hands without wrists."""
        standing: dict[str, float] = {}
        hands: dict[str, tuple[str, tuple[float, float, float]]] = {}
        for side in arms:
            elbow = self.model.joint(self.movements[f"{side}_elbow_flexion"]).id
            forearm = int(self.model.jnt_bodyid[elbow])
            end = (self._end_of_arm(forearm) - self.data.xpos[forearm]) @ self.data.xmat[forearm].reshape(3, 3)
            wrist = ("wrist_flexion", "wrist_deviation", "forearm_pronation")
            if not any(f"{side}_{name}" in self.movements for name in wrist):
                x, y, z = np.round(end, 4).tolist()
                hands[f"{side}_hand"] = self._body(forearm), (x, y, z)
                self.doubts.append(
                    f"the {side} arm has no wrist: its hand is put at {x, y, z} of {self._body(forearm)}"
                )
            standing |= self._hanging_arm(side, elbow, end)
        return standing, hands

    def _hanging_arm(self, side: str, elbow: int, end: FloatArray) -> dict[str, float]:
        """Angles with which one arm hangs: first the elbow straightens, then the shoulder lowers it."""
        model, data = self.model, mujoco.MjData(self.model)
        shoulder = {
            turn: model.joint(self.movements[f"{side}_shoulder_{turn}"]).id
            for turn in _TURN
            if f"{side}_shoulder_{turn}" in self.movements
        }
        first, last = shoulder.get("flexion", min(shoulder.values())), shoulder.get("rotation", max(shoulder.values()))
        centre = nearest_point(*(at[joint] for joint in (first, last) for at in (self.data.xanchor, self.data.xaxis)))
        forearm = int(model.jnt_bodyid[elbow])

        def bones(joints: Sequence[int], angles: FloatArray) -> tuple[FloatArray, FloatArray]:
            data.qpos[model.jnt_qposadr[joints]] = angles
            mujoco.mj_kinematics(model, data)
            hand = data.xpos[forearm] + data.xmat[forearm].reshape(3, 3) @ end
            both = data.xanchor[elbow] - centre, hand - data.xanchor[elbow]
            upper, lower = (bone / max(float(np.linalg.norm(bone)), 1e-9) for bone in both)
            return upper, lower

        def crooked(angle: float) -> float:
            upper, lower = bones([elbow], np.array([angle]))
            return -float(upper @ lower)

        def height(angles: FloatArray) -> float:
            upper, lower = bones(joints, angles)
            return float(upper[2] + lower[2]) + 0.01 * float(angles @ angles)

        data.qpos[:] = model.qpos0
        angles = np.linspace(*self._range(elbow), 721)
        found = {elbow: float(angles[int(np.argmin([crooked(angle) for angle in angles]))])}
        found[elbow] = _rounded(found[elbow])
        bones([elbow], np.array([found[elbow]]))
        joints = [shoulder[turn] for turn in ("flexion", "abduction") if turn in shoulder]
        if joints:
            ranges = [self._range(joint) for joint in joints]
            start = np.clip(model.qpos0[model.jnt_qposadr[joints]], *np.array(ranges).T)
            best = minimize(height, start, bounds=ranges, method="L-BFGS-B")
            found |= {joint: _rounded(angle) for joint, angle in zip(joints, np.asarray(best.x).tolist())}
        return {self._joint(joint): angle for joint, angle in found.items() if angle}

    def _range(self, joint: int) -> tuple[float, float]:
        if not self.model.jnt_limited[joint]:
            return -np.pi, np.pi
        low, high = self.model.jnt_range[joint].tolist()
        return low, high


def _rounded(angle: float) -> float:
    """An angle, as a multiple of a right angle if it is near to one [rad]."""
    nearest = np.pi / 2 * round(angle / (np.pi / 2))
    return nearest if abs(angle - nearest) < STRAIGHT else round(angle, 3)


def _words(name: str) -> list[str]:
    spaced = re.sub(r"([a-z0-9])([A-Z])", r"\1 \2", name)
    spaced = re.sub(r"([A-Z])([A-Z][a-z])", r"\1 \2", spaced)
    return [word for word in re.split(r"[^a-z]+", spaced.lower()) if word]
