"""The report of an approach: synthesised and simulated side by side, with goal and sources of influence on the floor."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from simprep.controller.runtime.approach import Approach
from simprep.controller.runtime.task import Task
from simprep.display import fact_table
from simprep.physics.run import Run
from simprep.report.page import Page, Picture
from simprep.report.replay.actor import Actor, Replay, event_marks, run_actor
from simprep.report.run_page import metric_tables
from simprep.scene import Obstacle

MARK_M = 0.12
"""Half the edge of a goal's mark on the floor [m]; that of a source of influence is half of it."""


def approach_page(
    result: Approach,
    task: Task,
    simulated: tuple[Run, Mapping[str, Any]] | None,
    files: Sequence[Path],
    details: Mapping[str, Any],
    warnings: Sequence[str] = (),
) -> Page:
    """An approach, simulated or not.

    Args:
        result: what the controller did.
        task: what it was asked to do.
        simulated: the run and its metrics; None without.
        files: what was drawn; the plan view among them is shown.
        details: how it was made.
        warnings: what was said about it.
    """
    motion = result.motion
    actor = Actor("synthesised, not simulated", motion) if simulated is None else run_actor(simulated[0])
    where = "The goal is not reached" if result.time_s is None else f"The goal is reached after {result.time_s:.2f} s"
    sentence = f"{where}, with {len(result.actions)} actions; {task.target} is launched {len(result.launches)} time(s)."
    facts: dict[str, Any] = {
        "reached": result.reached,
        "time_s": result.time_s,
        "alpha_at_influence": result.alpha_at_influence,
        "max_alpha_jump": result.max_alpha_jump,
        "fps": result.fps,
    }
    tables = [fact_table("Approach", facts, ("", "value"))]
    if simulated is not None:
        run, metrics = simulated
        sentence += f" Simulated with {run.controller}: {run.end} at {run.end_s:.2f} of {motion.duration:.2f} s."
        tables += metric_tables(metrics)
    return Page(
        title=f"approach to {task.goal[0]:g}, {task.goal[1]:g} m, then {task.target}",
        headline=sentence,
        replays=[Replay("approach", (actor,), place_marks(task), marks=event_marks(motion))],
        tables=tables,
        pictures=[Picture("seen from above, and over time", path) for path in files if path.name == "plan.png"],
        details=details,
        warnings=warnings,
    )


def place_marks(*tasks: Task) -> tuple[Obstacle, ...]:
    """Goals and sources of influence as flat squares on the floor, to be drawn only; those of later tasks have a number.

    What moves has no mark, and who is met on the way is no place.
    """
    places: list[tuple[str, float, float, float]] = []
    for number, task in enumerate(tasks):
        own = f" of task {number + 1}" if number else ""
        still = [one for one in task.influences if not any(one.velocity)]
        places += [] if task.meet else [(f"goal{own}", *task.goal, MARK_M)]
        places += [(f"influence {n}{own}", *one.position, MARK_M / 2) for n, one in enumerate(still)]
    return tuple(
        Obstacle(name, (x, y, 0.004), (half, half, 0.004), soft=name.startswith("goal")) for name, x, y, half in places
    )
