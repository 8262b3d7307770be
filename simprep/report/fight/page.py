"""The report of a fight: all fighters simulated, with the fight as synthesised as pale reference, and every contact."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from simprep.duel.fight.hits import BLOCKED, HIT
from simprep.metrics.interaction.evaluate import FightResults
from simprep.report.figures import body_colour
from simprep.report.page import Page, Picture
from simprep.report.replay.actor import Actor, Replay, contact_flashes, run_actor
from simprep.report.run_page import metric_tables


def fight_page(
    results: FightResults, files: Sequence[Path], details: Mapping[str, Any], warnings: Sequence[str] = ()
) -> Page:
    """A fight, simulated or not.

    Args:
        results: the fight and its measurements.
        files: what was drawn; the time line among them is shown.
        details: how it was made.
        warnings: what was said about it.
    """
    fight, run = results.fight, results.run
    headline = f"{fight.mode} fight of {fight.stream.duration:.1f} s with {len(fight.actions)} actions."
    if run is None:
        headline += " Not simulated."
    else:
        hits = sum(one.verdict == HIT for one in results.contacts)
        blocked = sum(one.verdict == BLOCKED for one in results.contacts)
        headline += (
            f" Simulated with {run.controller}: {run.end} at {run.end_s:.2f} s; of {len(results.contacts)} "
            f"contacts {hits} hit what an attack aims at, and {blocked} are blocked. Largest external force {run.assist.force_n:.0f} N."
        )
    flat = {}
    for name, value in results.headline().items():
        parts = value.items() if isinstance(value, Mapping) else [("", value)]
        flat.update({f"{name} {key}".strip(): one for key, one in parts})
    who = ", ".join(f"{body_colour(number)[0]} is {name}" for number, name in enumerate(fight.stream.names))
    return Page(
        title=f"fight, {fight.mode}, seed {fight.seed}",
        headline=headline,
        replays=[fight_replay(results)],
        tables=metric_tables(flat),
        pictures=[
            Picture("actions, distance and contacts over time", path) for path in files if path.stem == "timeline"
        ],
        details=details,
        warnings=warnings,
        legend=f"{who[0].upper()}{who[1:]}, pale grey what the simulation follows. A contact flashes with its impulse; green is the "
        "support polygon, ochre the force of the floor (1 m for 1000 N).",
    )


def fight_replay(results: FightResults) -> Replay:
    """All fighters, simulated where they are."""
    stream = results.fight.stream
    colours = [body_colour(number)[1] for number in range(len(stream.players))]
    if results.run is None:
        actors = tuple(
            Actor(name, motion, colour=colour) for name, motion, colour in zip(stream.names, stream.players, colours)
        )
        return Replay("fight", actors)
    actors = tuple(
        run_actor(results.run.body(number), name, colour)
        for number, (name, colour) in enumerate(zip(stream.names, colours))
    )
    flashes = contact_flashes(results.contacts, [one.verdict for one in results.contacts])
    return Replay("fight", actors, flashes=flashes)
