"""A fighter who waits answers an attack in time: its own action ends early, a reaction time after the attack begins.

Not in the 2008 paper, whose fighters look at each other only when an own action has ended. In the examples an attack
ends the waiting fighter's action; the reaction times are taken from them.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from simprep.arrays import FloatArray
from simprep.duel.fight.fight import FightAction
from simprep.duel.fight.masks import KICK, OTHERS, PUNCH, reaction_to
from simprep.duel.fight.synthesis import Bout
from simprep.duel.labels.labels import decode, neutral
from simprep.duel.model.structures import NONE, PLAYERS, CoupledGraph
from simprep.errors import SettingError

SHORTEST_S = 0.3
"""Least length of an action that ends early [s]."""
SPARE_S = 0.05
"""A reaction begins at least so long before the attack ends [s]."""


@dataclass(frozen=True)
class Alertness:
    """How fast who answers.

    Attributes:
        to_punch: reaction times to choose from, from the beginning of a punch to that of the answer [s].
        to_kick: the same of kicks [s].
        players: who is alert.

    Raises:
        SettingError: no reaction times, or some that are not above 0.
    """

    to_punch: FloatArray
    to_kick: FloatArray
    players: tuple[int, ...] = PLAYERS

    def __post_init__(self) -> None:
        for name in ("to_punch", "to_kick"):
            times = getattr(self, name)
            if not len(times) or not np.isfinite(times).all() or times.min() <= 0:
                raise SettingError(f"{len(times)} reaction times {name}; valid: at least one, all above 0 s")

    @classmethod
    def of(
        cls, graph: CoupledGraph, fps: float, until: int | None = None, players: tuple[int, ...] = PLAYERS
    ) -> "Alertness | None":
        """The examples' reaction times; None where nobody answers a punch, or nobody a kick.

        Args:
            graph: of the stream.
            fps: frames per second [1/s].
            until: frame from which on the examples are not used; None: all are.
            players: who will be alert.
        """
        actions = graph.actions
        found: dict[int, list[float]] = {PUNCH: [], KICK: []}
        answered = set()
        waits = neutral(decode(actions.label))
        for row in np.argsort(actions.start, kind="stable"):
            own, attack = int(actions.next[row]), int(actions.concurrent[row])
            if own == NONE or attack == NONE or not waits[row] or attack in answered:
                continue
            kind = reaction_to(int(actions.label[attack]))
            if kind == OTHERS or (until is not None and actions.end[own] > until):
                continue
            answered.add(attack)
            found[kind].append(float(actions.start[own] - actions.start[attack]) / fps)
        if not found[PUNCH] or not found[KICK]:
            return None
        return cls(np.array(found[PUNCH]), np.array(found[KICK]), players)

    def watch(self, bout: Bout, begun: FightAction) -> int | None:
        """Let the other fighter end its action early if it waits and the action just begun is an attack.

        Returns:
            The frame at which the other now chooses; None: its action goes on.
        """
        kind, other = reaction_to(begun.label), 1 - begun.player
        waiting = bout.current(other)
        if kind == OTHERS or other not in self.players or not neutral(decode([waiting.label]))[0]:
            return None
        delay = float(bout.rng.choice(self.to_kick if kind == KICK else self.to_punch))
        wished = begun.start + round(delay * bout.fps)
        latest = begun.end - round(SPARE_S * bout.fps)
        earliest = max(begun.start + 1, waiting.start + round(SHORTEST_S * bout.fps))
        frame = max(min(wished, latest), earliest)
        if not frame < min(waiting.end, begun.end):
            return None
        bout.interrupt(other, frame)
        return frame


def run(
    bout: Bout,
    frames: int,
    alertness: Alertness | None = None,
    progress: Callable[[int], None] | None = None,
    before: Callable[[Bout], None] | None = None,
) -> None:
    """Step a fight until both fighters have at least so many frames.

    Args:
        bout: the fight.
        frames: how many.
        alertness: None: nobody's action ends early.
        progress: called with the number of final frames after every step.
        before: called before every step, such as to ask something of an avatar.
    """
    while bout.frame < frames:
        if before is not None:
            before(bout)
        begun = bout.step()
        if alertness is not None:
            alertness.watch(bout, begun)
        if progress is not None:
            progress(min(bout.frame, frames))
