"""A reference that grows: what one body is to track as far as it is known, and standing after that."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from simprep.arrays import BoolArray, FloatArray
from simprep.character import Character
from simprep.errors import MotionError
from simprep.motion.curves import minimum_jerk
from simprep.motion.edit import cut
from simprep.motion.motion import Motion
from simprep.motion.turns import rotation_between
from simprep.physics.reference import Reference, ReferenceSettings, at_rate, process
from simprep.physics.standing import BRAKE_S, standing_tail

EASE_S = 0.3
"""Time in which a difference dies away between where the reference is and where a further motion begins [s]."""
GAP_M = 0.5
"""A motion that begins farther away does not go on from here [m]."""


class ReferenceLine:
    """What one body is to track, with a pose for each simulation step from 0.

    Args:
        character: the body.
        timestep: simulation step [s].
        settings: processing of what is given.
    """

    def __init__(self, character: Character, timestep: float, settings: ReferenceSettings) -> None:
        self.character, self._timestep, self._settings = character, timestep, settings
        self._given: Motion | None = None
        self._first = 0  # step of the first pose that is kept

    @property
    def last(self) -> int:
        """Last step that was given; -1 if nothing was."""
        return -1 if self._given is None else self._first + len(self._given) - 1

    def extend(self, motion: Motion, step: int) -> None:
        """Go on with a motion: its first pose takes the place of the last given one, or of the present one if that is later.

        A small difference between the two dies away.

        Args:
            motion: placed where it should happen.
            step: the present one.

        Raises:
            MotionError: a motion of another body, of one frame, or one that begins far from where the reference is.
        """
        if motion.character != self.character:
            raise MotionError(f"{motion.name} belongs to {motion.character}; this body is {self.character}")
        new = at_rate(motion, self._timestep)
        if self._given is None:
            self._given = new
            return
        old = self._upto(max(step, self.last))
        gap = float(np.linalg.norm(new.qpos[0, :2] - old.qpos[-1, :2]))
        if gap > GAP_M:
            raise MotionError(
                f"{motion.name} begins {gap:.2f} m from where the reference is; valid: up to {GAP_M:g} m (move it first)"
            )
        poses = _eased(old.qpos[-1], new.qpos, EASE_S / self._timestep)
        seam = len(old) - 1
        events = {**old.events, **{key: frame + seam for key, frame in new.events.items()}}
        self._given = replace(
            old,
            qpos=np.concatenate([old.qpos[:-1], poses]),
            contacts=np.concatenate([old.contacts[:-1], new.contacts]),
            events=events,
            name=new.name if new.name == old.name else f"{old.name}+{new.name}"[-100:],
        )

    def forget(self, after: int) -> None:
        """Forget what was given after a step; nothing happens where nothing was."""
        if self._given is not None and self._first + 1 <= after < self.last:
            self._given = cut(self._given, 0, after - self._first + 1)

    def begin_anew(self, motion: Motion, step: int) -> None:
        """Follow a motion from a step on, wherever the reference was: for a body that has lost it, such as by a fall.

        What was before that step counts as the motion's first pose, so that no speed comes from the jump.

        Args:
            motion: placed where it should happen.
            step: of its first pose; the present one or a later one.

        Raises:
            MotionError: a motion of another body, or of one frame.
        """
        if motion.character != self.character:
            raise MotionError(f"{motion.name} belongs to {motion.character}; this body is {self.character}")
        new = at_rate(motion, self._timestep)
        kept = step - self._first
        self._given = replace(
            new,
            qpos=np.concatenate([np.repeat(new.qpos[:1], kept, axis=0), new.qpos]),
            contacts=np.concatenate([np.repeat(new.contacts[:1], kept, axis=0), new.contacts]),
            events={key: frame + kept for key, frame in new.events.items()},
        )

    def window(self, first: int, last: int) -> Reference:
        """The reference from step `first` to `last`; older poses are forgotten. What was not given is standing."""
        whole = self._upto(max(last, self.last))
        settled = self.last + BRAKE_S / self._timestep  # from here on all poses are the same
        begin = first if first >= settled else min(first, self.last - 1)  # standing goes on from the last two poses
        after = max(self.last + 1, begin + 2)
        if begin > self._first:
            self._given, self._first = cut(whole, begin - self._first, after - self._first), begin
            whole = self._upto(max(last, self.last))
        return process(cut(whole, first - self._first, last - self._first + 1), self._settings)

    def _upto(self, last: int) -> Motion:
        """Poses from the first kept one to step `last`: what was given, then standing."""
        assert self._given is not None
        missing = last - self.last
        if missing <= 0:
            return self._given
        tail = standing_tail(self._given.qpos, self._given.fps, self.character, missing)
        return replace(
            self._given,
            qpos=np.concatenate([self._given.qpos, tail]),
            contacts=np.concatenate([self._given.contacts, np.ones((missing, 2), dtype=bool)]),
        )


class PastReference:
    """One body's references of the steps that are over, which a growing reference forgets."""

    def __init__(self) -> None:
        self._qpos: list[FloatArray] = []
        self._qvel: list[FloatArray] = []
        self._contacts: list[BoolArray] = []
        self._events: dict[str, int] = {}
        self._until = 0

    def keep(self, reference: Reference, first: int, step: int) -> None:
        """Keep what is new up to `step`, not included, of a reference that begins at step `first`."""
        rows = slice(self._until - first, step - first)
        self._qpos.append(reference.qpos[rows])
        self._qvel.append(reference.qvel[rows])
        self._contacts.append(reference.motion.contacts[rows])
        self._events |= {key: frame + first for key, frame in reference.motion.events.items() if frame + first < step}
        self._until = step

    def joined(self, reference: Reference, first: int) -> tuple[Motion, FloatArray]:
        """The whole reference from step 0, and its velocities, with the one in force, which begins at step `first`."""
        if not self._until:
            return reference.motion, reference.qvel
        rows, motion = slice(self._until - first, None), reference.motion
        whole = replace(
            motion,
            qpos=np.concatenate([*self._qpos, reference.qpos[rows]]),
            contacts=np.concatenate([*self._contacts, motion.contacts[rows]]),
            events={**self._events, **{key: frame + first for key, frame in motion.events.items()}},
        )
        return whole, np.concatenate([*self._qvel, reference.qvel[rows]])


def _eased(pose: FloatArray, poses: FloatArray, frames: float) -> FloatArray:
    """Poses (F, nq) that begin with another pose; the difference dies away in so many frames."""
    if np.array_equal(pose, poses[0]):
        return poses
    left = 1 - minimum_jerk(np.arange(len(poses)) / frames)[:, None]
    out = poses + left * (pose - poses[0])
    turn = rotation_between(poses[0, 3:7], pose[3:7])
    root = Rotation.from_rotvec(left * turn) * Rotation.from_quat(poses[:, 3:7], scalar_first=True)
    out[:, 3:7] = root.as_quat(scalar_first=True)
    return np.asarray(out)
