"""`simprep validate`: does preparation help, and does posture optimisation? Simulated, measured, compared."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from simprep.cli import output as output_module
from simprep.cli.library import LibraryFolder
from simprep.cli.output import BaseCommand, Json, Output, Preset, Quiet, Robot

if TYPE_CHECKING:
    from simprep.motion.motion import Motion
    from simprep.study.doses import StabilitySettings
    from simprep.study.plan import StudyPlan

DEFAULT_TARGETS = ("punch_right", "kick_front", "crawl")
ALL_TARGETS = ("punch_left", "punch_right", "kick_front", "crawl", "duck", "jump")
DEFAULT_ALPHAS = (0.5, 1.0)
ALL_ALPHAS = (0.3, 0.5, 0.7, 1.0)


NO_DEFAULT = tyro.conf.arg(help_behavior_hint="")  # the help text says what the default is


@dataclass(frozen=True)
class Validate(BaseCommand):
    """Compare ways of going from locomotion to a target motion, in kinematics and in physics.

    Four arms on the same scenario and seeds: no preparation, traditional blending, preparation without and with posture
    optimisation. Writes metrics.json, the motions, plots, film strips and report.html, a page with a replay that opens from disk.

    Example: simprep validate --locomotion walk --target kick_front --alpha 0.5 1.0 --seeds 3 -o out/kick
    """

    locomotion: str = "walk"
    """Motion of the library or motion file that the character does first."""

    target: Annotated[tuple[str, ...], NO_DEFAULT] = ()
    """Motions of the library or motion files to prepare for; default punch_right, kick_front, crawl."""

    target_frame: Annotated[int | None, tyro.conf.arg(metavar="INT", help_behavior_hint="")] = None
    """First frame of the target movement in the target file, where the file does not say."""

    alpha: Annotated[tuple[float, ...], NO_DEFAULT] = ()
    """Levels of preparation, 0 to 1; default 0.5 and 1."""

    robot: Robot = None

    arms: tuple[Literal["none", "traditional", "blended", "optimised", "dynamic"], ...] = (
        "none",
        "traditional",
        "blended",
        "optimised",
    )
    """Arms to compare; dynamic balances the extrapolated COM, and lets hips and pelvis help (docs/optimiser.md)."""

    controllers: tuple[Literal["pd", "balance", "mpc"], ...] = ("pd", "mpc")
    """Controllers to simulate with."""

    preset: Preset = "default"

    seeds: int = 1
    """Number of seeds, from 0. pd and balance have no random numbers and run once."""

    full: bool = False
    """Six targets of all kinds and levels 0.3, 0.5, 0.7, 1, where not given otherwise."""

    dose: Annotated[
        tuple[Literal["all", "push_launch", "push_stance", "friction", "strength", "noise", "horizon", "samples"], ...],
        NO_DEFAULT,
    ] = ()
    """Also measure how much of these disturbances each case takes (docs/stability.md); default none."""

    dose_directions: int = 4
    """Of the pushes, evenly around the body."""

    dose_halvings: int = 2
    """How often the interval between the last level survived and the first that is not is halved."""

    yardstick: bool = False
    """Measure how long the yardstick takes afterwards (some seconds), for the column cost: computing time that compares
    between machines (docs/tracking.md). Only while nothing else runs here."""

    processes: Annotated[int | None, tyro.conf.arg(metavar="INT", help_behavior_hint="")] = None
    """Cases simulated at a time, each in a process of its own; default one for each core, 8 at most. Changes no result."""

    out: Annotated[Path, tyro.conf.arg(aliases=("-o",), metavar="DIR")] = Path("results/validate")
    """Folder for the results."""

    library: LibraryFolder = None
    """Folder of your own clips; default SIMPREP_LIBRARY, where set."""

    no_pictures: bool = False
    """Draw no plots and no film strips, and write no report page."""

    json: Json = False
    quiet: Quiet = False

    def run(self) -> dict[str, Any]:
        """Run the study, write it, print it; say that it was interrupted where cases are missing."""
        content: dict[str, Any] = super().run()
        if not content["complete"]:
            raise KeyboardInterrupt(f"{len(content['cases'])} finished cases are kept in {self.out}")
        return content

    def _run(self, output: Output) -> dict[str, Any]:
        plan = self._plan(output)  # a bad file fails before the imports
        from simprep.physics.mpc_settings import MPC_PRESETS
        from simprep.physics.settings import SimulationSettings
        from simprep.physics.yardstick import Yardstick
        from simprep.report.page import write_report
        from simprep.report.results import provenance
        from simprep.study.page import study_page
        from simprep.study.pictures import draw_study
        from simprep.study.processes import default_processes
        from simprep.study.store import mark_unfinished, save_study, study_content
        from simprep.study.tables import study_tables
        from simprep.study.validate import run_study

        mark_unfinished(plan, self.out, output_module.arguments)
        motions = self.out / "motions"
        with output.progress() as bar:
            task = bar.add_task("preparing", total=len(plan.cases()))
            settings = SimulationSettings(mpc=MPC_PRESETS[self.preset])
            study = run_study(
                plan,
                lambda what, done: bar.update(task, description=what, completed=done),
                motions,
                settings,
                self.processes or default_processes(),
            )
        if self.yardstick and study.complete:
            study.yardstick_s = Yardstick().processor_seconds()
        files = [*study.files]
        if not self.no_pictures and study.results:
            files += draw_study(study, self.out, output.warn)
            made = provenance(output_module.arguments)
            files += write_report(self.out, lambda: study_page(study, files, made, output.warnings), output.warn)
        save_study(study, self.out, output_module.arguments, files, output.warnings)
        for table in study_tables(study):
            output.say(table)
        output.say(f"{len(study.results)} of {len(plan.cases())} cases in {study.wall_s:.0f} s")
        output.say(f"written: {self.out}: metrics.json and {len(files)} more files")
        return study_content(study)

    def _plan(self, output: Output) -> "StudyPlan":
        from simprep.cli.resolve import resolve_motion
        from simprep.errors import SettingError
        from simprep.study.plan import StudyPlan

        if self.processes is not None and not 1 <= self.processes <= 256:
            raise SettingError(f"--processes {self.processes}; valid: 1 to 256")
        if not 1 <= self.seeds <= 1000:
            raise SettingError(f"--seeds {self.seeds}; valid: 1 to 1000")
        names = self.target or (ALL_TARGETS if self.full else DEFAULT_TARGETS)
        if self.target_frame is not None and len(names) != 1:
            raise SettingError(f"--target-frame with {len(names)} targets; valid: with exactly one --target")
        targets = tuple(self._marked(resolve_motion(name, output.warn, self.library, self.robot)) for name in names)
        return StudyPlan(
            locomotion=resolve_motion(self.locomotion, output.warn, self.library, self.robot),
            targets=targets,
            alphas=self.alpha or (ALL_ALPHAS if self.full else DEFAULT_ALPHAS),
            arms=self.arms,
            controllers=self.controllers,
            seeds=tuple(range(self.seeds)),
            dose=self._dose(),
        )

    def _dose(self) -> "StabilitySettings | None":
        from simprep.errors import SettingError
        from simprep.study.doses import StabilitySettings

        if not self.dose:
            return None
        if not 1 <= self.dose_directions <= 360:
            raise SettingError(f"--dose-directions {self.dose_directions}; valid: 1 to 360")
        return StabilitySettings(
            measures=() if "all" in self.dose else tuple(self.dose),
            directions_deg=tuple(360 * k / self.dose_directions for k in range(self.dose_directions)),
            halvings=self.dose_halvings,
        )

    def _marked(self, target: "Motion") -> "Motion":
        if self.target_frame is None:
            return target
        return replace(target, events={**target.events, "target": self.target_frame})
