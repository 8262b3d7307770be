"""Training a controller with SARSA in rounds, with a learning curve; it can stop and resume (paper, 6.3 and 6.4)."""

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from simprep.archive import open_archive
from simprep.arrays import FloatArray
from simprep.controller.displacement import DisplacementTable
from simprep.controller.model import QuantisedModel, build_model
from simprep.controller.policy import Policy, settings_from_json, settings_to_json
from simprep.controller.sarsa import Learner, allowed_values, greedy_actions, learn, new_learner
from simprep.controller.settings import ControllerSettings, LearningSettings
from simprep.controller.value_iteration import AT_GOAL, Backup, backup, policy_values
from simprep.errors import SettingError
from simprep.files import atomic_path

SCHEMA = "simprep.training/1"
ROUND = 1_000_000
"""Steps between two looks at the learning curve and the stop rule."""
FIRST_ROUNDS = (20_000, 50_000, 100_000, 200_000, 500_000)
"""Earlier looks at the learning curve, where it is steep."""
_NOT_CONTINUED = ("steps", "stop_share")  # settings that may change when training goes on


@dataclass(frozen=True)
class CurvePoint:
    """One point of the learning curve.

    Attributes:
        steps: training steps so far.
        mean_return: exact return of the greedy policy in the quantised model, mean over all 19 200 states (Fig. 10).
        updated_share: share of the states whose value changed since the last point, for the stop rule.
    """

    steps: int
    mean_return: float
    updated_share: float


@dataclass
class Training:
    """A training under way or finished.

    Attributes:
        settings: the controller.
        learning: how it learns.
        table: measured displacements.
        learner: what it has learned.
        curve: learning curve so far.
        previous: (6, 4, 40, 20) state values at the last point of the curve.
        wall_s: time spent in training steps [s].
    """

    settings: ControllerSettings
    learning: LearningSettings
    table: DisplacementTable
    learner: Learner
    curve: list[CurvePoint]
    previous: FloatArray
    wall_s: float = 0.0

    def finished(self) -> bool:
        """Whether all steps are done, or the stop rule holds."""
        return self.learner.steps >= self.learning.steps or self.settled()

    def settled(self) -> bool:
        """The stop rule: in the last full round, too few states had a value updated."""
        full = len(self.curve) > len(FIRST_ROUNDS) + 1
        return full and self.curve[-1].updated_share < self.learning.stop_share


def start(table: DisplacementTable, settings: ControllerSettings, learning: LearningSettings) -> Training:
    """A training without a step, of displacements from `best.measure`."""
    learner = new_learner(build_model(table, settings), learning)
    return Training(settings, learning, table, learner, [], learner.values.max(axis=-1))


def run(
    training: Training,
    progress: Callable[[int], object] = lambda steps: None,
    checkpoint: Callable[[Training], object] = lambda training: None,
) -> Policy:
    """Train until all steps are done or the stop rule holds; gives the greedy policy. MissingExtraError without numba.

    Args:
        training: goes on where it is; changed.
        progress: receives the steps done, after every round.
        checkpoint: receives the training after every round, to save it.
    """
    from time import perf_counter

    model = build_model(training.table, training.settings)
    exact = backup(model)
    values: FloatArray | None = None
    learn(training.learner, model, training.learning, 0)  # compiles
    while not training.finished():
        steps = min(next_look(training.learner.steps), training.learning.steps) - training.learner.steps
        begin = perf_counter()
        learn(training.learner, model, training.learning, steps)
        training.wall_s += perf_counter() - begin
        values = _look(training, model, exact, values)
        progress(training.learner.steps)
        checkpoint(training)
    return policy_of(training, model)


def next_look(steps: int) -> int:
    """Number of steps at which the learning curve gets its next point."""
    later = [look for look in FIRST_ROUNDS if look > steps]
    return later[0] if later else (steps // ROUND + 1) * ROUND


def policy_of(training: Training, model: QuantisedModel | None = None) -> Policy:
    """The greedy policy of what was learned so far."""
    model = model or build_model(training.table, training.settings)
    origin = {
        "method": "sarsa",
        "steps": training.learner.steps,
        "episodes": training.learner.episodes,
        "settled": training.settled(),
        "learning": asdict(training.learning),
    }
    return Policy(greedy_actions(training.learner, model), training.table, training.settings, origin)


def _look(training: Training, model: QuantisedModel, exact: Backup, guess: FloatArray | None) -> FloatArray:
    """Add a point to the learning curve; gives the values of the policy, a good first guess for the next point."""
    learned = allowed_values(training.learner, model)
    state_values = learned.max(axis=-1)
    change = np.abs(state_values - training.previous)[:, :, AT_GOAL:]
    updated = float((change > training.learning.tolerance / (1 - model.rewards.discount)).mean())
    values = policy_values(exact, np.asarray(learned.argmax(axis=-1), dtype=np.uint8), guess, tolerance=1e-4)
    training.previous = state_values
    training.curve.append(CurvePoint(training.learner.steps, float(values.mean()), updated))
    return values


def save_training(training: Training, path: str | Path) -> Path:
    """Write a training to .npz, atomically, so that it can go on later."""
    learner = training.learner
    header = {
        "schema": SCHEMA,
        "settings": settings_to_json(training.settings),
        "learning": asdict(training.learning),
        "fps": training.table.fps,
        "steps": learner.steps,
        "episodes": learner.episodes,
        "curve": [asdict(point) for point in training.curve],
        "wall_s": training.wall_s,
    }
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        np.savez(
            stream,
            header=np.array(json.dumps(header)),
            displacement=training.table.path,
            values=learner.values,
            updates=learner.updates,
            untried=learner.untried,
            now=learner.now,
            random=learner.random,
            previous=training.previous,
        )
    return Path(path)


def read_training(path: str | Path) -> Training:
    """Read a training written by `save_training`.

    Raises:
        MotionFileError: missing, not a training, or of another schema version.
    """
    with open_archive(path, "training", SCHEMA) as (header, archive):
        arrays = {name: archive[name] for name in ("values", "updates", "untried", "now", "random")}
        learner = Learner(**arrays, steps=header["steps"], episodes=header["episodes"])
        return Training(
            settings=settings_from_json(header["settings"]),
            learning=LearningSettings(**header["learning"]),
            table=DisplacementTable(archive["displacement"], float(header["fps"])),
            learner=learner,
            curve=[CurvePoint(**point) for point in header["curve"]],
            previous=archive["previous"],
            wall_s=header["wall_s"],
        )


def resume(
    path: str | Path, table: DisplacementTable, settings: ControllerSettings, learning: LearningSettings
) -> Training:
    """A saved training, which goes on bit by bit as without the interruption.

    Args:
        path: written by `save_training`.
        table: displacements measured now.
        settings: the controller wanted now.
        learning: how it learns now; the number of steps and the stop rule may differ from those saved.

    Raises:
        MotionFileError: the file cannot be read.
        SettingError: it belongs to other settings.
    """
    training = read_training(path)
    kept = {name: getattr(training.learning, name) for name in _NOT_CONTINUED}
    same = training.settings.rewards == settings.rewards and replace(learning, **kept) == training.learning
    if not same or problem_key(training.table, training.settings) != problem_key(table, settings):
        raise SettingError(f"{path} is the training of another controller; valid: the settings and seed it began with")
    training.learning = learning
    return training


def problem_key(table: DisplacementTable, settings: ControllerSettings) -> str:
    """Hash of all that a policy depends on: displacements, successors, rewards. 16 hexadecimal digits."""
    content = {"fps": table.fps, "safety_m": settings.safety_m, "rewards": asdict(settings.rewards)}
    digest = hashlib.sha256(json.dumps([SCHEMA, content], sort_keys=True).encode())
    digest.update(np.round(table.path, 6).tobytes())
    digest.update(settings.successors().tobytes())
    return digest.hexdigest()[:16]
