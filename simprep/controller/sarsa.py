"""SARSA on the quantised model: what is learned, and running it (paper, sections 6.3 and 6.4)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simprep.arrays import FloatArray, IntArray
from simprep.controller.model import QuantisedModel, choices
from simprep.controller.settings import LearningSettings
from simprep.controller.spaces import ACTIONS, ALPHA_LEVELS, CORE_NODES, GOAL_CELLS, INFLUENCE_CELLS
from simprep.errors import MissingExtraError


@dataclass
class Learner:
    """The state of a training; one that goes on from it gives the same bits as one without an interruption.

    Attributes:
        values: (6, 4, 40, 20, 24) state-action values Q.
        updates: (6, 4, 40, 20, 24) how often each was updated; 0 marks an action that has never been tried.
        untried: (6, 4, 40, 20) number of allowed actions never tried.
        now: (6,) alpha level, core node, goal cell, influence cell, chosen action (-1: new episode), actions in the
            episode.
        random: (1,) state of the random numbers.
        steps: training steps so far.
        episodes: episodes ended so far.
    """

    values: FloatArray
    updates: NDArray[np.uint32]
    untried: NDArray[np.uint8]
    now: IntArray
    random: NDArray[np.uint64]
    steps: int
    episodes: int


@dataclass(frozen=True)
class AllowedActions:
    """Lists of allowed actions (6, 4, 20, 24) by alpha level, core node and influence cell, and their lengths."""

    actions: NDArray[np.uint8]
    count: IntArray


def allowed_actions(model: QuantisedModel) -> AllowedActions:
    """The allowed actions of a model, as lists."""
    may = choices(model)
    order = np.argsort(~may, axis=-1, kind="stable")
    return AllowedActions(order.astype(np.uint8), may.sum(axis=-1))


def new_learner(model: QuantisedModel, settings: LearningSettings) -> Learner:
    """A learner that knows nothing."""
    shape = (ALPHA_LEVELS, CORE_NODES, GOAL_CELLS, INFLUENCE_CELLS)
    count = allowed_actions(model).count.astype(np.uint8)
    return Learner(
        values=np.full((*shape, ACTIONS), model.rewards.arrival_value),
        updates=np.zeros((*shape, ACTIONS), dtype=np.uint32),
        untried=np.repeat(count[:, :, None], GOAL_CELLS, axis=2),
        now=np.array([0, 0, 0, 0, -1, 0]),
        random=np.random.SeedSequence(settings.seed).generate_state(1, np.uint64).astype(np.uint64),
        steps=0,
        episodes=0,
    )


def learn(learner: Learner, model: QuantisedModel, settings: LearningSettings, steps: int) -> None:
    """Run training steps, which change the learner; MissingExtraError if numba is not installed.

    Args:
        learner: goes on where it was.
        model: the world.
        settings: rate, exploration and length of episodes.
        steps: how many.
    """
    allowed = allowed_actions(model)
    episodes = compiled()(
        learner.values,
        learner.updates,
        learner.untried,
        learner.now,
        learner.random,
        model.goal_next,
        model.goal_reward,
        model.influence_next,
        model.shared_next,
        model.shared,
        model.steadiness,
        allowed.actions,
        allowed.count,
        model.rewards.discount,
        model.rewards.arrival_value,
        settings.rate,
        settings.rate_decay,
        settings.explore,
        settings.confidence / (1 - model.rewards.discount),
        settings.longest,
        steps,
    )
    learner.steps += steps
    learner.episodes += int(episodes)


def compiled() -> Callable[..., int]:
    """The training loop, compiled; MissingExtraError if numba is not installed."""
    try:
        from simprep.controller.sarsa_loop import loop
    except ImportError:
        raise MissingExtraError("learning a controller", "learn") from None
    return loop  # type: ignore[no-any-return]


def greedy_actions(learner: Learner, model: QuantisedModel) -> NDArray[np.uint8]:
    """The greedy policy of what was learned, (6, 4, 40, 20)."""
    return np.asarray(allowed_values(learner, model).argmax(axis=-1), dtype=np.uint8)


def allowed_values(learner: Learner, model: QuantisedModel) -> FloatArray:
    """Learned state-action values, -inf where the action is not allowed."""
    return np.where(choices(model)[:, :, None], learner.values, -np.inf)
