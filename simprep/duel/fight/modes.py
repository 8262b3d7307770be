"""A fight in one of the three modes of the 2008 paper (section 6): who chooses for each fighter, ready to be stepped.

model = fight_model()                             # the built-in one; or fight_model("analysis")
made = begin_fight(model, "interactive", seed=1)
made.avatar.request("left kick", goal=(0.3, 0.0))
made.run(10.0)
fight = made.fight(10.0)
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from simprep.duel.fight.alertness import Alertness, run
from simprep.duel.fight.avatar import Avatar
from simprep.duel.fight.choice import Chooser
from simprep.duel.fight.drawing import DrawingChooser
from simprep.duel.fight.example_motions import ExampleMotions
from simprep.duel.fight.fight import Fight
from simprep.duel.fight.passive import ReactingChooser, RecordedChooser
from simprep.duel.fight.requests import Request
from simprep.duel.fight.synthesis import Bout
from simprep.duel.model.fight_model import FightModel
from simprep.duel.model.held_out import held_out_actions, learn_before, split_frame
from simprep.duel.model.structures import PLAYERS
from simprep.duel.stream.stream import PLAYERS as NAMES
from simprep.errors import SettingError, UnknownNameError

MODES = ("automatic", "interactive", "passive")
LONGEST_S = 3600.0


@dataclass(frozen=True)
class FightInMode:
    """A fight in the making, and who controls it.

    Attributes:
        bout: the fight itself; may be stepped directly, without alertness then.
        model: that chooses; in passive mode one that has not seen the end of its stream.
        mode: one of `MODES`.
        seed: of the fight's only source of chance.
        avatar: whom a user controls; None outside interactive mode.
        alertness: whose actions end early when attacked; None: nobody's.
    """

    bout: Bout
    model: FightModel
    mode: str
    seed: int
    avatar: Avatar | None = None
    alertness: Alertness | None = None

    def run(self, seconds: float, progress: Callable[[float], None] | None = None) -> None:
        """Go on until so many seconds of the fight are final; `progress` is called with the share that is done."""
        frames = self._frames(seconds)
        told = None if progress is None else (lambda done: progress(done / frames))
        run(self.bout, frames, self.alertness, told)

    def fight(self, seconds: float, name: str = "fight") -> Fight:
        """The fight's first seconds, at most those that have been `run`."""
        fight = self.bout.fight(self._frames(seconds), self.mode, self.seed, name)
        record: dict[str, Any] = {
            **fight.record,
            "model": self.model.stream.name,
            "learned_until_frame": self.model.learned_until,
            "alert": [] if self.alertness is None else [NAMES[one] for one in self.alertness.players],
        }
        if self.avatar is not None:
            record["answers"] = [
                {
                    "request": str(one.request),
                    "requested_s": one.request.time,
                    "choices": one.choices,
                    "begins_s": one.begins,
                }
                for one in self.avatar.answers
            ]
        return replace(fight, record=record)

    def _frames(self, seconds: float) -> int:
        return max(2, round(seconds * self.bout.fps))


def begin_fight(
    model: FightModel,
    mode: str = "automatic",
    seed: int = 0,
    player: int = 0,
    requests: Sequence[Request] = (),
    examples: ExampleMotions | None = None,
) -> FightInMode:
    """Begin a fight.

    Args:
        model: with the example motions. In passive mode, one that has learned from all of its stream is learned anew
            from the first two thirds; the attacks come from the last.
        mode: `automatic`: both by the model; `interactive`: one is an avatar; `passive`: one performs what it did in
            the part of the stream that was held out, and the other only reacts.
        seed: of the fight's only source of chance.
        player: 0 or 1: the avatar, or who performs what was recorded.
        requests: of the avatar's user, timed; more can be made while the fight goes on.
        examples: of this very model, where already made.

    Raises:
        UnknownNameError: no such mode.
        SettingError: requests in another mode, a negative seed, an unknown player, or as `Avatar`.
        MotionError: as `learn_before` and `Bout`.
    """
    if mode not in MODES:
        raise UnknownNameError("mode", mode, MODES)
    if requests and mode != "interactive":
        raise SettingError(f"requests in {mode} mode; valid: in interactive mode")
    if seed < 0:
        raise SettingError(f"seed {seed}; valid: 0 or more")
    if player not in (0, 1):
        raise SettingError(f"player {player}; valid: 0 or 1")
    if mode == "passive" and model.learned_until is None:
        model, examples = learn_before(model, split_frame(model)), None
    players = model.model.players
    rng = np.random.default_rng(seed)
    pair: list[Chooser] = [DrawingChooser(players[0]), DrawingChooser(players[1])]
    avatar: Avatar | None = None
    alert: tuple[int, ...] = PLAYERS
    if mode == "interactive":
        pair[player] = avatar = Avatar(model, player, script=tuple(requests))
    if mode == "passive":
        recorded = held_out_actions(model, player)
        pair[player] = RecordedChooser(np.roll(recorded, -int(rng.integers(len(recorded)))).tolist())
        pair[1 - player] = ReactingChooser(players[1 - player])
        alert = (1 - player,)
    alertness = Alertness.of(model.model.graph, model.stream.fps, model.learned_until, alert)
    examples = examples or ExampleMotions.of(model.stream, model.model)
    return FightInMode(Bout(examples, (pair[0], pair[1]), rng), model, mode, seed, avatar, alertness)
