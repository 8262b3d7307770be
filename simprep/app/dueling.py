"""Duel: two fighters whose next actions are chosen by where the simulated bodies are, as `simprep fight` does it."""

from collections import deque
from functools import lru_cache

import numpy as np

from simprep.app.director import Caption, Point
from simprep.character import Character
from simprep.duel.fight.choice import Choice, Chooser, Situation
from simprep.duel.fight.default_model import fight_model
from simprep.duel.fight.drawing import DrawingChooser
from simprep.duel.fight.live import LiveFight
from simprep.duel.fight.masks import LabelMasks, narrowed
from simprep.duel.fight.modes import FightInMode, begin_fight
from simprep.duel.fight.passive import RecordedChooser
from simprep.duel.fight.requests import Request
from simprep.duel.labels.labels import Label
from simprep.duel.model.fight_model import FightModel
from simprep.duel.model.structures import PLAYERS
from simprep.duel.stream.stream import player_name
from simprep.errors import SettingError
from simprep.physics.tracker import Tracker

LONGEST_S = 600.0
"""After so long a fight begins anew; memory grows by about 40 kB each second of it until then."""
SHOWN, REMEMBERED = 4, 80
"""How many probabilities of a choice are shown, and of how many choices they are remembered."""
STRIDE_M, NEAR_M = 0.5, 0.25
"""The avatar is asked to go so far at a time, and has arrived when it is so near [m]."""


@lru_cache(maxsize=1)
def page_model() -> FightModel:
    """The built-in fight model, read once."""
    return fight_model()


class _Noting:
    """A chooser that remembers what it knew at each choice; it chooses as the one inside does."""

    def __init__(self, inside: Chooser, notes: deque[Situation]) -> None:
        self._inside, self._notes = inside, notes

    def choose(self, situation: Situation, rng: np.random.Generator) -> Choice:
        self._notes.append(situation)
        return self._inside.choose(situation, rng)


class Dueling:
    """A `Director` of a fight with feedback (`simprep.duel.fight.live.LiveFight`); fighter A is the avatar in interactive mode.

    Args:
        mode: `automatic`, `interactive` or `passive`.
        seed: of the fight.
        model: None: the built-in one.
        optimise: whether postures are optimised while they are drawn.

    Attributes:
        characters: the two bodies.
        live: the fight, once it has begun.
    """

    longest_s = LONGEST_S

    def __init__(self, mode: str, seed: int = 0, model: FightModel | None = None, optimise: bool = False) -> None:
        self.fight: FightInMode = begin_fight(model or page_model(), mode, seed)
        self.mode, self._seed, self._optimise = mode, seed, optimise
        self.characters: tuple[Character, ...] = self.fight.bout.examples.bodies
        self.live: LiveFight | None = None
        self._notes: deque[Situation] = deque(maxlen=REMEMBERED)
        self._told = [DrawingChooser(one) for one in self.fight.model.model.players]
        self._found: tuple[Situation | None, tuple[tuple[str, float], ...]] = (None, ())
        self._goal: Point | None = None
        self._stride: Request | None = None

    def request(self, action: str = "", goal: Point | None = None) -> None:
        """Ask the avatar for an attack (`simprep.duel.model.structures.REQUESTS`), or to go to a place and stay about there.

        Raises:
            SettingError: nobody is an avatar in this mode, or it has no such attack.
            UnknownNameError: no such attack.
        """
        avatar = self.fight.avatar
        if avatar is None:
            raise SettingError(f"nobody can be asked in {self.mode} mode; valid: scene duel interactive")
        if action:
            avatar.request(action, time=0.0 if self.live is None else self.live.time)
        if goal is not None:
            self._goal, self._stride = goal, None

    def begin(self, tracker: Tracker) -> None:
        """See `Director.begin`."""
        self.live = LiveFight(self.fight, self._seed, tracker, optimise=self._optimise)
        bout = self.fight.bout
        bout.choosers = tuple(
            one if isinstance(one, RecordedChooser) else _Noting(one, self._notes) for one in bout.choosers
        )
        self.live.run(1 / bout.fps)  # its first frame takes no time

    def advance(self, until_s: float) -> None:
        """See `Director.advance`."""
        assert self.live is not None
        self._steer()
        self.live.run(until_s + 1 / self.fight.bout.fps)

    def caption(self, time: float) -> Caption:
        """Labels and chances (see `Director.caption`)."""
        bout = self.fight.bout
        frame = round(time * bout.fps)
        doing = []
        for player in PLAYERS:
            action = bout.during(player, frame)
            request = f" (asked for: {action.request})" if action.request else ""
            words = action.note or str(Label.from_code(action.label))
            falls = () if self.live is None else self.live.falls
            if any(one.player == player and one.time_s <= time < (one.up_s or np.inf) for one in falls):
                words = "down; gets up if it can"
            doing.append(f"{player_name(player)}: {words}{request}")
        return Caption(doing=tuple(doing), chances=self._chances(time), goal=self._goal)

    def _chances(self, time: float) -> tuple[tuple[str, float], ...]:
        """What the present choice was made among, the likeliest first."""
        note = next((one for one in reversed(self._notes) if one.time <= time), None)
        if note is None:
            return ()
        if note is not self._found[0]:
            masks = LabelMasks.of(self._told[note.player].model)
            allowed = np.ones(len(masks.codes), dtype=bool)
            if self.mode == "passive":  # as `ReactingChooser`
                allowed = narrowed(allowed, ~masks.attacks, masks.neutral)
            chances = self._told[note.player].label_probabilities(note, allowed)
            best, name = chances.argsort()[::-1][:SHOWN], player_name(note.player)
            words = [f"{name}: {Label.from_code(int(masks.codes[one]))}" for one in best]
            self._found = note, tuple(zip(words, chances[best].tolist()))
        return self._found[1]

    def _steer(self) -> None:
        """Ask the avatar for the next stride towards the goal, until it is there."""
        avatar, live, goal = self.fight.avatar, self.live, self._goal
        if avatar is None or live is None or goal is None:
            return
        if self._stride is not None and not any(one.request is self._stride for one in avatar.answers[-8:]):
            return  # has not been answered yet
        place = live.tracker.state.bodies_qpos[avatar.player][:2]
        way = np.array(goal) - place
        far = float(np.linalg.norm(way))
        if far < NEAR_M:
            return
        stride = place + way * min(1.0, STRIDE_M / far)
        self._stride = avatar.request("", (float(stride[0]), float(stride[1])), live.time)
