"""Experiments with the behaviour controller: the same task in three arms, simulated, compared at the launch of the targets.

The arms differ in nothing but preparation: `none` is the plain motion graph (the policy walks to the goal without a source of
influence, level of preparation 0 throughout), `blended` prepares without posture optimisation, `optimised` with it. All enter
a target at its reference posture, since what is compared is launching it now. What varies with the seed is the task
(`Experiment.draw`) and the random numbers of the tracking controller.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from experiments.props import miss_m
from simprep import __version__
from simprep.controller.policy import Policy
from simprep.controller.runtime.approach import Approach, approach
from simprep.controller.runtime.performer import RuntimeSettings
from simprep.controller.runtime.task import Task, World
from simprep.controller.runtime.world import library_world
from simprep.metrics.evaluate import evaluate_motion, evaluate_run
from simprep.motion.edit import cut
from simprep.motion.motion import Motion
from simprep.motion.store import read_motion, save_motion
from simprep.physics.simulate import track
from simprep.report.results import save_json
from simprep.scene import Obstacle

ARMS = ("none", "blended", "optimised")
BASELINE = "none"
CASE_SCHEMA = "simprep.experiment_case/1"
LAUNCH_METRICS = (
    "peak_acceleration_rad_s2", "peak_jerk_rad_s3", "peak_rms_acceleration_rad_s2", "peak_torque_nm", "peak_torque_share",
)  # fmt: skip
WINDOW_BEFORE_S, WINDOW_AFTER_S = 1.0, 1.2
_SURVIVED_S = 0.5

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Setting:
    """One task drawn from a seed.

    Attributes:
        tasks: what to do.
        place: (x, y [m], heading [rad]) at the beginning.
        frame: of the walk to begin with.
        things: what is drawn in the film strip; nothing collides with it.
        drawn: the numbers drawn, for the record.
        strikes: of a task by its number, the segment that shall strike and the name of the thing that it shall strike.
    """

    tasks: tuple[Task, ...]
    place: tuple[float, float, float] = (0.0, 0.0, 0.0)
    frame: int = 0
    things: tuple[Obstacle, ...] = ()
    drawn: Mapping[str, Any] = field(default_factory=dict)
    strikes: Mapping[int, tuple[str, str]] = field(default_factory=dict)

    def struck(self, number: int) -> tuple[str, Obstacle] | None:
        """The segment that shall strike in a task, and the thing; None where nothing shall be struck."""
        if number not in self.strikes:
            return None
        segment, name = self.strikes[number]
        return segment, next(thing for thing in self.things if thing.name == name)


@dataclass(frozen=True)
class Experiment:
    """What an experiment is.

    Attributes:
        name: of its folder.
        title: one line.
        targets: names of the target motions that it needs.
        draw: a task from a generator seeded with the seed, given the target motions by name.
        windows: False simulates the whole motion; True, for long ones, a window around each launch (1 s before to
            1.2 s after), each begun on the motion itself, and the whole motion only for the first seed.
        tail_s: how long the last target is followed after its launch [s].
        people: the others in the pictures, from time 0 for a duration [s]; drawn only, nothing simulates them.
    """

    name: str
    title: str
    targets: tuple[str, ...]
    draw: Callable[[np.random.Generator, Mapping[str, Motion]], Setting]
    windows: bool = False
    tail_s: float = 2.5
    people: Callable[[Setting, float], tuple[Motion, ...]] | None = None


@dataclass(frozen=True)
class CaseKey:
    """One simulation case."""

    seed: int
    arm: str

    @property
    def slug(self) -> str:
        """Name for files."""
        return f"seed{self.seed:03d}_{self.arm}"


def run_cases(
    experiment: Experiment,
    seeds: int,
    folder: Path,
    progress: Progress | None = None,
    policy: Policy | None = None,
    fresh: bool = False,
) -> list[dict[str, Any]]:
    """Run every case that has no result in the folder yet, and read the others.

    Args:
        experiment: what to run.
        seeds: how many seeds, from 0.
        folder: `cases/` of it receives one JSON file per case, `motions/` the motions of the first seed.
        progress: called with what is done, the number of finished cases, and of all.
        policy: None for the best policy by value iteration.
        fresh: run every case again; results of another version of simprep are never used, but motions, policy and task may
            have changed within one.

    Returns:
        The content of every case, by seed, then arm.
    """
    keys = [CaseKey(seed, arm) for seed in range(seeds) for arm in ARMS]
    worlds: dict[str, World] = {}
    results = []
    for done, key in enumerate(keys):
        if progress:
            progress(key.slug, done, len(keys))
        path = folder / "cases" / f"{key.slug}.json"
        known = None if fresh else _known(path, experiment, key)
        if known is None:
            if not worlds:
                worlds = build_worlds(experiment, policy)
            known = run_case(experiment, key, worlds[key.arm], folder)
            save_json(path, known)
        results.append(known)
    if progress:
        progress("done", len(keys), len(keys))
    return results


def build_worlds(experiment: Experiment, policy: Policy | None = None) -> dict[str, World]:
    """The world of each arm."""
    base = library_world(experiment.targets, policy=policy)
    return {
        arm: World(
            base.cores, base.targets, base.graph, base.policy, base.action_frames,
            RuntimeSettings(optimise=arm == "optimised"), prepare=arm != BASELINE,
        )
        for arm in ARMS
    }  # fmt: skip


def make_approach(experiment: Experiment, seed: int, world: World) -> tuple[Setting, Approach]:
    """The motion of one case, before physics."""
    setting = experiment.draw(np.random.default_rng(seed), world.targets)
    return setting, approach(world, setting.tasks, setting.place, "walk", setting.frame)


def run_case(experiment: Experiment, key: CaseKey, world: World, folder: Path) -> dict[str, Any]:
    """Synthesise, simulate and measure one case.

    Returns:
        JSON content: `approach`, and `rows`, one per launch: metrics of the simulated motion around it.
    """
    begun = perf_counter()
    setting, result = make_approach(experiment, key.seed, world)
    motion = result.motion
    fps = motion.fps
    if result.launches:
        end = min(len(motion), result.launches[-1] + round(experiment.tail_s * fps) + 1)
        motion = cut(motion, 0, end)
    rows = []
    spans = [(0, len(motion), list(range(len(result.launches))))]
    if experiment.windows:
        spans = [
            (max(0, at - round(WINDOW_BEFORE_S * fps)), min(len(motion), at + round(WINDOW_AFTER_S * fps)), [number])
            for number, at in enumerate(result.launches)
        ]
    whole: dict[str, Any] = {}
    for first, after, numbers in spans:
        run = track(cut(motion, first, after), "mpc", key.seed)
        if not experiment.windows:
            whole = {"end": run.end, "survived_s": run.end_s, "wall_s": run.wall_s}
            _keep_motions(folder, key, motion, run.simulated_motion())
        for number in numbers:
            launch_s = (result.launches[number] - first) / fps
            measured = evaluate_run(run, launch_s)
            row: dict[str, Any] = {
                "target": f"{number + 1}_{setting.tasks[number].target}", "alpha": 1.0, "arm": key.arm, "controller": "mpc",
                "seed": key.seed, "alpha_in_effect": float(result.level[result.launches[number] - 1]),
                **measured, "launch_s": launch_s, "success": run.end_s >= launch_s + _SURVIVED_S, "run_success": measured["success"],
            }  # fmt: skip
            before = evaluate_motion(cut(motion, first, after), launch_s)
            row["before_physics"] = {name: before[name] for name in LAUNCH_METRICS}
            if struck := setting.struck(number):
                for where, played in (
                    (row, run.simulated_motion()),
                    (row["before_physics"], cut(motion, first, after)),
                ):
                    where["miss_mm"] = 1000 * miss_m(played, *struck, launch_s)
            rows.append(row)
    if experiment.windows and key.seed == 0:
        run = track(motion, "mpc", key.seed)
        whole = {"end": run.end, "survived_s": run.end_s, "wall_s": run.wall_s}
        _keep_motions(folder, key, motion, run.simulated_motion())
    return {
        "schema": CASE_SCHEMA,
        "simprep": __version__,
        "experiment": experiment.name,
        "seed": key.seed,
        "arm": key.arm,
        "drawn": dict(setting.drawn),
        "approach": {
            "reached": result.reached,
            "time_s": result.time_s,
            "alpha_at_influence": result.alpha_at_influence,
            "max_alpha_jump": result.max_alpha_jump,
            "fps": result.fps,
            "duration_s": motion.duration,
            "launch_s": [at / fps for at in result.launches],
            "launches_wanted": len(setting.tasks),
        },
        "whole": whole,
        "rows": rows,
        "wall_s": perf_counter() - begun,
    }


def kept_motions(folder: Path, arm: str) -> tuple[Motion, Motion] | None:
    """Synthesised and simulated motion of the first seed; None where they were not kept."""
    paths = [folder / "motions" / f"{CaseKey(0, arm).slug}_{kind}.npz" for kind in ("synthesised", "simulated")]
    if not all(path.exists() for path in paths):
        return None
    return read_motion(paths[0]), read_motion(paths[1])


def _keep_motions(folder: Path, key: CaseKey, motion: Motion, simulated: Motion) -> None:
    if key.seed == 0:
        for kind, content in (("synthesised", motion), ("simulated", simulated)):
            save_motion(content, folder / "motions" / f"{key.slug}_{kind}.npz")


def _known(path: Path, experiment: Experiment, key: CaseKey) -> dict[str, Any] | None:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    wanted = (CASE_SCHEMA, __version__, experiment.name, key.seed, key.arm)
    given = tuple(content.get(name) for name in ("schema", "simprep", "experiment", "seed", "arm"))
    return content if given == wanted else None
