"""Duel: the reference of two fighters from the fight model, drawn as far ahead as it is needed."""

from dataclasses import replace
from functools import lru_cache

from simprep.app.director import Caption, Point
from simprep.character import Character
from simprep.duel.fight.default_model import fight_model
from simprep.duel.fight.drawing import DrawingChooser
from simprep.duel.fight.modes import FightInMode, begin_fight
from simprep.duel.labels.labels import Label
from simprep.duel.model.fight_model import FightModel
from simprep.errors import SettingError
from simprep.motion.motion import Motion
from simprep.physics.tracker_state import TrackerState

AHEAD_S = 1.2
"""A piece is at least so long [s]."""
LONGEST_S = 600.0
"""After so long the fighters stand still; memory grows by about 40 kB each second of a fight until then."""
SHOWN = 4


@lru_cache(maxsize=1)
def page_model() -> FightModel:
    """The built-in fight model, read once."""
    return fight_model()


class Dueling:
    """A `Director` of two fighters; fighter A is the avatar in interactive mode.

    Args:
        mode: `automatic`, `interactive` or `passive`.
        seed: of the fight.
        model: None: the built-in one.
    """

    def __init__(self, mode: str, seed: int = 0, model: FightModel | None = None) -> None:
        self.fight: FightInMode = begin_fight(model or page_model(), mode, seed)
        self.mode = mode
        bodies = self.fight.bout.examples.bodies
        self.characters: tuple[Character, ...] = (bodies[0], bodies[1])
        self._given = 0  # frames
        self._shown = {one: DrawingChooser(self.fight.model.model.players[one]) for one in (0, 1)}
        self._chances: tuple[tuple[float, tuple[tuple[str, float], ...]], ...] = ()
        self._goal: Point | None = None

    def request(self, action: str = "", goal: Point | None = None) -> None:
        """Ask the avatar for an attack (`simprep.duel.model.structures.REQUESTS`) or to go to a place.

        Raises:
            SettingError: nobody is an avatar in this mode, or it has no such attack.
            UnknownNameError: no such attack.
        """
        if self.fight.avatar is None:
            raise SettingError(f"nobody can be asked in {self.mode} mode; valid: scene duel interactive")
        self.fight.avatar.request(action, goal, time=self.fight.bout.time)
        self._goal = goal or self._goal

    def begin(self) -> tuple[Motion, ...]:
        """The first piece of both (see `Director.begin`)."""
        return self._pieces()

    def more(self, state: TrackerState) -> tuple[Motion | None, ...] | None:
        """The next piece of both (see `Director.more`)."""
        return None if state.time > LONGEST_S else self._pieces()

    def caption(self, time: float) -> Caption:
        """Labels and chances (see `Director.caption`)."""
        bout = self.fight.bout
        frame = round(time * bout.fps)
        doing = []
        for player in (0, 1):
            action = bout.during(player, frame)
            request = f" (asked for: {action.request})" if action.request else ""
            doing.append(f"{'AB'[player]}: {Label.from_code(action.label)}{request}")
        chances = next((found for start, found in reversed(self._chances) if start <= time), ())
        return Caption(doing=tuple(doing), chances=chances, goal=self._goal)

    def _pieces(self) -> tuple[Motion, ...]:
        bout = self.fight.bout
        first, until = max(self._given - 1, 0), self._given + round(AHEAD_S * bout.fps)
        self.fight.run(until / bout.fps)
        until = bout.frame
        self._note()
        stream = self.fight.bout.fight(until).stream
        self._given = until
        return tuple(
            replace(motion, qpos=motion.qpos[first:until], contacts=motion.contacts[first:until], name="fight")
            for motion in stream.players
        )

    def _note(self) -> None:
        """What the fighter that chooses next may do, with which probability."""
        bout = self.fight.bout
        player = bout.due
        chooser = self._shown[player]
        chances = chooser.label_probabilities(bout.situation(player))
        codes = chooser.model.labels.candidates
        best = chances.argsort()[::-1][:SHOWN]
        found = tuple((f"{'AB'[player]}: {Label.from_code(int(codes[one]))}", float(chances[one])) for one in best)
        self._chances = (*self._chances, (bout.time, found))[-60:]
