"""Film strips of the motions that the README shows, one row each: the picture in the README.

`simprep library render` draws all of the library, family by family.

Example: python scripts/draw_library.py -o docs/library.png
"""

import argparse
import sys
from pathlib import Path

from simprep.library import library_motion
from simprep.report.contact_sheet import save_contact_sheet

NAMES = (
    "walk", "walk_turn_left", "guard_left_lead_forward", "jab_left_head", "hook_right_head", "kick_front",
    "roundhouse_right_head", "weave_left", "crawl_hands_knees", "duck", "jump_over_high",
)  # fmt: skip


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--out", type=Path, default=Path("docs/library.png"))
    options = parser.parse_args()
    save_contact_sheet([library_motion(name) for name in NAMES], options.out)
    print(f"written: {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
