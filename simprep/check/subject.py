"""What all checks share: the motion with its kinematics, computed once."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from simprep.arrays import BoolArray, FloatArray
from simprep.character import Character
from simprep.errors import MotionError
from simprep.metrics.smoothing import SmoothMotion, smooth_motion
from simprep.motion.contacts import ContactSettings, detect_contacts
from simprep.motion.edit import repeat
from simprep.motion.kinematics import Kinematics, body_clearance, forward_kinematics
from simprep.motion.motion import Motion
from simprep.physics.whole_body import WholeBody, whole_body

FEWEST_FRAMES = 5
DYNAMICS_SIGMA_S = 0.03
"""Captured noise above 5 Hz says nothing of the whole body's dynamics [s]."""
STANDING = ContactSettings(enter_height=0.02, leave_height=0.03, enter_speed=0.2, leave_speed=0.4)
"""A foot within 2 cm of the floor, which is holosoma's precision of contact, and slow enough to carry the body."""


@dataclass(frozen=True, eq=False)
class Subject:
    """A motion under examination; a loop is played twice, so that its seam is seen.

    Attributes:
        motion: what is examined.
        frames: frames of the original; frame numbers are reported modulo it.
    """

    motion: Motion
    frames: int

    @property
    def character(self) -> Character:
        """Who moves."""
        return self.motion.character

    @property
    def fps(self) -> float:
        """Frames per second [1/s]."""
        return self.motion.fps

    def frame(self, index: int | np.integer) -> int:
        """The frame of the original."""
        return int(index) % self.frames

    @cached_property
    def kinematics(self) -> Kinematics:
        """Positions of every frame."""
        return forward_kinematics(self.motion.qpos, self.character)

    @cached_property
    def clearance(self) -> FloatArray:
        """Height (T,) of the lowest point of the body above the floor [m]; negative in the floor."""
        return np.asarray(self._clearances.min(axis=1))

    @cached_property
    def clearance_of_others(self) -> FloatArray:
        """The same (T,) of all segments but the feet [m]."""
        return np.asarray(np.delete(self._clearances, self.character.feet, axis=1).min(axis=1))

    @cached_property
    def _clearances(self) -> FloatArray:
        return body_clearance(self.motion.qpos, self.character)

    @cached_property
    def standing(self) -> BoolArray:
        """Feet (T, 2) that carry the body: by the motion's own contacts and by height and speed alike."""
        found = detect_contacts(self.motion.qpos, self.fps, self.character, STANDING)
        return np.asarray(found & self.motion.contacts)

    @cached_property
    def smooth(self) -> SmoothMotion:
        """Low-passed poses and their derivatives at 60 Hz."""
        return smooth_motion(self.motion, sigma=DYNAMICS_SIGMA_S)

    @cached_property
    def body(self) -> WholeBody:
        """Whole-body dynamics of `smooth`."""
        return whole_body(self.character.model, self.smooth.qpos, self.smooth.qvel, self.smooth.qacc)


def subject(motion: Motion) -> Subject:
    """Prepare a motion for its checks.

    Raises:
        MotionError: too short to be judged.
    """
    if len(motion) < FEWEST_FRAMES:
        raise MotionError(f"{motion.name}: {len(motion)} frames; a check needs at least {FEWEST_FRAMES}")
    if motion.loop:
        return Subject(replace(repeat(motion, 2), loop=False), len(motion))
    return Subject(motion, len(motion))
