"""`simprep stability`: how much of each disturbance a tracked motion takes."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from simprep.cli import output as output_module
from simprep.cli.library import LibraryFolder
from simprep.cli.output import BaseCommand, Json, Output, Preset, Quiet, Robot


@dataclass(frozen=True)
class StabilityCommand(BaseCommand):
    """Measure stability by dose: the largest push, lowest friction, weakest motors, largest sensor noise that a motion survives.

    With mpc also the shortest look-ahead and the fewest samples. All levels of a scan are tried, and the first failure is
    narrowed down, with each seed. Writes metrics.json and, where plots can be drawn, stability.png and report.html, a page with a
    replay that opens from disk.

    Example: simprep stability kick_front --controller balance --measures push_launch friction -o out/stability
    """

    motion: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="MOTION", help_behavior_hint="")]
    """A motion of the library (`simprep library list` lists them) or a motion file; a loop is repeated."""

    robot: Robot = None

    controller: Literal["mpc", "balance", "pd"] = "mpc"
    """What drives the motors (docs/balance.md)."""

    measures: Annotated[
        tuple[Literal["push_launch", "push_stance", "friction", "strength", "noise", "horizon", "samples"], ...],
        tyro.conf.arg(help_behavior_hint=""),
    ] = ()
    """What to measure; default all that the controller has."""

    directions: int = 8
    """Of the pushes, evenly around the body."""

    duration: float = 0.2
    """How long a push acts [s]."""

    segment: str = "pelvis"
    """Segment that is pushed, at its centre of mass, by its name or role; a wrong name lists them."""

    halvings: int = 3
    """How often the interval between the last level survived and the first that is not is halved."""

    seeds: int = 3
    """How many seeds: 0, 1, and so on. What has no random numbers is run once."""

    preset: Preset = "default"

    seconds: Annotated[float | None, tyro.conf.arg(metavar="SECONDS", help_behavior_hint="")] = None
    """Length of the motion [s]; default 6 s of a loop, all of anything else."""

    out: Annotated[Path | None, tyro.conf.arg(aliases=("-o",), metavar="DIR", help_behavior_hint="")] = None
    """Folder for the results; default results/stability/MOTION_CONTROLLER."""

    library: LibraryFolder = None
    """Folder of your own clips; default SIMPREP_LIBRARY, where set."""

    no_pictures: bool = False
    """Draw nothing."""

    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        from simprep.cli.resolve import resolve_motion, select
        from simprep.errors import SettingError, UnknownNameError
        from simprep.physics.mpc_settings import MPC_PRESETS
        from simprep.physics.settings import SimulationSettings
        from simprep.report.gl import pictures_or_warning
        from simprep.report.page import write_report
        from simprep.report.results import provenance, save_json
        from simprep.report.stability_figure import plot_stability
        from simprep.study.doses import StabilitySettings, measures_of
        from simprep.study.limit_runs import LimitRuns
        from simprep.study.stability import stability
        from simprep.study.stability_page import stability_page
        from simprep.study.stability_results import content_of, stability_table

        measures_of(self.controller, self.measures)
        if not 1 <= self.seeds <= 1000:
            raise SettingError(f"--seeds {self.seeds}; valid: 1 to 1000")
        if not 1 <= self.directions <= 360:
            raise SettingError(f"--directions {self.directions}; valid: 1 to 360")
        motion = resolve_motion(self.motion, output.warn, self.library, self.robot)
        motion = select(motion, None, self.seconds, output.warn)
        segment = motion.character.roles.get(self.segment, self.segment)
        if segment not in motion.character.segments:
            raise UnknownNameError("segment", segment, motion.character.segments)
        directions = tuple(360 * k / self.directions for k in range(self.directions))
        settings = StabilitySettings(
            self.measures, directions, self.duration, segment, self.halvings, tuple(range(self.seeds))
        )
        runs = LimitRuns()
        with output.progress() as bar:
            task = bar.add_task("stability", total=None)
            result = stability(
                motion,
                settings,
                self.controller,
                SimulationSettings(mpc=MPC_PRESETS[self.preset]),
                lambda what, done, total: bar.update(task, description=what, completed=done, total=total),
                runs.add,
            )
        for name, reason in result.left_out.items():
            output.warn(f"{motion.name}: {name} was not measured: {reason}")
        if result.falls_undisturbed:
            output.warn(
                f"{motion.name} is not completed undisturbed by {self.controller}; such a seed takes no disturbance at all"
            )
        folder = self.out or Path("results") / "stability" / f"{motion.name}_{self.controller}"
        found, files = content_of(result), [folder / "metrics.json"]
        title = f"{motion.name} with {self.controller}: the largest disturbances survived"
        made = provenance(output_module.arguments)
        if not self.no_pictures and result.measured:
            with pictures_or_warning("no plot", output.warn):
                files.append(plot_stability(found["measures"], folder / "stability.png", title))
            files += write_report(
                folder, lambda: stability_page(title, result, settings, runs, files, made, output.warnings), output.warn
            )
        content = {
            "schema": "simprep.stability/1",
            **made,
            "motion": motion.name,
            "source": motion.source,
            "controller": self.controller,
            "preset": self.preset if self.controller == "mpc" else None,
            "settings": asdict(settings),
            **found,
            "warnings": output.warnings,
            "files": [path.name for path in files],
        }
        save_json(folder / "metrics.json", content)
        output.say(title)
        output.say(stability_table(result))
        output.say(f"{result.runs} runs; written: {', '.join(map(str, files))}")
        return content
