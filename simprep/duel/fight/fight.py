"""A fight: motions, and which example action each fighter performed when."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from simprep.arrays import IntArray
from simprep.display import SelfShowing, data_frame
from simprep.duel.labels.labels import Label
from simprep.duel.stream.stream import DuelStream
from simprep.errors import MotionError

NONE = -1
"""No frame, or no example."""


@dataclass(frozen=True)
class FightAction:
    """One action of a fight.

    Attributes:
        player: who, from 0.
        start: first frame in the fight.
        end: frame at which the player's next action begins, one past the last.
        label: label code of the example (`simprep.duel.labels.labels`).
        example: index of the example in B of the model; -1 where it is not in B (a held-out attack).
        moment: frame of the interaction moment, the peak of the contact force; -1 where there is none.
        request: the user's request that this action answers; empty for none.
        note: why, where not chosen as usual: `reacts` to a blow, `catches` himself, is `down`, `waits` for who is
            down; empty otherwise.
    """

    player: int
    start: int
    end: int
    label: int
    example: int = NONE
    moment: int = NONE
    request: str = ""
    note: str = ""


@dataclass(frozen=True)
class Fight(SelfShowing):
    """Motions of two fighters or more, and the actions they are made of.

    Attributes:
        stream: all motions, one clip.
        actions: of all, by player, then by first frame. Each player's follow each other without gaps from frame 0 to
            the end of the stream, which may cut off the last.
        mode: `automatic`, `interactive`, `passive`, or the name of a baseline.
        seed: of the source of chance.
        record: what else a report needs: settings, the model's name.

    Raises:
        MotionError: actions that leave gaps, overlap, or do not reach from the first frame to the last, or of nobody.
    """

    stream: DuelStream
    actions: tuple[FightAction, ...]
    mode: str = "automatic"
    seed: int = 0
    record: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "actions", tuple(sorted(self.actions, key=lambda one: (one.player, one.start))))
        object.__setattr__(self, "record", MappingProxyType(dict(self.record)))
        count = len(self.stream.players)
        strangers = sorted({one.player for one in self.actions} - set(range(count)))
        if strangers:
            raise MotionError(f"{self.stream.name}: actions of player {strangers[0]}; valid: 0 to {count - 1}")
        for player in range(count):
            own = self.of(player)
            edges = [0, *(one.end for one in own)]
            if not own or edges[-1] != len(self.stream) or any(a.start != b for a, b in zip(own, edges)):
                raise MotionError(
                    f"{self.stream.name}: actions of player {player} do not cover frames 0 to {len(self.stream) - 1} "
                    "one after the other"
                )

    def of(self, player: int) -> tuple[FightAction, ...]:
        """Actions of one player, in order of time."""
        return tuple(one for one in self.actions if one.player == player)

    def facts(self) -> tuple[str, Mapping[str, Any]]:
        """What `rich.print(fight)` and Jupyter show."""
        own = [self.of(player) for player in range(len(self.stream.players))]
        return f"fight, {self.mode}", {
            "bodies": ", ".join(motion.character.name for motion in self.stream.players),
            "length [s]": round(self.stream.duration, 2),
            "frames": f"{len(self.stream)} at {self.stream.fps:g}/s",
            "actions": ", ".join(f"{name}: {len(actions)}" for name, actions in zip(self.stream.names, own)),
            "attacks": ", ".join(
                f"{name}: {sum(Label.from_code(one.label).attacks for one in actions)}"
                for name, actions in zip(self.stream.names, own)
            ),
            "answered requests": sum(bool(one.request) for one in self.actions),
            "seed": self.seed,
        }

    def to_dataframe(self) -> Any:
        """A pandas DataFrame of the actions, by time: who does what, from when to when [s], and why."""
        fps = self.stream.fps
        rows = [
            {
                "player": self.stream.names[one.player],
                "start_s": one.start / fps,
                "end_s": one.end / fps,
                "label": str(Label.from_code(one.label)),
                "moment_s": None if one.moment == NONE else one.moment / fps,
                "example": None if one.example == NONE else one.example,
                "request": one.request,
                "note": one.note,
            }
            for one in sorted(self.actions, key=lambda one: (one.start, one.player))
        ]
        return data_frame(rows)

    @property
    def table(self) -> IntArray:
        """(S, 4) player, first frame, frame after the last, clip (0), as `Cuts.table`."""
        return np.array([(one.player, one.start, one.end, 0) for one in self.actions], dtype=np.int64).reshape(-1, 4)

    @property
    def codes(self) -> IntArray:
        """(S,) label codes, in the order of `table`."""
        return np.array([one.label for one in self.actions], dtype=np.int64)
