"""`simprep push`: the largest push that a tracked motion survives, by direction."""

from dataclasses import asdict, dataclass
from functools import partial
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from simprep.cli import output as output_module
from simprep.cli.library import LibraryFolder
from simprep.cli.output import BaseCommand, Json, Output, Preset, Quiet, Robot

if TYPE_CHECKING:
    from simprep.motion.motion import Motion


@dataclass(frozen=True)
class PushCommand(BaseCommand):
    """Find the largest push that a motion tracked by mpc survives, by direction, with its interval over seeds.

    It takes minutes: a bisection for each direction and seed. Writes metrics.json and, where plots can be drawn, push.png and
    report.html, a page with a replay that opens from disk.

    Example: simprep push stand --directions 4 --seeds 1 --preset live -o out/push
    """

    motion: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="MOTION", help_behavior_hint="")]
    """A motion of the library (`simprep library list` lists them) or a motion file; a loop is repeated."""

    robot: Robot = None

    directions: int = 8
    """How many directions, evenly around the body. 0 degrees points forward, 90 to the left."""

    direction: Annotated[tuple[float, ...], tyro.conf.arg(metavar="DEGREES", help_behavior_hint="")] = ()
    """Only these directions, instead of --directions."""

    force: Annotated[float | None, tyro.conf.arg(metavar="NEWTON", help_behavior_hint="")] = None
    """Try this force only: its limit is the force itself where it is survived, else 0."""

    duration: float = 0.2
    """How long the force acts [s]."""

    segment: str = "pelvis"
    """Segment that is pushed, at its centre of mass, by its name or role; a wrong name lists them."""

    at: Annotated[float | None, tyro.conf.arg(metavar="SECONDS", help_behavior_hint="")] = None
    """Time in the motion at which the push begins [s]; default its middle (3 s of a loop)."""

    phase: Annotated[float | None, tyro.conf.arg(metavar="SHARE", help_behavior_hint="")] = None
    """Instead of --at: the share of the motion, 0 to 1, at which the push begins; of a loop, in its first cycle after 2 s."""

    seeds: int = 3
    """How many seeds: 0, 1, and so on."""

    preset: Preset = "default"

    largest: float = 1600.0
    """The largest force that is tried [N]."""

    tolerance: float = 20.0
    """How near the largest force survived and the least that is not must be [N]."""

    out: Annotated[Path | None, tyro.conf.arg(aliases=("-o",), metavar="DIR", help_behavior_hint="")] = None
    """Folder for the results; default results/push/MOTION."""

    library: LibraryFolder = None
    """Folder of your own clips; default SIMPREP_LIBRARY, where set."""

    no_pictures: bool = False
    """Draw nothing."""

    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        from simprep.cli.resolve import DEFAULT_LOOP_S, resolve_motion, select
        from simprep.physics.mpc_settings import MPC_PRESETS
        from simprep.physics.settings import SimulationSettings
        from simprep.report.gl import pictures_or_warning
        from simprep.report.page import write_report
        from simprep.report.push_figure import plot_push_limits
        from simprep.report.results import provenance, save_json
        from simprep.study.limit_runs import LimitRuns
        from simprep.study.push_limits import AFTER_S, PushSettings, push_limits
        from simprep.study.push_page import push_page

        motion = resolve_motion(self.motion, output.warn, self.library, self.robot)
        at = self._at(motion, DEFAULT_LOOP_S / 2 if motion.loop else motion.duration / 2)
        segment = motion.character.roles.get(self.segment, self.segment)
        forces = (self.largest, self.tolerance) if self.force is None else (self.force, self.force)
        wishes = (self.duration, segment, *forces, tuple(range(self.seeds)))
        angles = self.direction or tuple(360 * k / self.directions for k in range(self.directions))
        settings = PushSettings(at, angles, *wishes)
        # a loop goes on as long as the push needs, within reason
        seconds = min(max(DEFAULT_LOOP_S, at + self.duration + AFTER_S), 600.0) if motion.loop else None
        motion = select(motion, None, seconds, output.warn)
        runs = LimitRuns()
        with output.progress() as bar:
            task = bar.add_task("without a push", total=len(angles) * self.seeds)
            limits = push_limits(
                motion,
                settings,
                simulation=SimulationSettings(mpc=MPC_PRESETS[self.preset]),
                on_progress=lambda what, done: bar.update(task, description=what, completed=done),
                on_run=runs.add,
            )
        folder, table = self.out or Path("results") / "push" / motion.name, limits.by_direction()
        if fallen := sum(limits.fell_unpushed):
            output.warn(f"{motion.name} falls without any push with {fallen} of {self.seeds} seeds; their largest is 0")
        if any(table["at_least"]):
            output.warn(f"the largest force tried, {settings.largest_n:g} N, was survived; the limit may lie above it")
        if limits.watched_s < AFTER_S - 0.1:
            output.warn(f"{motion.name} ends {limits.watched_s:.2f} s after the push; a later fall is not seen")
        title = f"{motion.name}: largest push survived, {self.duration:g} s on {self.segment} at {at:.2f} s"
        files = [folder / "metrics.json"]
        made = provenance(output_module.arguments)
        if not self.no_pictures:
            with pictures_or_warning("no plot", output.warn):
                files.append(plot_push_limits(table, folder / "push.png", f"{title}; seeds: {self.seeds}"))
            page = partial(push_page, title, limits, runs, files, made, output.warnings)
            files += write_report(folder, page, output.warn)
        content = {
            "schema": "simprep.push/1",
            **made,
            "motion": motion.name,
            "preset": self.preset,
            "n": self.seeds,
            **asdict(settings),
            "force_n": limits.force_n,
            "fell_unpushed": limits.fell_unpushed,
            "watched_s": limits.watched_s,
            "assist_n": limits.assist_n,
            **table,
            "warnings": output.warnings,
            "files": [path.name for path in files],
        }
        save_json(folder / "metrics.json", content)
        output.say(title)
        rows = zip(*table.values())
        output.say_metrics({f"{a:g} degrees [N]": f"{m:.0f} ({low:.0f} to {high:.0f})" for a, m, low, high, _ in rows})
        output.say(f"written: {', '.join(map(str, files))}")
        return content

    def _at(self, motion: "Motion", middle: float) -> float:
        """When the push begins [s]."""
        from simprep.errors import SettingError

        if self.phase is None:
            return middle if self.at is None else self.at
        if self.at is not None:
            raise SettingError("--at and --phase both say when the push begins; valid: one of them")
        if not 0 <= self.phase <= 1:
            raise SettingError(f"--phase {self.phase}; valid: 0 to 1, a share of the motion")
        begin = ceil(2.0 / motion.duration) * motion.duration if motion.loop else 0.0
        return begin + self.phase * motion.duration
