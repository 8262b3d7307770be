"""What one fighter has done so far in a fight: poses, contacts, and the actions performed."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from simprep.arrays import BoolArray, FloatArray
from simprep.duel.fight.fight import NONE, FightAction
from simprep.duel.fight.floor_move import FloorMove, GradualMove
from simprep.duel.model.action_features import ActionSummaries, summarise
from simprep.motion.edit import yaw
from simprep.motion.kinematics import Kinematics


@dataclass(frozen=True)
class Performed:
    """An action of the fight.

    Attributes:
        action: which, and when.
        index: of the example, appended recordings included; -1 for none.
        summary: means over its frames.
    """

    action: FightAction
    index: int
    summary: ActionSummaries


class FighterTrack:
    """What one fighter has done and will do until the end of the current action, at so many frames per second."""

    def __init__(self, fps: float) -> None:
        self.fps = fps
        self.qpos = np.empty((0, 0))
        self.contacts = np.empty((0, 2), dtype=bool)
        self.com = np.empty((0, 2))
        self.lift = np.empty((0, 2))
        self.pose = np.empty((0, 0))
        self.done: list[Performed] = []
        self.moves: list[GradualMove] = []

    def put(self, first: int, qpos: FloatArray, contacts: BoolArray, kinematics: Kinematics, pose: FloatArray) -> None:
        """Replace all frames from `first` on."""
        self.moves = [
            replace(one, until=first) if one.until is None and one.first + one.frames > first else one
            for one in self.moves
        ]
        lift = kinematics.foot_points[..., 2].min(axis=-1)
        parts: dict[str, Any] = {
            "qpos": qpos, "contacts": contacts, "com": kinematics.com[:, :2], "lift": lift, "pose": pose,
        }  # fmt: skip
        for name, new in parts.items():
            old = getattr(self, f"_{name}", None)
            size = first + len(new)
            if old is None or len(old) < size:
                grown = np.empty((2 * size + 512, *new.shape[1:]), dtype=new.dtype)
                if old is not None:
                    grown[: len(old)] = old
                setattr(self, f"_{name}", grown)
                old = grown
            old[first:size] = new
            setattr(self, name, old[:size])

    def move(self, gradual: GradualMove) -> None:
        """Move what is to come on the floor, little by little."""
        self.moves.append(gradual)
        part = slice(gradual.first, None)
        share = gradual.share(np.arange(gradual.first, len(self.qpos)))
        self.com[part] = gradual.move.points(self.com[part], share)
        self.qpos[part] = gradual.move.poses(self.qpos[part], share)
        for number, one in enumerate(self.done):
            if one.action.end > gradual.first:
                self.done[number] = replace(one, summary=self._summary(one.action))

    def moving(self, frame: float) -> FloorMove | None:
        """What is still to come of the moves made so far; None for nothing."""
        left = [one.ahead(frame) for one in self.moves if one.first + one.frames > frame]
        if not left:
            return None
        shift = np.sum([one.shift for one in left], axis=0)
        return FloorMove(shift, sum(one.turn for one in left), left[-1].pivot)

    def unmoved(self, frames: int) -> FloatArray:
        """The first poses (F, nq) without any move: feet that stand rest in them."""
        qpos = self.qpos[:frames]
        for one in reversed(self.moves):
            qpos = one.move.undone(qpos, one.share(np.arange(len(qpos))))
        return qpos

    def perform(self, action: FightAction, index: int) -> None:
        """Note an action, whose frames were put; `index` as of `Performed`."""
        self.done.append(Performed(action, index, self._summary(action)))

    def end_at(self, frame: int) -> None:
        """End the current action at a frame."""
        last = self.done.pop()
        moment = last.action.moment if last.action.moment < frame else NONE
        self.perform(replace(last.action, end=frame, moment=moment), last.index)

    def _summary(self, action: FightAction) -> ActionSummaries:
        part = slice(action.start, action.end)
        return summarise(self.qpos[part, :2], yaw(self.qpos[part, 3:7]), self.pose[part], self.fps)

    @property
    def current(self) -> Performed:
        """What is being performed, or was last."""
        return self.done[-1]

    def during(self, frame: int) -> Performed:
        """What was performed at a frame."""
        return next(one for one in reversed(self.done) if one.action.start <= frame)
