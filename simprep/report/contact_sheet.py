"""Contact sheets: film strips of many motions under each other, each with its own times."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from simprep.arrays import FloatArray
from simprep.errors import SettingError
from simprep.motion.motion import Motion
from simprep.report.film_strip import Row, Stage, StripSettings, film_strip, save_picture

COLUMNS = 10
PICTURE_PX = (120, 150)
"""Width and height of one picture."""
COLOURS = 128


def picture_times(motion: Motion, columns: int = COLUMNS) -> FloatArray:
    """Evenly spaced instants [s], one of them moved to the impact where there is one.

    Args:
        motion: the motion.
        columns: how many.
    """
    times = np.linspace(0, (len(motion) - 1) / motion.fps, columns)
    if "impact" in motion.events:  # no strike without its impact
        impact = motion.events["impact"] / motion.fps
        times[np.argmin(np.abs(times - impact))] = impact
    return times


def save_contact_sheet(
    motions: Sequence[Motion], path: str | Path, progress: Callable[[int], None] = lambda done: None
) -> Path:
    """Draw a film strip of each motion, one row each, and write them as one PNG, atomically.

    Args:
        motions: at least one.
        path: the PNG file.
        progress: receives the number of motions drawn so far.

    Raises:
        NoGlError: nothing can draw off screen here.
        MissingExtraError: pillow is not installed.
        SettingError: no motions.
    """
    if not motions:
        raise SettingError("a contact sheet of no motions; valid: 1 or more")
    width, height = PICTURE_PX
    layout = StripSettings(columns=COLUMNS, width_px=width, height_px=height)
    strips = []
    with Stage(layout) as stage:
        for number, motion in enumerate(motions, 1):
            row = Row(f"{motion.name}, {motion.duration:.1f} s", motion)
            settings = replace(layout, times_s=tuple(float(time) for time in picture_times(motion)))
            strips.append(film_strip([row], settings, stage))
            progress(number)
    return save_picture(np.concatenate(strips), path, COLOURS)
