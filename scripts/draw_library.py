"""Film strips of the built-in motions, one row each: the picture in the README.

Example: python scripts/draw_library.py -o docs/library.png
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from simprep.files import atomic_path
from simprep.library import library_motion, library_names
from simprep.report.film_strip import Row, StripSettings, film_strip

COLUMNS = 10


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--out", type=Path, default=Path("docs/library.png"))
    options = parser.parse_args()
    from PIL import Image

    names = [name for name in library_names() if name != "stand"]
    strips = []
    for name in names:
        motion = library_motion(name)
        row = Row(f"{name}, {motion.duration:.1f} s", motion)
        times = np.linspace(0, (len(motion) - 1) / motion.fps, COLUMNS)
        if "impact" in motion.events:  # no strike without its impact
            impact = motion.events["impact"] / motion.fps
            times[np.argmin(np.abs(times - impact))] = impact
        settings = StripSettings(columns=COLUMNS, width_px=120, height_px=150, times_s=tuple(times))
        strips.append(film_strip([row], settings))
    picture = Image.fromarray(np.concatenate(strips))
    with atomic_path(options.out) as path:
        picture.quantize(128).save(path, format="PNG", optimize=True)
    print(f"written: {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
