"""`simprep push`: the largest push that a tracked motion survives, by direction."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from simprep.cli import output as output_module
from simprep.cli.library import LibraryFolder
from simprep.cli.output import BaseCommand, Json, Output, Quiet


@dataclass(frozen=True)
class PushCommand(BaseCommand):
    """Find the largest push that a motion tracked by mpc survives, by direction, with its interval over seeds.

    It takes minutes: a bisection for each direction and seed. Writes metrics.json and, where plots can be drawn, push.png.

    Example: simprep push stand --directions 4 --seeds 1 --preset live -o out/push
    """

    motion: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="MOTION", help_behavior_hint="")]
    """A motion of the library (`simprep library list` lists them) or a motion file; a loop is repeated."""

    directions: int = 8
    """How many directions, evenly around the body. 0 degrees points forward, 90 to the left."""

    duration: float = 0.2
    """How long the force acts [s]."""

    segment: str = "pelvis"
    """Segment that is pushed, at its centre of mass; a wrong name lists them."""

    at: Annotated[float | None, tyro.conf.arg(metavar="SECONDS", help_behavior_hint="")] = None
    """Time in the motion at which the push begins [s]; default its middle (3 s of a loop)."""

    seeds: int = 3
    """How many seeds: 0, 1, and so on."""

    preset: Literal["live", "default", "bake"] = "default"
    """How much mpc computes: live least, bake most."""

    largest: float = 800.0
    """The largest force that is tried [N]."""

    tolerance: float = 20.0
    """How near the largest force survived and the least that is not must be [N]."""

    out: Annotated[Path | None, tyro.conf.arg(aliases=("-o",), metavar="DIR", help_behavior_hint="")] = None
    """Folder for the results; default results/push/MOTION."""

    library: LibraryFolder = None
    """Folder of your own clips; default SIMPREP_LIBRARY, where set."""

    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        from simprep.cli.resolve import DEFAULT_LOOP_S, resolve_motion, select
        from simprep.errors import SettingError
        from simprep.physics.mpc import MPC_PRESETS
        from simprep.physics.simulate import SimulationSettings
        from simprep.report.gl import pictures_or_warning
        from simprep.report.push_figure import plot_push_limits
        from simprep.report.results import provenance, save_json
        from simprep.study.push_limits import AFTER_S, PushSettings, push_limits

        for option, count, most in (("--directions", self.directions, 360), ("--seeds", self.seeds, 1000)):
            if not 1 <= count <= most:
                raise SettingError(f"{option} {count}; valid: 1 to {most}")
        motion = resolve_motion(self.motion, output.warn, self.library)
        at = (DEFAULT_LOOP_S if motion.loop else motion.duration) / 2 if self.at is None else self.at
        angles = tuple(360 * k / self.directions for k in range(self.directions))
        wishes = (self.duration, self.segment, self.largest, self.tolerance, tuple(range(self.seeds)))
        settings = PushSettings(at, angles, *wishes)
        # a loop goes on as long as the push needs, within reason
        seconds = min(max(DEFAULT_LOOP_S, at + self.duration + AFTER_S), 600.0) if motion.loop else None
        motion = select(motion, None, seconds, output.warn)
        simulation = SimulationSettings(mpc=MPC_PRESETS[self.preset])
        with output.progress() as bar:
            task = bar.add_task("pushing", total=self.directions * self.seeds)
            tell = lambda what, done: bar.update(task, description=what, completed=done)  # noqa: E731
            limits = push_limits(motion, settings, simulation=simulation, on_progress=tell)
        if any(limits.fell_unpushed):
            seeds = ", ".join(str(seed) for seed, fell in zip(settings.seeds, limits.fell_unpushed) if fell)
            output.warn(f"{motion.name} falls without any push (seed {seeds}); the largest push survived is 0 there")
        if limits.watched_s < AFTER_S - 0.1:
            output.warn(f"{motion.name} ends {limits.watched_s:.2f} s after the push; a later fall is not seen")
        folder, table = self.out or Path("results") / "push" / motion.name, limits.by_direction()
        title = f"{motion.name}: largest push survived, {self.duration:g} s on {self.segment} at {at:.2f} s"
        files = [folder / "metrics.json"]
        with pictures_or_warning("no plot", output.warn):
            files.append(plot_push_limits(table, folder / "push.png", f"{title}, {self.seeds} seeds"))
        content = {
            "schema": "simprep.push/1",
            **provenance(output_module.arguments),
            "motion": motion.name,
            "source": motion.source,
            "preset": self.preset,
            "n": self.seeds,
            "interval": "least to largest of the seeds",
            **asdict(settings),
            **{key: value for key, value in vars(limits).items() if key != "settings"},
            **table,
            "warnings": output.warnings,
            "files": [path.name for path in files],
        }
        save_json(folder / "metrics.json", content)
        output.say(title)
        for direction, force, low, high, more in zip(*table.values()):
            note = "; a seed survived the largest tried" if more else ""
            output.say(f"{direction:6.1f} degrees: {force:.0f} N ({low:.0f} to {high:.0f}){note}")
        output.say(f"written: {', '.join(map(str, files))}")
        return content
