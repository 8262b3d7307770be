"""The report of one run, and of one motion."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich.table import Table

from simprep.display import fact_table
from simprep.motion.motion import Motion
from simprep.physics.run import DONE, Run
from simprep.report.figures import body_colour
from simprep.report.motion_figure import plot_motion, plot_run
from simprep.report.page import Page, figure_picture
from simprep.report.replay.actor import Actor, Replay, motion_replay, run_replay

TABLE_ROWS = 14
UNSIMULATED = "Green is the support polygon of the feet in contact, red the centre of mass on the floor."


def run_page(
    run: Run, metrics: Mapping[str, Any], details: Mapping[str, Any] | None = None, warnings: Sequence[str] = ()
) -> Page:
    """A run of one body, or of several with their contacts.

    Args:
        run: what was simulated.
        metrics: numbers by name, see `simprep.metrics.evaluate.evaluate_run`; lists and mappings among them are left out.
        details: how it was made.
        warnings: what was said about it.
    """
    names = " and ".join(body.reference.name for body in run.bodies)
    figures = (
        [(names, run)]
        if len(run.bodies) == 1
        else [(body.reference.name, run.body(number)) for number, body in enumerate(run.bodies)]
    )
    return Page(
        title=f"{names}, tracked with {run.controller}",
        headline=run_headline(run, metrics),
        replays=[run_replay(run)],
        tables=metric_tables(metrics),
        pictures=[figure_picture(f"{name}: reference (dashed) and simulation", plot_run(one)) for name, one in figures],
        details=details or {},
        warnings=warnings,
    )


def run_headline(run: Run, metrics: Mapping[str, Any]) -> str:
    """How a run went, in a sentence or two."""
    who = run.bodies[0].reference.name if len(run.bodies) == 1 else f"{len(run.bodies)} bodies"
    whole = run.bodies[0].reference.duration
    if run.end == DONE:
        text = f"{who} is followed to its end, {run.end_s:.2f} s."
    else:
        text = f"{who} {run.end} at {run.end_s:.2f} of {whole:.2f} s ({run.end_reason})."
    error = metrics.get("mpjpe_mm")
    if isinstance(error, float):
        text += f" Bodies are {error:.0f} mm from the reference on average, relative to the root."
    force, kick = run.assist.force_n, run.assist.kick_mps
    if not force and not kick:
        return f"{text} No external force."
    return f"{text} Largest external force {force:.0f} N" + (f", largest kick {kick:.2f} m/s." if kick else ".")


def motion_page(
    motion: Motion,
    metrics: Mapping[str, Any] | None = None,
    details: Mapping[str, Any] | None = None,
    warnings: Sequence[str] = (),
) -> Page:
    """A motion as it is, not simulated."""
    whole = {"frames": len(motion), "frame rate [1/s]": motion.fps, "body": motion.character.name, **(metrics or {})}
    return Page(
        title=motion.name,
        headline=f"{motion.name}: {motion.duration:.2f} s of {motion.character.name}. Not simulated.",
        replays=[motion_replay(motion)],
        tables=metric_tables(whole),
        pictures=[figure_picture(motion.name, plot_motion(motion))],
        details={"source": motion.source, **(details or {})},
        warnings=warnings,
        legend=UNSIMULATED,
    )


def pair_page(name: str, motions: Sequence[Motion], details: Mapping[str, Any] | None = None) -> Page:
    """Two people or more in one world, not simulated."""
    actors = tuple(Actor(one.name, one, colour=body_colour(number)[1]) for number, one in enumerate(motions))
    duration = max(one.duration for one in motions)
    return Page(
        title=name,
        headline=f"{name}: {len(actors)} people, {duration:.2f} s. Not simulated.",
        replays=[Replay(name, actors)],
        pictures=[figure_picture(one.name, plot_motion(one)) for one in motions],
        details=details or {},
        legend=UNSIMULATED,
    )


def metric_tables(metrics: Mapping[str, Any]) -> list[Table]:
    """Numbers and texts by name, as tables that stand side by side; lists, mappings and None are left out."""
    known = {name: value for name, value in metrics.items() if isinstance(value, bool | int | float | str)}
    names = list(known)
    parts = [names[first : first + TABLE_ROWS] for first in range(0, len(names), TABLE_ROWS)]
    return [fact_table("", {name: known[name] for name in part}, ("metric", "value")) for part in parts]
