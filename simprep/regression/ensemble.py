"""Anything that can be checked as numbers by case and seed: runs, motions, mappings, and functions of a seed."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from simprep.errors import SettingError
from simprep.metrics.evaluate import evaluate_motion, evaluate_run
from simprep.motion.motion import Motion
from simprep.physics.run import Run
from simprep.regression.measured import NO_SEED, Case, cases_of, numbers

SEEDS = 10
"""Size of an ensemble where nothing else is said."""

Subject = Run | Motion | Mapping[str, Any]


def measure(subject: Subject) -> dict[str, float | None]:
    """Numbers of a run (`evaluate_run`), of a motion (`evaluate_motion`), or of a mapping by name.

    Raises:
        SettingError: something else, a run of several bodies, or a mapping without numbers.
    """
    if isinstance(subject, Run):
        if len(subject.bodies) != 1:
            raise SettingError(f"a run of {len(subject.bodies)} bodies; valid: run.body(0), or numbers of your own")
        return numbers(evaluate_run(subject))
    if isinstance(subject, Motion):
        return numbers(evaluate_motion(subject))
    if isinstance(subject, Mapping):
        if found := numbers(subject):
            return found
        raise SettingError("a mapping without numbers; valid: names to numbers")
    raise SettingError(
        f"{type(subject).__name__} cannot be checked; valid: a Run, a Motion, a mapping of names to numbers, "
        "or a function of a seed that gives one of them"
    )


def cases_by_seed(
    subject: Subject | Callable[[int], Subject], seeds: Sequence[int] = tuple(range(SEEDS)), name: str = "run"
) -> dict[str, Case]:
    """One case: of a function of a seed, an ensemble over the seeds; of anything else, its numbers.

    Args:
        subject: what to measure.
        seeds: for a function.
        name: of the case.

    Raises:
        SettingError: as `measure`, or no seed, or one twice.
    """
    if isinstance(subject, (Run, Motion, Mapping)) or not callable(subject):
        seed = subject.seed if isinstance(subject, Run) else NO_SEED
        return cases_of([(name, seed, measure(subject))])
    if not seeds or len(set(seeds)) < len(seeds):
        raise SettingError(f"seeds {tuple(seeds)}; valid: at least one, all different")
    return cases_of([(name, seed, measure(subject(seed))) for seed in seeds])
