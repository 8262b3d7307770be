"""`simprep library`: what motions there are, what one is like, pictures of them, captured ones from elsewhere."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from simprep.cli.output import BaseCommand, Json, Output, Quiet

if TYPE_CHECKING:
    from simprep.library.entry import Entry
    from simprep.motion.motion import Motion

ROWS_PER_SHEET = 10

LibraryFolder = Annotated[Path | None, tyro.conf.arg(metavar="DIR", help_behavior_hint="")]
Family = Annotated[str | None, tyro.conf.arg(metavar="FAMILY", help_behavior_hint="")]


@dataclass(frozen=True)
class List(BaseCommand):
    """List the motions of the library: family, name, duration, events. The first call generates them.

    Example: simprep library list --family kick
    """

    family: Family = None
    """Only this family: locomotion, guard, punch, kick, block, dodge, crawl, duck or jump."""

    library: LibraryFolder = None
    """Folder of your own clips; default SIMPREP_LIBRARY, where set."""

    json: bool = False
    """Print one JSON list on stdout; everything else goes to stderr."""

    quiet: Quiet = False

    def _run(self, output: Output) -> list[dict[str, Any]]:
        from rich.table import Table

        from simprep.library.facts import event_times

        table = Table()
        for title in ("family", "name", "duration", "events", "what it is"):
            table.add_column(title, justify="right" if title == "duration" else "left", no_wrap=title == "name")
        content = []
        before = None
        for entry, motion in _load(_chosen(self.library, (), self.family), output):
            events = event_times(motion)
            content.append(
                {
                    "name": entry.name,
                    "family": entry.family,
                    "duration_s": motion.duration,
                    "events": events,
                    "parameters": dict(entry.parameters),
                    "source": motion.source,
                }
            )
            if before not in (None, entry.family):
                table.add_section()
            duration = f"{motion.duration:.2f} s{' loop' if motion.loop else ''}"
            shown = "" if entry.family == before else entry.family
            table.add_row(shown, entry.name, duration, _events(events), entry.summary)
            before = entry.family
        output.say(table)
        output.say(f"{len(content)} motion{'' if len(content) == 1 else 's'}")
        return content


@dataclass(frozen=True)
class Show(BaseCommand):
    """Everything about one motion: parameters, events, contacts, speeds, heights, travel, terms of use.

    Example: simprep library show kick_front
    """

    name: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="NAME", help_behavior_hint="")]
    """A motion of the library; a wrong name lists them."""

    library: LibraryFolder = None
    """Folder of your own clips; default SIMPREP_LIBRARY, where set."""

    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        from dataclasses import asdict

        from simprep.library.facts import motion_facts
        from simprep.library.user import find_entry

        entry = find_entry(self.name, self.library)
        motion = entry.generate()
        facts = motion_facts(motion)
        rows = {
            "family": entry.family,
            "what it is": entry.summary,
            "parameters": _parameters(entry),
            "duration": f"{facts.duration_s:.2f} s, {facts.frames} frames at {facts.fps:g} per second"
            + (", one cycle of a loop" if facts.loop else ""),
            "events": _events(facts.events_s),
            **{f"{side} foot down": _spans(facts.stances_s[side]) for side in ("left", "right")},
            "no foot down": f"{facts.flight_s:.2f} s",
            "peak fist speed": _sides(facts.peak_fist_speed_m_s),
            "peak foot speed": _sides(facts.peak_foot_speed_m_s),
            "COM height": f"{facts.com_height_m[0]:.2f} to {facts.com_height_m[1]:.2f} m",
            "path of the pelvis": f"{facts.path_m:.2f} m; ends {facts.travel_m[0]:.2f} m forward, "
            f"{facts.travel_m[1]:.2f} m left, turned {facts.turn_deg:.0f} deg",
            "source": motion.source,
            "terms of use": entry.terms,
        }
        output.say(_two_columns(entry.name, rows))
        described = {"summary": entry.summary, "parameters": dict(entry.parameters), "terms": entry.terms}
        return {"name": entry.name, "family": entry.family, **described, "source": motion.source, **asdict(facts)}


@dataclass(frozen=True)
class Render(BaseCommand):
    """Draw film strips of motions, a contact sheet per family.

    Example: simprep library render --family punch -o out/library
    """

    names: Annotated[tyro.conf.Positional[tuple[str, ...]], tyro.conf.arg(metavar="NAME", help_behavior_hint="")] = ()
    """Motions to draw; default all."""

    family: Family = None
    """Only this family."""

    out: Annotated[Path, tyro.conf.arg(aliases=("-o",), metavar="DIR")] = Path("results/library")
    """Folder for the pictures."""

    library: LibraryFolder = None
    """Folder of your own clips; default SIMPREP_LIBRARY, where set."""

    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        entries = _chosen(self.library, self.names, self.family)
        from simprep.report.contact_sheet import save_contact_sheet
        from simprep.report.film_strip import pillow
        from simprep.report.gl import find_backend

        pillow()
        find_backend()  # what cannot be drawn is not generated first
        families: dict[str, list[Motion]] = {}
        for entry, motion in _load(entries, output):
            families.setdefault(entry.family, []).append(motion)
        files: list[Path] = []
        try:
            with output.progress() as bar:
                task = bar.add_task("drawing", total=len(entries))
                for family, motions in families.items():
                    for page, first in enumerate(range(0, len(motions), ROWS_PER_SHEET), 1):
                        sheet = motions[first : first + ROWS_PER_SHEET]
                        suffix = f"_{page}" if len(motions) > ROWS_PER_SHEET else ""
                        path = self.out / f"{family}{suffix}.png"
                        bar.update(task, description=f"drawing {path.name}")
                        files.append(save_contact_sheet(sheet, path, lambda done: bar.advance(task)))
        except KeyboardInterrupt:
            raise KeyboardInterrupt(f"{len(files)} finished pictures are kept in {self.out}") from None
        output.say(f"written: {', '.join(map(str, files))}")
        return {"motions": len(entries), "files": files}


@dataclass(frozen=True)
class Fetch(BaseCommand):
    """Download captured motions that make a counterpart to the built-in ones; the folder is then a library.

    What is there already is kept; checksums are written on first use and checked from then on. Needs the extra `fetch`.

    Example: simprep library fetch cmu -o cmu, and then: simprep library list --library cmu
    """

    collection: Annotated[tyro.conf.Positional[Literal["cmu"]], tyro.conf.arg(help_behavior_hint="")]
    """cmu: 30 takes of the CMU Graphics Lab Motion Capture Database (boxing, kicks, jumps, ducking)."""

    out: Annotated[Path, tyro.conf.arg(aliases=("-o",), metavar="DIR")] = Path("cmu")
    """Folder for the clips and their sidecars."""

    url: Annotated[str | None, tyro.conf.arg(metavar="URL", help_behavior_hint="")] = None
    """Another place with the same files; default the collection's own."""

    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        from simprep.library.fetch import fetch, read_recipe

        recipe = read_recipe(self.collection)
        output.say(f"{recipe.title}. Terms of use: {recipe.terms}")
        try:
            with output.progress() as bar:
                task = bar.add_task("fetching", total=len(recipe.files()))
                done = fetch(
                    recipe, self.out, self.url, lambda name, count: bar.update(task, description=name, completed=count)
                )
        except KeyboardInterrupt:
            raise KeyboardInterrupt(f"what came is kept in {self.out}; run again to go on") from None
        output.say(
            f"{len(recipe.takes)} takes in {self.out}: {len(done.downloaded)} files downloaded, {len(done.kept)} were there\n"
            f"to see them: simprep library list --library {self.out}"
        )
        return {
            "out": self.out,
            "takes": [take.name for take in recipe.takes],
            "downloaded": list(done.downloaded),
            "kept": list(done.kept),
            "terms": recipe.terms,
        }


Library = (
    Annotated[List, tyro.conf.subcommand("list")]
    | Annotated[Show, tyro.conf.subcommand("show")]
    | Annotated[Render, tyro.conf.subcommand("render")]
    | Annotated[Fetch, tyro.conf.subcommand("fetch")]
)
DESCRIPTION = """The motions that simprep knows by name: built-in ones and your own clips.

Example: simprep library list"""


def _chosen(folder: Path | None, names: tuple[str, ...], family: str | None) -> "list[Entry]":
    """Entries by name and family, sorted by family; all of them where nothing is asked for."""
    from simprep.errors import SettingError, UnknownNameError
    from simprep.library.entry import FAMILIES
    from simprep.library.user import all_entries, find_entry

    if family is not None and family not in FAMILIES:
        raise UnknownNameError("family", family, FAMILIES)
    entries = [find_entry(name, folder) for name in dict.fromkeys(names)] if names else list(all_entries(folder))
    entries = [entry for entry in entries if family in (None, entry.family)]
    if not entries:
        raise SettingError(f"no motion of family {family!r}" + (f" among {', '.join(names)}" if names else ""))
    return sorted(entries, key=lambda entry: FAMILIES.index(entry.family))


def _load(entries: "list[Entry]", output: Output) -> "list[tuple[Entry, Motion]]":
    loaded = []
    with output.progress() as bar:
        task = bar.add_task("loading", total=len(entries))
        for entry in entries:
            bar.update(task, description=f"loading {entry.name}")
            loaded.append((entry, entry.generate()))
            bar.advance(task)
    return loaded


def _events(events: dict[str, float]) -> str:
    return ", ".join(f"{name} {time:.2f} s" for name, time in events.items())


def _parameters(entry: "Entry") -> str:
    return ", ".join(
        f"{key} {value:g}" if isinstance(value, float) else f"{key} {value}" for key, value in entry.parameters.items()
    )


def _sides(values: dict[str, float]) -> str:
    return ", ".join(f"{side} {value:.1f} m/s" for side, value in values.items())


def _spans(spans: list[tuple[float, float]]) -> str:
    return ", ".join(f"{begin:.2f} to {end:.2f} s" for begin, end in spans) or "never"


def _two_columns(title: str, rows: dict[str, str]) -> Any:
    from rich.table import Table

    table = Table(title=title, show_header=False)
    for what, value in rows.items():
        if value:
            table.add_row(what, value)
    return table
