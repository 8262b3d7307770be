"""`simprep track`: simulate the humanoid following one motion."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from simprep.cli import output as output_module
from simprep.cli.library import LibraryFolder
from simprep.cli.output import BaseCommand, Json, Output, Preset, Quiet, Robot

HEADLINE = (
    "success",
    "end",
    "fell_at_s",
    "g_mpjpe_mm",
    "mpjpe_mm",
    "foot_slip_ratio",
    "penetration_mm",
    "s_per_s",
    "assist_n",
)
"""Keys of `--json` that other tools rely on."""
DETAILS = ("command", "source", "controller", "preset", "seed", "s_per_s", "created_utc", "versions", "platform")
"""Of the content, what the report page says about how it was made."""


@dataclass(frozen=True)
class Track(BaseCommand):
    """Simulate the humanoid following a motion with joint motors only, and measure how well it does.

    Writes run.npz (states, controls, contacts, torques), metrics.json and, where pictures can be drawn, strip.png and
    report.html, a page with a replay that opens from disk.

    Example: simprep track walk --seconds 10 -o out/walk
    """

    motion: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="MOTION", help_behavior_hint="")]
    """A motion of the library (`simprep library list` lists them) or a motion file (docs/formats.md), or a folder with one
    .npz motion."""

    controller: Literal["mpc", "balance", "pd"] = "mpc"
    """mpc: servo targets corrected by receding-horizon sampling; balance: keeps its balance, looking ahead with a pendulum only; pd: servos to the
    motion, nothing else."""

    preset: Preset = "default"

    robot: Robot = None

    seed: int = 0
    """Seed of the controller's random numbers."""

    mass_scale: float = 1.0
    """Simulate bodies heavier by this factor than the controller believes."""

    friction: Annotated[float | None, tyro.conf.arg(metavar="FLOAT", help_behavior_hint="")] = None
    """Simulate a floor of this sliding friction; the controller believes 1."""

    strength: float = 1.0
    """Simulate motors stronger by this factor than the controller believes."""

    delay_ms: float = 0.0
    """Tell the controller states of this age [ms]; it predicts the present one."""

    noise: float = 0.0
    """Noise of the states that the controller is told; 1: 1 cm, 0.02 rad, 0.1 m/s of the root, 0.01 rad of each joint."""

    kicks: Annotated[int | None, tyro.conf.arg(metavar="SEED", help_behavior_hint="")] = None
    """Kick the root every 1 to 3 s at random, by up to 0.5 m/s and 0.78 rad/s; reported as assist_kick_mps and assist_kick_radps."""

    frames: Annotated[str | None, tyro.conf.arg(metavar="A:B", help_behavior_hint="")] = None
    """Frames a:b of the motion: from a up to but not including b; either may be left out. What is
    beyond the end is left out, with a warning."""

    seconds: Annotated[float | None, tyro.conf.arg(metavar="FLOAT", help_behavior_hint="")] = None
    """Length [s]: a loop is repeated up to it (default 6), any other motion cut."""

    out: Annotated[Path | None, tyro.conf.arg(aliases=("-o",), metavar="DIR", help_behavior_hint="")] = None
    """Folder for the results; default results/track/MOTION_CONTROLLER."""

    library: LibraryFolder = None
    """Folder of your own clips; default SIMPREP_LIBRARY, where set."""

    no_pictures: bool = False
    """Draw no film strip and write no report page."""

    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        from simprep.cli.resolve import resolve_motion, select

        # a bad file fails before the heavier imports
        motion = select(
            resolve_motion(self.motion, output.warn, self.library, self.robot), self.frames, self.seconds, output.warn
        )
        from simprep.errors import SettingError
        from simprep.metrics.evaluate import evaluate_run
        from simprep.physics.mismatch import LONGEST_DELAY_S, Mismatch
        from simprep.physics.mpc_settings import MPC_PRESETS
        from simprep.physics.pushes import random_kicks
        from simprep.physics.settings import SimulationSettings
        from simprep.physics.simulate import track
        from simprep.physics.store import RUN_FILE, save_run
        from simprep.report.page import write_report
        from simprep.report.results import provenance, save_json
        from simprep.report.run_page import run_page

        if not 0 <= self.delay_ms <= 1000 * LONGEST_DELAY_S:
            raise SettingError(f"--delay-ms {self.delay_ms:g}; valid: 0 to {1000 * LONGEST_DELAY_S:g}")
        if self.kicks is not None and self.kicks < 0:
            raise SettingError(f"--kicks {self.kicks}; valid: a seed, 0 or more")
        settings = SimulationSettings(
            mpc=MPC_PRESETS[self.preset],
            kicks=() if self.kicks is None else random_kicks(self.kicks, motion.duration),
            mismatch=Mismatch(self.mass_scale, self.friction, self.strength, self.delay_ms / 1000, self.noise),
        )
        folder = self.out or Path("results") / "track" / f"{motion.name}_{self.controller}"
        with output.simulating(f"{self.controller} {motion.name}", motion) as progress:
            run = track(motion, self.controller, self.seed, settings, progress)
        metrics = evaluate_run(run)
        content = {
            "schema": "simprep.track/1",
            **provenance(output_module.arguments),
            "motion": motion.name,
            "source": motion.source,
            "controller": run.controller,
            "preset": self.preset if self.controller == "mpc" else None,
            "seed": run.seed,
            "timestep_s": run.timestep,
            "end_reason": run.end_reason,
            "processing": run.processing,
            "settings": run.settings,
            "end": run.end,
            "fell_at_s": run.fell_at_s,
            "s_per_s": run.wall_s / run.end_s if run.end_s > 0 else None,
            "assist_n": run.assist.force_n,
            "assist_kick_mps": run.assist.kick_mps,
            "assist_kick_radps": run.assist.kick_radps,
            **metrics,
        }
        files = [save_run(run, folder / RUN_FILE)]
        if not self.no_pictures:
            files += _strip(run, folder, output)
            details = {name: content[name] for name in DETAILS}
            files += write_report(folder, lambda: run_page(run, metrics, details, output.warnings), output.warn)
        files.append(folder / "metrics.json")
        content["warnings"] = output.warnings
        content["files"] = [path.name for path in files]
        save_json(folder / "metrics.json", content)
        output.say(f"{motion.name} with {run.controller}: {run.end} at {run.end_s:.2f} s ({run.end_reason})")
        others = (key for key in content if key not in HEADLINE and isinstance(content[key], float))
        output.say_metrics({key: content[key] for key in (*HEADLINE, *others)})
        output.say(f"written: {', '.join(map(str, files))}")
        return content


def _strip(run: Any, folder: Path, output: Output) -> list[Path]:
    from simprep.report.film_strip import Row, save_film_strip
    from simprep.report.gl import pictures_or_warning

    note = "" if run.end == "done" else f"{run.end} at {run.end_s:.2f} s"
    rows = [Row("reference", run.reference), Row(f"simulated, {run.controller}", run.simulated_motion(), note)]
    with pictures_or_warning("no film strip", output.warn):
        return [save_film_strip(rows, folder / "strip.png")]
    return []
