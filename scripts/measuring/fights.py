"""What studies of fights share: a model that has learned from a part of a stream, the truth, and what counts as an answer."""

from dataclasses import dataclass

import numpy as np

from simprep.arrays import FloatArray, IntArray
from simprep.duel.analysis import analyse, match_actions
from simprep.duel.fight.alertness import Alertness
from simprep.duel.fight.avatar import displacements
from simprep.duel.fight.default_model import model_analysis
from simprep.duel.fight.example_motions import ExampleMotions
from simprep.duel.fight.fight import Fight
from simprep.duel.labels.labels import ASPECTS, QUALIFIERS, decode
from simprep.duel.model.fight_model import FightModel
from simprep.duel.model.held_out import learn_before, split_frame
from simprep.duel.model.structures import REQUESTS
from simprep.duel.synthetic.kinds import KIND_OF, attacks, context_of
from simprep.duel.synthetic.make import make_synthetic
from simprep.duel.synthetic.presets import preset
from simprep.duel.synthetic.truth import Truth

ANSWERED_FAST_S = 0.5
ATTACKS_ASKED_FOR = tuple(one for one in REQUESTS if one != "jump")
"""What studies ask an avatar for; a jump is no attack, so the truth has no answer to it."""
REACT = {name: QUALIFIERS["react"].index(name) for name in ("kick", "punch")}


@dataclass(frozen=True)
class Setup:
    """What all parts of the study need: a model of two thirds of the stream, and the truth."""

    model: FightModel
    examples: ExampleMotions
    truth: Truth
    match: IntArray
    alertness: Alertness

    @property
    def table(self) -> IntArray:
        """(A, 4) of B."""
        actions = self.model.model.graph.actions
        return np.stack([actions.player, actions.start, actions.end, actions.clip], axis=1)

    def true_kind(self, example: int) -> str:
        """Kind of an action in the truth; empty where it is cut otherwise."""
        if example < 0 or self.match[example] < 0:
            return ""
        return KIND_OF[tuple(int(one) for one in self.truth.qualifiers[self.match[example]])]


def set_up(name: str, seed: int) -> Setup:
    """Make the stream, analyse it, learn from two thirds."""
    example = make_synthetic(preset(name), seed)
    found = analyse(example.stream, np.random.default_rng(seed), truth=example.truth, settings=model_analysis())
    whole = FightModel(found.model, example.stream)
    model = learn_before(whole, split_frame(whole))
    alertness = Alertness.of(model.model.graph, model.stream.fps, model.learned_until)
    assert alertness is not None
    table = found.labels.table
    match = match_actions(table, example.truth.table, 0.05 * model.stream.fps)
    return Setup(model, ExampleMotions.of(model.stream, model.model), example.truth, match, alertness)


def answered(setup: Setup, fight: Fight, attacker: int) -> tuple[int, int, int, int, int]:
    """Attacks of one fighter; of these answered by what the truth counts as fitting (`Truth.fitting`: begun while the attack was
    under way, a defence or an own attack) with the attack's `react`; with any; the first and within 0.5 s; attacks that
    the truth cuts otherwise, which are not judged."""
    count = strict = loose = fast = unknown = 0
    for one in fight.of(attacker):
        kind = setup.true_kind(one.example)
        if not kind or one.end >= len(fight.stream):
            unknown += not kind
            continue
        if not attacks(kind):
            continue
        count += 1
        found = {"strict": False, "loose": False, "fast": False}
        for other in fight.of(1 - attacker):
            answer = setup.true_kind(other.example)
            if not one.start < other.start <= one.end or not (answer == "neutral" or (answer and attacks(answer))):
                continue
            found["loose"] = True
            react = int(decode([setup.truth.codes[setup.match[other.example]]])[0, ASPECTS.index("react")])
            if react == REACT[context_of(kind)]:
                found["strict"] = True
                found["fast"] |= other.start - one.start <= ANSWERED_FAST_S * setup.model.model.fps
        strict, loose, fast = strict + found["strict"], loose + found["loose"], fast + found["fast"]
    return count, strict, loose, fast, unknown


def reach_of(setup: Setup) -> float:
    """How far the root gets within the delay of goals: 90th percentile of the learned examples of player 0 [m]."""
    return float(np.percentile(np.linalg.norm(ways(setup), axis=1), 90))


def ways(setup: Setup) -> FloatArray:
    """(S, 2) ways of the learned examples of player 0 [m]."""
    return displacements(setup.model, 0, setup.model.model.players[0].examples)
