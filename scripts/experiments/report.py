"""What an experiment writes: metrics.json with paired differences, film strips, plans; and the command line of its script."""

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from experiments.cases import (
    ARMS,
    LAUNCH_METRICS,
    CaseKey,
    Experiment,
    Placed,
    build_worlds,
    kept_motions,
    kept_props,
    make_approach,
    run_cases,
)
from simprep.controller.runtime.task import Task
from simprep.errors import MissingExtraError, SimprepError
from simprep.metrics.paired import paired_differences
from simprep.motion.motion import Motion
from simprep.report.approach_figure import plot_approach
from simprep.report.approach_page import place_marks
from simprep.report.figures import COLOURS
from simprep.report.film_strip import Row, StripSettings, save_film_strip
from simprep.report.gl import NoGlError
from simprep.report.page import REPORT_FILE, Page, save_page
from simprep.report.replay.actor import Actor, Prop, Replay
from simprep.report.results import provenance, save_json
from simprep.scene import Obstacle, SceneSettings

SCHEMA = "simprep.experiment/2"
BOOTSTRAP_SEED = 2013
WITH_PEOPLE: dict[str, Any] = {
    "width_px": 280,
    "azimuth_deg": 90.0,
    "elevation_deg": -20.0,
    "note": "The opponents (one colour each) are built-in walk and jabs, played along the paths of the sources of influence; no physics, "
    "nothing collides with them. Each picture is as wide as it takes to show everybody.",
}
"""Wider pictures, and what they say, where people are around the character."""
REPLAY_LEGEND = (
    "Solid is what was simulated, pale grey its reference. Red squares on the floor are goals, brown ones sources of influence. The ball is simulated too; bars are fixed. Opponents are shown only; nothing collides "
    "with them."
)
COMPARISONS = (("blended", "none"), ("optimised", "none"), ("optimised", "blended"))
MISSES = (
    "miss_mm", "miss_before_physics_mm", "strike_miss_mm", "strike_miss_before_physics_mm", "ball_speed_m_s", "clearance_mm",
)  # fmt: skip
METRICS = (*LAUNCH_METRICS, "success", "mpjpe_mm", "torque_rms_nm")
LABELS = {"none": "no preparation (plain graph)", "blended": "preparation", "optimised": "preparation + optimisation"}


def summarise(cases: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Medians per arm and paired differences, in physics and before it.

    Args:
        cases: from `run_cases`.

    Returns:
        `arms`: per arm, counts and medians; `paired` and `paired_before_physics`: by comparison, metric: n, median, low, high
        (95 % bootstrap). Launches of one seed are not independent, so where a case has several, intervals are too narrow.
    """
    rows = [row for case in cases for row in case["rows"]]
    arms = {}
    for arm in ARMS:
        own = [case for case in cases if case["arm"] == arm]
        launches = [row for row in rows if row["arm"] == arm]
        good = [row for row in launches if row["success"]]
        arms[arm] = {
            "cases": len(own),
            "reached": sum(bool(case["approach"]["reached"]) for case in own),
            "launches": len(launches),
            "launches_survived": len(good),
            "whole_done": sum(case["whole"].get("end") == "done" for case in own),
            "whole_simulated": sum(bool(case["whole"]) for case in own),
            **{name: _median(good, name) for name in (*LAUNCH_METRICS, "alpha_in_effect", "mpjpe_mm")},
            "met": sum(bool(row["met"]) for row in launches if "met" in row),
            "to_meet": sum("met" in row for row in launches),
            "met_by_target": {
                name: f"{sum(bool(row['met']) for row in launches if row['target'] == name and 'met' in row)}/"
                f"{sum(row['target'] == name for row in launches)}"
                for name in sorted({row["target"] for row in launches})
            },
            **{name: _median(launches, name) for name in MISSES},
            "max_alpha_jump": max((case["approach"]["max_alpha_jump"] for case in own), default=None),
            "duration_s": _median([case["approach"] for case in own], "duration_s"),
        }
    before = [{**row, **row["before_physics"], "success": True} for row in rows]
    return {
        "arms": arms,
        "paired": {f"{a}_minus_{b}": _paired(rows, a, b, METRICS) for a, b in COMPARISONS},
        "paired_before_physics": {f"{a}_minus_{b}": _paired(before, a, b, LAUNCH_METRICS[:3]) for a, b in COMPARISONS},
        "assist": {
            "force_n": max((row["assist_n"] for row in rows), default=0.0),
            "torque_nm": max((row["assist_nm"] for row in rows), default=0.0),
        },
    }


def draw(experiment: Experiment, folder: Path) -> list[Path]:
    """Film strip and plan views of the first seed.

    Args:
        experiment: the experiment.
        folder: its results; holds the motions of the first seed.

    Raises:
        MissingExtraError: matplotlib or pillow is not installed.
        NoGlError: nothing can draw off screen here.
    """
    files = []
    replays: list[Replay] = []
    worlds = build_worlds(experiment)
    rows: list[Row] = []
    marks: dict[str, float] = {}
    things: tuple[Obstacle, ...] = ()
    longest = 0.0
    moments: list[float] = []  # of every arm, so that each shows its targets
    for arm in ARMS:
        placed = make_approach(experiment, 0, worlds[arm])
        setting, result, people = placed.setting, placed.approach, placed.people
        title = f"{experiment.title}: {LABELS[arm]}"
        files.append(plot_approach(result, setting.tasks, folder / f"plan_{arm}.png", title, people))
        motions = kept_motions(folder, arm)
        if motions is None:
            continue
        planned, simulated = motions
        things = (*setting.things, *place_marks(*setting.tasks))
        props = kept_props(folder, arm, setting.things)
        case = json.loads((folder / "cases" / f"{CaseKey(0, arm).slug}.json").read_text(encoding="utf-8"))
        moments += [row["moment_s"] for row in case["rows"] if "moment_s" in row]
        replays.append(_replay(LABELS[arm], placed, simulated, planned, props))
        note = "" if simulated.duration > planned.duration - 0.1 else f"fell at {simulated.duration:.2f} s"
        launched = ", ".join(f"{at / planned.fps:.2f} s" for at in result.launches)
        label = f"{LABELS[arm]}, simulated with mpc; launch at {launched}{_told(case['rows'])}"
        rows.append(Row(label, simulated, note or "ended", people, (*props, *goal_props(setting.tasks))))
        if simulated.duration >= longest:
            longest = simulated.duration
            marks = {f"launch {number + 1}": at / planned.fps for number, at in enumerate(result.launches)}
    if replays:
        page = Page(experiment.title, "Seed 0, simulated with mpc, one arm at a time.", replays, legend=REPLAY_LEGEND)
        files.append(save_page(page, folder / REPORT_FILE))
    if rows:
        even = np.linspace(0.0, longest, int(np.clip(round(longest / 0.7), 7, 13)))
        times = [time for time in even if np.abs(np.array([*moments, np.inf]) - time).min() > 0.25]
        strip = StripSettings(
            times_s=tuple(sorted({*times, *moments})),
            marks=marks,
            scene=SceneSettings(obstacles=things),
            **(WITH_PEOPLE if experiment.people else {"azimuth_deg": 118.0}),
        )
        files.append(save_film_strip(rows, folder / f"strip_{experiment.name}.png", strip))
    return files


def goal_props(tasks: Sequence[Task]) -> tuple[Prop, ...]:
    """Where an arm's own goals and sources of influence are: the scene of a strip is that of all its rows."""
    return tuple(Prop(mark, np.array([mark.position]), 1.0) for mark in place_marks(*tasks))


def _told(rows: Sequence[Mapping[str, Any]]) -> str:
    """What the targets met, for the label of a row, and when."""
    words = []
    for row in rows:
        if "met" in row:
            kind = ("bar cleared", "bar touched or not passed") if "clearance_mm" in row else ("struck", "missed")
            words.append(f"{kind[0] if row['met'] else kind[1]} at {row['moment_s']:.2f} s")
    return "; " + ", ".join(words) if words else ""


def _replay(label: str, placed: Placed, simulated: Motion, planned: Motion, props: Sequence[Prop]) -> Replay:
    """One arm with the things around it."""
    actors = (
        Actor(label, simulated, planned),
        *(Actor("opponent, not simulated", person, colour=COLOURS[3]) for person in placed.people),
    )
    moving = {prop.shape.name for prop in props}
    things = (*placed.setting.things, *place_marks(*placed.setting.tasks))
    still = tuple(thing for thing in things if thing.name not in moving)
    marks = tuple((f"launch {number + 1}", at / planned.fps) for number, at in enumerate(placed.approach.launches))
    return Replay(label, actors, still, tuple(props), marks=marks)


def main(experiment: Experiment, description: str) -> int:
    """The script of an experiment.

    Args:
        experiment: what to run.
        description: the script's docstring.

    Returns:
        Exit code.
    """
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=10, help="how many seeds, from 0 (default 10)")
    parser.add_argument("-o", "--out", type=Path, default=Path("results") / experiment.name)
    parser.add_argument("--fresh", action="store_true", help="run finished cases again")
    parser.add_argument("--no-pictures", action="store_true")
    options = parser.parse_args()
    if options.seeds < 1:
        parser.error(f"--seeds {options.seeds}; valid: 1 or more")

    def progress(what: str, done: int, of: int) -> None:
        print(f"{experiment.name} {done}/{of} {what}", file=sys.stderr, flush=True)

    try:
        cases = run_cases(experiment, options.seeds, options.out, progress, fresh=options.fresh)
        summary = summarise(cases)
        files: list[Path] = []
        if not options.no_pictures:
            try:
                files = draw(experiment, options.out)
            except (MissingExtraError, NoGlError) as problem:
                print(f"pictures are missing: {problem}", file=sys.stderr)
    except SimprepError as error:
        print(error, file=sys.stderr)
        return 2
    content = {
        "schema": SCHEMA,
        **provenance([]),
        "command": " ".join(["python", *sys.argv]),
        "experiment": experiment.name,
        "title": experiment.title,
        "seeds": options.seeds,
        "wall_s": sum(case["wall_s"] for case in cases),
        "processor_s": sum(case["processor_s"] for case in cases),
        **summary,
        "cases": cases,
        "files": [path.name for path in files],
    }
    path = save_json(options.out / "metrics.json", content)
    for table in tables(summary):
        Console(width=150).print(table)
    print(f"written: {path}")
    return 0


def tables(summary: Mapping[str, Any]) -> list[Table]:
    """The summary for people."""
    arms = Table("arm", "reached", "launches survived", "met", *LAUNCH_METRICS[:4], "alpha", title="simulated, medians")
    for arm, numbers in summary["arms"].items():
        arms.add_row(
            LABELS[arm], f"{numbers['reached']}/{numbers['cases']}", f"{numbers['launches_survived']}/{numbers['launches']}",
            f"{numbers['met']}/{numbers['to_meet']}",
            *(_cell(numbers[name]) for name in (*LAUNCH_METRICS[:4], "alpha_in_effect")),
        )  # fmt: skip
    paired = Table("difference", "n", *LAUNCH_METRICS[:4], title="simulated, median of pairs (95 % interval)")
    for name, metrics in summary["paired"].items():
        cells = [_interval(metrics.get(key)) for key in LAUNCH_METRICS[:4]]
        first = metrics.get(LAUNCH_METRICS[0]) or {}
        paired.add_row(name.replace("_", " "), str(first.get("n", 0)), *cells)
    return [arms, paired]


def _paired(rows: Sequence[Mapping[str, Any]], a: str, b: str, metrics: Sequence[str]) -> dict[str, Any]:
    generator = np.random.default_rng(BOOTSTRAP_SEED)
    return paired_differences(rows, a, b, generator, metrics).get("mpc", {})


def _median(rows: Sequence[Mapping[str, Any]], name: str) -> float | None:
    values = [row[name] for row in rows if row.get(name) is not None]
    return float(np.median(values)) if values else None


def _cell(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


def _interval(item: Mapping[str, Any] | None) -> str:
    if not item or item["median"] is None:
        return "-"
    text = f"{item['median']:+.3g}"
    return text if item["low"] is None else f"{text} ({item['low']:+.3g} to {item['high']:+.3g})"
