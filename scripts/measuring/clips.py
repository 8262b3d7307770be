"""Motions for studies of tracking: built-in ones, and captured clips of a folder; and when one counts as tracked."""

import sys
from pathlib import Path

import numpy as np

from simprep.errors import SimprepError
from simprep.library import library_motion
from simprep.motion.edit import cut, repeat
from simprep.motion.load import load_motion
from simprep.motion.motion import Motion

LOOPED_S = 6.0
WALK_S = LONGEST_S = 20.0
FARTHEST_M = 0.5
"""A pelvis that is ever farther from its place on the floor has lost it [m]."""


def looped(motion: Motion, seconds: float) -> Motion:
    """A cyclic motion repeated to at least so many seconds; any other as it is."""
    return repeat(motion, int(np.ceil(seconds / motion.duration - 1e-9))) if motion.loop else motion


def motions(names: list[str], clips: Path | None) -> dict[str, Motion]:
    """Built-in motions of these names, and every motion file in a folder and below, each by what it is called in tables.

    Cyclic ones are repeated (to 3 s, the walk and captured ones longer); captured ones are cut at `LONGEST_S`. A file that is no motion is left
    out, with a word on stderr.

    Raises:
        UnknownNameError: no built-in motion of a name.
    """
    chosen = {f"built-in {name}": looped(library_motion(name), WALK_S if name == "walk" else 3.0) for name in names}
    if clips is not None:
        for file in sorted(path for path in clips.rglob("*") if path.suffix in (".bvh", ".amc", ".txt")):
            try:
                clip = looped(load_motion(file), LOOPED_S)
            except SimprepError as error:  # a text that is no motion
                print(f"left out: {error}", file=sys.stderr)
                continue
            chosen[f"captured {file.stem}"] = cut(clip, 0, min(len(clip), round(LONGEST_S * clip.fps)))
    return chosen
