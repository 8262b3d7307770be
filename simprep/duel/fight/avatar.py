"""Interactive mode: a user asks for a fighter's next action and place, at any time.

Source: the 2008 paper, section 5.2. The kind of action asked for is looked up in the action table R, and the transition
model chooses among the answering labels. A place is where the root should be on the floor 0.5 s after the next action
begins (Eq. 13). Without a request the avatar acts by itself.

Ours: a limb that is out is first taken back where the examples never go from it straight to what is asked for, and
examples are preferred that lead to the goal from where the avatar stands (`Steering`).
"""

from dataclasses import dataclass

import numpy as np

from simprep.arrays import BoolArray, FloatArray, IntArray
from simprep.duel.fight.choice import Choice, Situation
from simprep.duel.fight.drawing import DrawingChooser
from simprep.duel.fight.masks import kind_of, narrowed, seen_successions
from simprep.duel.fight.requests import Request
from simprep.duel.model.fight_model import FightModel
from simprep.duel.model.structures import REQUESTS
from simprep.duel.model.transition_model import TransitionModel
from simprep.duel.stream.stream import PLAYERS
from simprep.errors import SettingError
from simprep.motion.edit import yaw
from simprep.motion.turns import turned

NEAR = 1e-6


@dataclass(frozen=True)
class Steering:
    """How a goal is reached.

    Attributes:
        density: the choice is weighed by Eq. 13 instead of Eq. 6.
        spread_m: it is also weighed by a Gaussian of this standard deviation around where each example leads [m];
            infinity: not so.
        drift_m: farthest drift of the placement to a goal to which the example does not lead by itself [m]; farther,
            feet would slide. 0: the drift is that of every action.

    Raises:
        SettingError: values out of range.
    """

    density: bool = True
    spread_m: float = 0.05
    drift_m: float = 0.1

    def __post_init__(self) -> None:
        if not self.spread_m >= 0.001:
            raise SettingError(f"spread of {self.spread_m} m; valid: 0.001 or more")
        if not 0 <= self.drift_m <= 1:
            raise SettingError(f"drift of {self.drift_m} m; valid: 0 to 1")


@dataclass(frozen=True)
class Answer:
    """What became of a request.

    Attributes:
        request: what was asked for.
        choices: how many choices it took, 1: the very next action; 0: a newer request came first.
        begins: time at which the answering action begins [s].
        example: the action, by its number in B.
    """

    request: Request
    choices: int
    begins: float
    example: int


@dataclass
class _Waiting:
    request: Request
    passed: int = 0


class Avatar:
    """One fighter under a user's control; a `choice.Chooser`.

    The newest request for an action and the newest for a place count; what they replace is never answered.

    Args:
        model: with the example motions.
        player: 0 or 1, whom the user controls.
        steering: None for the default.
        script: timed requests.

    Raises:
        SettingError: the script asks for an attack that this player has not in the examples.

    Attributes:
        answers: what became of the requests so far, in order of time.
    """

    def __init__(
        self, model: FightModel, player: int = 0, steering: Steering | None = None, script: tuple[Request, ...] = ()
    ) -> None:
        self.model: TransitionModel = model.model.players[player]
        self.player = player
        self.steering = steering or Steering()
        self.answers: list[Answer] = []
        self.goal_delay = model.model.goal_delay
        self._graph = model.model.graph
        self._codes = self.model.labels.candidates
        self._kinds = kind_of(self._codes)
        self._successions = seen_successions(self._graph, player)
        self._drawing = DrawingChooser(self.model)
        self._way = displacements(model, player, self.model.examples)
        self._waiting: list[_Waiting] = []
        for one in script:
            self.request(one.action, one.goal, one.time)

    def request(self, action: str = "", goal: tuple[float, float] | None = None, time: float = 0.0) -> Request:
        """Ask for something; the request is found in `answers` later.

        Args:
            action: kind of attack (`structures.REQUESTS`: kick, punch, left kick, ...); empty for any action.
            goal: (x, y) where the root should be 0.5 s after the next action begins, on the floor of the world [m].
            time: from which on the request counts [s]; 0: from now on.

        Raises:
            UnknownNameError: no such kind of attack.
            SettingError: nothing asked for, a place that is not finite, or this player has no such attack.
        """
        asked = Request(action, goal, time)
        if action and not self._answering(action).any():
            known = [one for one in REQUESTS if self._answering(one).any()]
            raise SettingError(
                f"player {PLAYERS[self.player]} has no {action!r} in the examples of this model; "
                f"valid: {', '.join(known) or 'no attack at all, only places'}"
            )
        self._waiting.append(_Waiting(asked))
        return asked

    def choose(self, situation: Situation, rng: np.random.Generator) -> Choice:
        """The next action (see `choice.Chooser`)."""
        known = situation.time if situation.known_s is None else situation.known_s
        due = [one for one in self._waiting if one.request.time <= known + NEAR]
        for one in due:
            one.passed += 1
        acting = next((one for one in reversed(due) if one.request.action), None)
        placing = next((one for one in reversed(due) if one.request.goal is not None), None)
        for one in due:
            if one is not acting and one is not placing:
                self._waiting.remove(one)
                self.answers.append(Answer(one.request, 0, situation.time, -1))
        allowed, now = self._allowed(acting, situation)
        if not now and placing is acting:
            placing = None  # its place belongs to its action
        answered = [one for one in (acting if now else None, placing) if one is not None]
        goal = None if placing is None else placing.request.goal
        choice = self._draw(situation, allowed, None if goal is None else np.array(goal), rng)
        text = " ".join(dict.fromkeys(str(one.request) for one in answered))
        for one in {id(one): one for one in answered}.values():
            self._waiting.remove(one)
            self.answers.append(Answer(one.request, one.passed, situation.time, choice.example))
        return Choice(choice.example, text, choice.goal, choice.goal_s)

    def _answering(self, action: str) -> BoolArray:
        """(K,) candidates that answer."""
        nodes = self._graph.table.answering(self.player, action)
        return np.isin(self._codes, self._graph.graphs[self.player].labels[nodes])

    def _allowed(self, acting: _Waiting | None, situation: Situation) -> tuple[BoolArray | None, bool]:
        """Candidates for the next action, and whether they answer the request for an action."""
        if acting is None:
            return None, True
        answering = self._answering(acting.request.action)
        own = int(kind_of(situation.own_label))
        follows = np.array([(own, int(kind)) in self._successions for kind in self._kinds])
        if (answering & follows).any() or acting.passed > 1:
            return narrowed(answering, follows), True
        wanted = set(self._kinds[answering].tolist())
        leads = np.array([any((int(kind), one) in self._successions for one in wanted) for kind in self._kinds])
        if not (follows & leads).any():
            return answering, True
        return follows & leads, False

    def _draw(
        self, s: Situation, allowed: BoolArray | None, goal: FloatArray | None, rng: np.random.Generator
    ) -> Choice:
        known = (s.own_label, s.opponent_label, s.own, s.opponent)
        if goal is None:
            return Choice(self._drawing.draw(s, rng, allowed))
        reached, bonus = None, None
        if s.position is not None and s.heading is not None:
            reached = s.position + turned(self._way, s.heading)
        if reached is not None and np.isfinite(self.steering.spread_m):
            bonus = -0.5 * np.sum((reached - goal) ** 2, axis=1) / self.steering.spread_m**2
        by_density = self.steering.density and self.model.goal_gaussians is not None
        example = self.model.sample(rng, *known, s.frame.point(goal) if by_density else None, allowed, bonus)
        if reached is None or not self.steering.drift_m:
            return Choice(example)
        leads = reached[int(np.flatnonzero(self.model.examples == example)[0])]
        missing = goal - leads
        share = min(1.0, self.steering.drift_m / max(float(np.linalg.norm(missing)), NEAR))
        return Choice(example, goal=leads + share * missing, goal_s=self.goal_delay)


def displacements(model: FightModel, player: int, actions: IntArray) -> FloatArray:
    """Where actions (S,) lead: the root's way on the floor (S, 2) in the axes of the heading they begin with [m].

    Ways end after the delay of goals, or with the clip.
    """
    graph, stream = model.model.graph, model.stream
    qpos = stream.players[player].qpos
    start = graph.actions.start[actions]
    last = stream.bounds[np.searchsorted(stream.bounds[:, 0], start, side="right") - 1, 1] - 1
    later = np.minimum(start + round(model.model.goal_delay * stream.fps), last)
    return turned(qpos[later, :2] - qpos[start, :2], -yaw(qpos[start, 3:7]))
