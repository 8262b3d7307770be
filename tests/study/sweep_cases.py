"""A sweep of twelve cheap cases, two of which cannot be read."""

from pathlib import Path

from simprep.study.sweep.config import sweep_of
from simprep.study.sweep.grid import Sweep

CHEAP = """
clips = ["walk", "punch_right", "broken.bvh"]
seconds = 0.4
controllers = ["motion", "pd"]
characters = ["humanoid", {height_m = 1.6}]
"""


def write_cheap(folder: Path) -> Path:
    """The sweep as a file, with its broken clip beside it."""
    (folder / "broken.bvh").write_text("HIERARCHY\nROOT Hips\n{\n")
    config = folder / "cheap.toml"
    config.write_text(CHEAP)
    return config


def small(**changes: object) -> Sweep:
    """A sweep whose cases are never run."""
    content = {
        "locomotions": ["walk"],
        "targets": ["punch_right", "kick_front"],
        "controllers": ["motion", "pd", "mpc"],
    }
    return sweep_of({**content, **changes})
