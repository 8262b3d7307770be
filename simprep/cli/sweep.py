"""`simprep sweep`: a grid of clips, arms, controllers, bodies and disturbances, on all cores or a cluster."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from simprep.cli import output as output_module
from simprep.cli.output import BaseCommand, Json, Output, Quiet
from simprep.errors import MissingExtraError, SettingError

if TYPE_CHECKING:
    from simprep.report.page import Page
    from simprep.study.sweep.cases import SweepCase
    from simprep.study.sweep.engines import Engine
    from simprep.study.sweep.grid import Sweep
    from simprep.study.sweep.run import Progress
    from simprep.study.sweep.store import SweepStore

LINE_EVERY_S = 30.0
"""How often a line says how far it is where there is no terminal for a bar [s]."""


@dataclass(frozen=True)
class SweepCommand(BaseCommand):
    """Run every combination of clips (or locomotions and targets), arms, levels, controllers, bodies, disturbances and seeds
    that a TOML file names, each once, and keep one record of each.

    Stopped at any moment, the same command goes on; at the end it does nothing. Cases that fall or cannot be read are
    kept with their reason. Writes records-*.jsonl, sweep.json, table.parquet and report.html, a page with a replay that opens from
    disk. docs/sweep.md explains the file.

    Example: simprep sweep kicks.toml --processes 2 -o out/kicks
    """

    config: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="CONFIG", help_behavior_hint="")]
    """TOML file that says what to run."""

    robot: Annotated[str | None, tyro.conf.arg(metavar="NAME|PATH", help_behavior_hint="")] = None
    """Whose motions they become, in place of CONFIG's `characters`: a robot's name (`simprep robot list`) or its .xml or .toml
    file."""

    out: Annotated[Path | None, tyro.conf.arg(aliases=("-o",), metavar="DIR", help_behavior_hint="")] = None
    """Folder for the results; default results/sweep/ and the name of CONFIG."""

    processes: Annotated[int | None, tyro.conf.arg(metavar="N", help_behavior_hint="")] = None
    """How many cases run at once on this machine; default one for each core."""

    scheduler: Annotated[str | None, tyro.conf.arg(metavar="ADDRESS", help_behavior_hint="")] = None
    """Run on the Dask cluster of this scheduler instead, such as tcp://host:8786 (extra `dask`)."""

    plan: bool = False
    """Run a few cases of each kind, where none are recorded, and write what the sweep will take; then stop."""

    clips: Annotated[int, tyro.conf.arg(metavar="N")] = 1_000_000
    """With --plan: how many clips to reckon for as well."""

    retry: bool = False
    """Run cases again that could not be read or ended in an error."""

    no_pictures: bool = False
    """Write no report; it simulates a few cases again."""

    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        if self.processes is not None and self.scheduler:
            raise SettingError("--processes is for this machine, --scheduler for a cluster; valid: one of them")
        if self.processes is not None and not 1 <= self.processes <= 1000:
            raise SettingError(f"--processes {self.processes}; valid: 1 to 1000")
        if self.clips < 1:
            raise SettingError(f"--clips {self.clips}; valid: from 1")
        from simprep.study.sweep.config import body_of, read_sweep
        from simprep.study.sweep.store import SweepStore

        sweep = read_sweep(self.config)
        if self.robot is not None:
            sweep = replace(sweep, bodies=(body_of(self.robot),))
        store = SweepStore(self.out or Path("results") / "sweep" / self.config.stem)
        return self._planned(sweep, store, output) if self.plan else self._swept(sweep, store, output)

    def _swept(self, sweep: "Sweep", store: "SweepStore", output: Output) -> dict[str, Any]:
        cases = list(sweep.cases())
        content = self._record(sweep, len(cases))
        _save(store, {**content, "complete": False})
        progress = self._cases(cases, store, output)
        for line in _notes(progress):
            output.warn(line)
        content |= {"complete": True, "recorded": progress.done, "ends": dict(progress.ends)}
        files = [*store.segments(), _save(store, content)]
        try:
            from simprep.study.sweep.table import save_table

            files.append(
                save_table(store.folder, store.folder / "table.parquet", {one.id for one in cases}.__contains__)
            )
        except MissingExtraError as error:
            output.warn(f"no table.parquet: {error}")
        if not self.no_pictures:
            files += self._report(cases, store, progress, content, output)
        output.say(f"{progress.done} cases, {progress.done - progress.recorded} of them run now: {_ends(progress)}")
        output.say(f"written: {store.folder}: {', '.join(path.name for path in files)}")
        return {**content, "run_now": progress.done - progress.recorded, "files": [str(path) for path in files]}

    def _report(
        self,
        cases: "list[SweepCase]",
        store: "SweepStore",
        progress: "Progress",
        content: Mapping[str, Any],
        output: Output,
    ) -> list[Path]:
        """The page; the one that is there where nothing was run now."""
        from simprep.report.page import REPORT_FILE, write_report
        from simprep.study.sweep.page import sweep_page
        from simprep.study.sweep.replays import sweep_replays

        if progress.done == progress.recorded and (store.folder / REPORT_FILE).is_file():
            return [store.folder / REPORT_FILE]
        order = {one.id: number for number, one in enumerate(cases)}
        records = sorted(store.records(order.__contains__), key=lambda record: order[record["id"]])
        about = {key: content[key] for key in ("command", "created_utc", "versions", "platform")}

        def page() -> "Page":
            return sweep_page(self.config.stem, records, sweep_replays(cases, records), about, output.warnings)

        return write_report(store.folder, page, output.warn)

    def _planned(self, sweep: "Sweep", store: "SweepStore", output: Output) -> dict[str, Any]:
        from dataclasses import asdict

        from rich.text import Text

        from simprep.files import atomic_path
        from simprep.study.sweep.estimate import costs, plan_text, sample

        cases = list(sweep.cases())
        self._cases(sample(cases, store), store, output)
        kinds = costs(cases, store)
        clips = len(sweep.clips) + len(sweep.locomotions) * len(sweep.targets)
        text = plan_text(kinds, clips, self.clips)
        path = store.folder / "plan.md"
        with atomic_path(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
        output.say(Text(text))  # brackets in a str would be markup
        output.say(f"written: {path}; the cases that were measured are kept")
        return {
            **self._record(sweep, len(cases)),
            "clips": clips,
            "kinds": [asdict(one) for one in kinds],
            "files": [str(path)],
        }

    def _cases(self, cases: "list[SweepCase]", store: "SweepStore", output: Output) -> "Progress":
        from simprep.study.sweep.run import run_sweep

        with _told(output) as (tell, last):
            try:
                return run_sweep(cases, store, self._engine(), tell, self.retry)
            except KeyboardInterrupt:
                raise KeyboardInterrupt(
                    f"{last().done} of {last().total} cases are recorded in {store.folder}; the same command goes on"
                ) from None

    def _engine(self) -> "Engine":
        import os

        from simprep.study.sweep.engines import in_processes, in_this_process, on_dask

        if self.scheduler:
            return partial(on_dask, address=self.scheduler)
        processes = self.processes or os.cpu_count() or 1
        return in_this_process if processes == 1 else partial(in_processes, processes=processes)

    def _record(self, sweep: "Sweep", cases: int) -> dict[str, Any]:
        from dataclasses import asdict

        from simprep.report.results import provenance

        return {
            "schema": "simprep.sweep/1",
            **provenance(output_module.arguments),
            "n_cases": cases,
            "sweep": asdict(sweep),
        }


def _save(store: "SweepStore", content: dict[str, Any]) -> Path:
    from simprep.report.results import save_json

    return save_json(store.folder / "sweep.json", content)


def _ends(progress: "Progress") -> str:
    return ", ".join(f"{count} {end}" for end, count in sorted(progress.ends.items())) or "none"


def _notes(progress: "Progress") -> Iterable[str]:
    if progress.damaged:
        yield f"{progress.damaged} records were not whole, as a kill or a full disk leaves them; their cases were run again"
    if progress.others:
        yield f"{progress.others} records in the folder are of another grid or of older code; they are kept and not counted"


@contextmanager
def _told(output: Output) -> "Iterator[tuple[Callable[[Progress], None], Callable[[], Progress]]]":
    """A bar, or now and then a line; gives a function to be told of progress, and one that says what it was told last."""
    from simprep.study.sweep.run import Progress

    last, said = Progress(), monotonic()
    with output.progress() as bar:
        task = bar.add_task("starting", total=None)

        def tell(progress: Progress) -> None:
            nonlocal last, said
            last = progress
            bar.update(task, total=progress.total, completed=progress.done, description=f"{progress.last[:60]:60}")
            if bar.disable and not output.quiet and monotonic() - said > LINE_EVERY_S:
                said = monotonic()
                line = f"{progress.done}/{progress.total} cases: {_ends(progress)}"
                output.progress_console.print(line, markup=False, highlight=False)

        yield tell, lambda: last
