"""Pictures of a fight: film strip and time line."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from simprep.duel.fight.fight import Fight
from simprep.duel.stream.stream import DuelStream
from simprep.metrics.interaction.evaluate import FightResults
from simprep.metrics.interaction.run import fight_so_far
from simprep.report.duel.film_strip import save_stream_strip
from simprep.report.fight.moments import strip_captions, strip_frames
from simprep.report.fight.timeline import fight_timeline
from simprep.report.gl import pictures_or_warning

TIMELINE_S = 300.0
"""Longer fights get no time line [s]."""


def draw_fight(
    results: FightResults, folder: str | Path, pictures: int = 12, warn: Callable[[str], None] | None = None
) -> list[Path]:
    """Draw a film strip (of the simulation where there is one) and the time line.

    Args:
        results: what to draw.
        folder: to write to.
        pictures: in the strip.
        warn: called with a sentence where something cannot be drawn here.
    """
    folder, files = Path(folder), []
    stream = results.simulated_stream or results.fight.stream
    shown = results.fight if len(stream) == len(results.fight.stream) else _so_far(results.fight, stream)
    say = warn or (lambda text: None)
    with pictures_or_warning("no film strip", say):
        frames = strip_frames(replace(shown, stream=stream), pictures)
        files.append(save_stream_strip(stream, frames, folder / "strip.png", strip_captions(shown, frames)))
    if results.fight.stream.duration > TIMELINE_S:
        say(f"no time line: the fight is longer than {TIMELINE_S:g} s")
        return files
    falls = [(one.time_s, one.player) for one in results.falls]
    with pictures_or_warning("no time line", say):
        files.append(fight_timeline(results.fight, folder / "timeline.png", results.contacts, falls))
    return files


def _so_far(fight: Fight, stream: DuelStream) -> Fight:
    """The fight cut off where its simulation ended."""
    frames = len(stream)
    table, _ = fight_so_far(fight, frames)
    kept = [one for one in fight.actions if one.start < frames]
    actions = tuple(
        replace(one, end=int(row[2]), moment=one.moment if one.moment < frames else -1) for one, row in zip(kept, table)
    )
    return replace(fight, stream=stream, actions=actions)
