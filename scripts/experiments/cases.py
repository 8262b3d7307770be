"""Experiments with the behaviour controller: the same task in three arms, simulated, compared at the launch of the targets.

The arms differ in nothing but preparation: `none` is the plain motion graph (the policy walks to the goal without a source of
influence, level of preparation 0 throughout), `blended` prepares without posture optimisation, `optimised` with it. All enter
a target at its reference posture, since what is compared is launching it now. What varies with the seed is the task
(`Experiment.draw`) and the random numbers of the tracking controller.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np

from experiments.placing import RIGHT, fist_ways, place_gates, place_kick, place_opponent, walked
from experiments.props import STRIKES_S, clearance_m, miss_m
from experiments.setting import Setting, as_thing
from experiments.world import as_arrays, fastest_m_s, simulate_among
from simprep import __version__
from simprep.app.aiming import strike_frame
from simprep.controller.policy import Policy
from simprep.controller.runtime.approach import Approach
from simprep.controller.runtime.performer import RuntimeSettings
from simprep.controller.runtime.task import World
from simprep.controller.runtime.world import library_world
from simprep.files import atomic_path
from simprep.metrics.evaluate import evaluate_motion, evaluate_run
from simprep.motion.edit import cut, move
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.store import read_motion, save_motion
from simprep.report.replay.actor import Prop
from simprep.report.results import save_json
from simprep.scene import Obstacle

ARMS = ("none", "blended", "optimised")
BASELINE = "none"
CASE_SCHEMA = "simprep.experiment_case/2"
LAUNCH_METRICS = (
    "peak_acceleration_rad_s2", "peak_jerk_rad_s3", "peak_rms_acceleration_rad_s2", "peak_torque_nm", "peak_torque_share",
)  # fmt: skip
PEOPLE_S = 12.0
"""How long the motions of the people around the character are [s]."""
BALL_FLIES_M_S = 0.5
"""A ball that gets faster was struck."""
BY_THE_BAR_M = 1.0
"""While the root is so near to a bar, the body's distance from it is measured."""
NTH_FRAME = 8
"""One simulation step of so many is looked at: 60 in a second."""
_SURVIVED_S = 0.5

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Experiment:
    """What an experiment is.

    Attributes:
        name: of its folder.
        title: one line.
        targets: names of the target motions that it needs.
        draw: a task from a generator seeded with the seed, given the target motions by name.
        tail_s: how long the last target is followed after its launch [s].
        people: the others, from time 0 for a duration [s]; built-in motions, nothing simulates them.
        own: target motions that the library does not have, by name.
    """

    name: str
    title: str
    targets: tuple[str, ...]
    draw: Callable[[np.random.Generator, Mapping[str, Motion]], Setting]
    tail_s: float = 2.5
    people: Callable[[Setting, float], tuple[Motion, ...]] | None = None
    own: Mapping[str, Motion] = field(default_factory=dict)


@dataclass(frozen=True)
class Placed:
    """A task, placed by what its target would miss (`experiments.placing`).

    Attributes:
        setting: where it begins now.
        approach: the motion, before physics.
        people: the others, where there are any.
        numbers: how far things were moved, and what is still missed.
    """

    setting: Setting
    approach: Approach
    people: tuple[Motion, ...] = ()
    numbers: Mapping[str, Any] = field(default_factory=dict)


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
    base = library_world([experiment.own.get(name, name) for name in experiment.targets], policy=policy)
    return {
        arm: replace(base, settings=RuntimeSettings(optimise=arm == "optimised"), prepare=arm != BASELINE)
        for arm in ARMS
    }


def make_approach(experiment: Experiment, seed: int, world: World) -> Placed:
    """The motion of one case, before physics, placed so that its targets meet what they are for."""
    setting = experiment.draw(np.random.default_rng(seed), world.targets)
    numbers: Mapping[str, Any] = {}
    if setting.strikes:
        ball = setting.struck(0)
        assert ball is not None
        setting, result, numbers = place_kick(setting, world, ball[1].position)
    elif setting.gates:
        setting, result, numbers = place_gates(setting, world, setting.gates)
    else:
        result = walked(setting, world)
    people = experiment.people(setting, PEOPLE_S) if experiment.people else ()
    for hand, number in setting.blows.values():
        shift = place_opponent(result, people[number], hand)
        there = move(people[number], (float(shift[0]), float(shift[1])))
        people = (*people[:number], there, *people[number + 1 :])
        numbers = {**numbers, "opponent_shift_m": float(np.linalg.norm(shift))}
    return Placed(setting, result, people, numbers)


def run_case(experiment: Experiment, key: CaseKey, world: World, folder: Path) -> dict[str, Any]:
    """Synthesise, simulate and measure one case.

    Returns:
        JSON content: `approach`, and `rows`, one per launch: metrics of the simulated motion around it.
    """
    begun, processor = perf_counter(), process_time()
    placed = make_approach(experiment, key.seed, world)
    setting, result = placed.setting, placed.approach
    motion = result.motion
    fps = motion.fps
    if result.launches:
        end = min(len(motion), result.launches[-1] + round(experiment.tail_s * fps) + 1)
        motion = cut(motion, 0, end)
    run, props = simulate_among(motion, setting.things, key.seed)
    simulated = run.simulated_motion()
    if key.seed == 0:
        _keep(folder, key, motion, simulated, props)
    rows = []
    for number, at in enumerate(result.launches):
        launch_s = at / fps
        measured = evaluate_run(run, launch_s)
        before = evaluate_motion(motion, launch_s)
        row: dict[str, Any] = {
            "target": f"{number + 1}_{setting.tasks[number].target}", "alpha": 1.0, "arm": key.arm, "controller": "mpc",
            "seed": key.seed, "alpha_in_effect": float(result.level[at - 1]),
            **measured, "launch_s": launch_s, "success": run.end_s >= launch_s + _SURVIVED_S, "run_success": measured["success"],
        }  # fmt: skip
        row["before_physics"] = {name: before[name] for name in LAUNCH_METRICS}
        row |= strike_numbers(placed, number, motion, simulated, props, launch_s)
        rows.append(row)
    return {
        "schema": CASE_SCHEMA,
        "simprep": __version__,
        "experiment": experiment.name,
        "seed": key.seed,
        "arm": key.arm,
        "drawn": dict(setting.drawn),
        "placed": dict(placed.numbers),
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
        "whole": {"end": run.end, "survived_s": run.end_s, "wall_s": run.wall_s},
        "rows": rows,
        "wall_s": perf_counter() - begun,
        "processor_s": process_time() - processor,
    }


def strike_numbers(
    placed: Placed, number: int, motion: Motion, simulated: Motion, props: Mapping[str, Prop], launch_s: float
) -> dict[str, Any]:
    """What the target of a launch does to the thing, the person or the gate that it is for.

    Args:
        placed: the case.
        number: of the launch.
        motion: before physics.
        simulated: after it.
        props: things that moved.
        launch_s: of the launch [s].

    Returns:
        `strike_miss_mm` (middle of the sole to the ball's centre) and `miss_mm` (between the surfaces), each with
        `..._before_physics`, `met`, and what else belongs to the thing. Empty where the target is for nothing.
    """
    setting = placed.setting
    out: dict[str, Any] = {}
    if struck := setting.struck(number):
        segment, ball = struck
        out["miss_mm"] = 1000 * miss_m(simulated, segment, ball, launch_s)
        out["miss_before_physics_mm"] = 1000 * miss_m(motion, segment, ball, launch_s)
        strike_s = strike_frame(motion, RIGHT) / motion.fps
        for name, played in (("strike_miss_mm", simulated), ("strike_miss_before_physics_mm", motion)):
            out[name] = 1000 * sole_to(played, ball.position, strike_s)
        out["moment_s"] = strike_s
        out["ball_speed_m_s"] = fastest_m_s(props[ball.name])
        out["met"] = out["miss_mm"] == 0 and out["ball_speed_m_s"] > BALL_FLIES_M_S
    if number in setting.blows:
        hand, whom = setting.blows[number]
        first = round(launch_s * motion.fps)
        after = first + round(STRIKES_S * motion.fps)
        for name, played in (("miss_mm", simulated), ("miss_before_physics_mm", motion)):
            scale = played.fps / motion.fps
            ways = fist_ways(played, placed.people[whom], hand, round(first * scale), round(after * scale))
            out[name] = 1000 * max(0.0, min((way for way, _ in ways), default=np.nan))
        out["moment_s"] = motion.events["impact"] / motion.fps if "impact" in motion.events else launch_s
        out["met"] = out["miss_mm"] == 0
    if setting.gates:
        gate = setting.gates[number]
        x = simulated.qpos[:, 0]
        passed = np.flatnonzero((x > gate.x) & (np.arange(len(x)) >= launch_s * simulated.fps))
        out["moment_s"] = float(passed[0] / simulated.fps) if len(passed) else launch_s + STRIKES_S
        bar = as_thing(setting.things, f"{gate.name}_bar")
        first = round(launch_s * simulated.fps)
        # while it is within a step of the bar; the other targets have their own
        near = np.flatnonzero(np.abs(x - gate.x) < BY_THE_BAR_M)
        near = near[near >= first]
        out["clearance_mm"] = (
            1000 * clearance_m(simulated, bar, int(near[0]), int(near[-1]) + 1, NTH_FRAME) if len(near) else None
        )
        out["passed"] = bool(len(passed))
        out["met"] = bool(len(passed)) and out["clearance_mm"] is not None and out["clearance_mm"] > 0
    return out


def sole_to(motion: Motion, place: Sequence[float], time: float) -> float:
    """Distance of the middle of the right sole to a place at an instant [m]; NaN where the motion is over."""
    frame = round(time * motion.fps)
    if frame >= len(motion):
        return float("nan")
    points = forward_kinematics(motion.qpos[frame : frame + 1], motion.character).foot_points
    return float(np.linalg.norm(points[0, RIGHT].mean(axis=0) - np.asarray(place)))


def kept_motions(folder: Path, arm: str) -> tuple[Motion, Motion] | None:
    """Synthesised and simulated motion of the first seed; None where they were not kept."""
    paths = [folder / "motions" / f"{CaseKey(0, arm).slug}_{kind}.npz" for kind in ("synthesised", "simulated")]
    if not all(path.exists() for path in paths):
        return None
    return read_motion(paths[0]), read_motion(paths[1])


def kept_props(folder: Path, arm: str, things: Sequence[Obstacle]) -> tuple[Prop, ...]:
    """The things that moved in the first seed's simulation; empty where they were not kept."""
    path = folder / "motions" / f"{CaseKey(0, arm).slug}_things.npz"
    if not path.exists():
        return ()
    with np.load(path, allow_pickle=False) as content:
        fps = float(content["fps"])
        names = [name for name in content.files if name != "fps"]
        return tuple(Prop(as_thing(things, n), content[n][:, :3], fps, content[n][:, 3:]) for n in names)


def _keep(folder: Path, key: CaseKey, motion: Motion, simulated: Motion, props: Mapping[str, Prop]) -> None:
    for kind, content in (("synthesised", motion), ("simulated", simulated)):
        save_motion(content, folder / "motions" / f"{key.slug}_{kind}.npz")
    if props:
        fps = next(iter(props.values())).fps
        with atomic_path(folder / "motions" / f"{key.slug}_things.npz") as path, path.open("wb") as file:
            arrays: dict[str, Any] = {"fps": np.array(fps), **as_arrays(props)}
            np.savez_compressed(file, **arrays)


def _known(path: Path, experiment: Experiment, key: CaseKey) -> dict[str, Any] | None:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    wanted = (CASE_SCHEMA, __version__, experiment.name, key.seed, key.arm)
    given = tuple(content.get(name) for name in ("schema", "simprep", "experiment", "seed", "arm"))
    return content if given == wanted else None
