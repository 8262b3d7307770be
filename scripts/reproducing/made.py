"""What is in `results/`, and the command that makes each part."""

import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
RESULTS = ROOT / "results"


@dataclass(frozen=True)
class Made:
    """A part of `results/`.

    Attributes:
        name: for `--only`.
        folder: in `results/`.
        command: `simprep` and its arguments, or a script and its arguments; `{out}` is the folder that it writes to, `{data}`
            that of the motion capture.
        file: JSON file whose numbers are compared.
        minutes: rough time on two cores; an upper bound where it was not measured alone.
    """

    name: str
    folder: str
    command: tuple[str, ...]
    file: str
    minutes: float

    @property
    def needs_data(self) -> bool:
        """Whether it needs the motion capture."""
        return any("{data}" in word for word in self.command)

    def arguments(self, out: Path, data: Path | None) -> list[str]:
        """The command line that writes to a folder."""
        words = [word.format(out=out, data=data) for word in self.command]
        program = ["-m", "simprep.cli.main"] if words[0] == "simprep" else [str(ROOT / words[0])]
        return [sys.executable, *program, *words[1:]]

    def shown(self) -> str:
        """The command for people."""
        words = [word.format(out=f"results/{self.folder}", data="DATA") for word in self.command]
        return " ".join(words if words[0] == "simprep" else ["python", *words])


def _experiment(name: str, minutes: float, seeds: int = 10) -> Made:
    words = (f"scripts/experiment_{name}.py", "--seeds", str(seeds), "--fresh", "-o", "{out}")
    return Made(name, name, words, "metrics.json", minutes)


SIX = ("walk", "run", "punch", "kick", "jump", "crawl")
"""Captured clips by which the presets are compared."""
EVERYTHING = (
    Made("reference", "reference", ("simprep", "validate", "--full", "--yardstick", "-o", "{out}", "--quiet"), "metrics.json", 8),
    Made("fight", "fight", ("simprep", "fight", "--seconds", "20", "--seed", "0", "-o", "{out}", "--quiet"), "metrics.json", 2),
    Made("timestep", "timestep", ("scripts/timestep_study.py", "--seeds", "3", "-o", "{out}"), "timestep.json", 15),
    Made("library", "library", ("scripts/tracking_study.py", "--seeds", "3", "-o", "{out}"), "tracking.json", 25),
    Made(
        "robustness", "robustness",
        (
            "scripts/robustness_study.py", "--clips", "{data}", "--seeds", "1", "--conditions", "nominal", "mass -10 %",
            "mass +10 %", "motors -15 %", "friction 0.6", "friction 1.2", "delay 10 ms", "-o", "{out}",
        ), "robustness.json", 30,
    ),
    Made(
        "captured", "captured",
        ("scripts/tracking_study.py", "--motions", "--clips", "{data}", "--seeds", "6", "-o", "{out}"), "tracking.json", 30,
    ),
    Made(
        "presets", "presets",
        (
            "scripts/presets_study.py", *(f"{{data}}/deepmimic/humanoid3d_{name}.txt" for name in SIX), "-o", "{out}",
        ), "presets.json", 15,
    ),
    Made("launch_kicks", "launch_kicks", ("scripts/launch_kick_study.py", "-o", "{out}"), "launch_kicks.json", 60),
    _experiment("ball_kick", 5),
    _experiment("two_opponents", 4),
    _experiment("obstacle_course", 10, seeds=6),
    Made("controller", "controller", ("scripts/controller_study.py", "-o", "{out}"), "study.json", 20),
    Made("learning", "controller", ("scripts/learning_study.py", "--jobs", "2", "-o", "{out}"), "learning.json", 8),
    Made("duel", "duel", ("scripts/duel_study.py", "--seeds", "5", "-o", "{out}"), "study.json", 15),
    Made("fights", "fights", ("scripts/fight_study.py", "--bouts", "10", "--seconds", "60", "-o", "{out}"), "study.json", 15),
    Made(
        "fight_feedback", "fight_feedback",
        (
            "scripts/fight_physics_study.py", "--bouts", "10", "--seconds", "60", "--first-seed", "100", "--arms", "planned",
            "planned_optimised", "feedback", "feedback_optimised", "feedback_through", "-o", "{out}",
        ),
        "fight_physics.json", 120,
    ),
    Made(
        "fight_modes", "fight_modes",
        ("scripts/fight_modes_study.py", "--bouts", "4", "--seconds", "20", "--first-seed", "300", "-o", "{out}"),
        "fight_modes.json", 15,
    ),
    Made("sbu", "sbu", ("scripts/sbu_study.py", "{data}/pairs/sbu_pairs.npz", "-o", "{out}/sbu.json"), "sbu.json", 2),
    Made("optimiser", "optimiser", ("scripts/optimiser_study.py", "-o", "{out}"), "optimiser.json", 5),
    Made(
        "gate", "gate", ("scripts/gate_study.py", "--cases", "walk_fast", "prepared_kick", "-o", "{out}"), "gate.json", 20,
    ),
    Made(
        "identified", "identified",
        ("scripts/identified_study.py", "--controller", "balance", "--seeds", "1", "-o", "{out}"), "identified.json", 4,
    ),
    Made("sweep", "sweep", ("scripts/sweep_study.py", "-o", "{out}"), "sweep.json", 10),
    Made(
        "posture_optimization", "posture_optimization",
        (
            "scripts/study_posture_optimization.py", "--controllers", "pd", "balance", "--processes", "2",
            "--store", "{out}/records", "-o", "{out}",
        ), "summary.json", 20,
    ),
    Made(
        "posture_optimization_mpc", "posture_optimization_mpc",
        (
            "scripts/study_posture_optimization.py", "--controllers", "mpc", "--seeds", "1", "--preset", "live", "--processes", "2",
            "--store", "{out}/records", "-o", "{out}",
        ), "summary.json", 22,
    ),
)  # fmt: skip
"""In the order of the README."""


def chosen(names: Sequence[str]) -> tuple[Made, ...]:
    """The parts of these names; all without any."""
    return tuple(one for one in EVERYTHING if not names or one.name in names)


def data_folder() -> Path | None:
    """Folder of the motion capture, where there is one: `SIMPREP_TEST_DATA`."""
    named = os.environ.get("SIMPREP_TEST_DATA")
    return Path(named) if named and Path(named).is_dir() else None
