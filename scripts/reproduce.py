"""Makes everything in `results/` again, and says what moved.

Example: python scripts/reproduce.py --only reference fight

Every part is made by the command that `--list` shows, into OUT (out/reproduced), beside what is kept. Then the numbers of both are compared:
those that differ by more than --tolerance (a share) are said, metric by metric. Computing times, versions and dates are left
out. A part that is finished is not made again while simprep's code is the same; the same command goes on after a stop. Parts
that need motion capture are left out unless SIMPREP_TEST_DATA names its folder.

Long simulations differ between kinds of processor, so a small change everywhere is expected on another one. Exit code: 0 nothing
moved, 1 something did, 2 a command failed.
"""

import argparse
import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from reproducing.made import EVERYTHING, RESULTS, ROOT, Made, chosen, data_folder
from reproducing.moved import compare, moved_text
from simprep.library.cache import code_key
from simprep.report.results import save_json

STAMP = "reproduced.json"
FOLDERS = (
    "motion", "physics", "library", "preparation", "controller", "duel", "metrics", "check", "study", "robots", "scene.py",
)  # fmt: skip
"""The code that results come from."""


def table() -> Table:
    """What is made, and how."""
    shown = Table("name", "in results/", "rough minutes", "kept since", "command", title="Everything in results/")
    for one in EVERYTHING:
        path = RESULTS / one.folder / one.file
        kept = json.loads(path.read_text()).get("created_utc", "?")[:10] if path.exists() else "not kept"
        shown.add_row(
            one.name, one.folder, f"{one.minutes:g}", kept, one.shown() + (" (DATA needed)" if one.needs_data else "")
        )
    return shown


def make(one: Made, out: Path, data: Path | None, code: str) -> str:
    """Make a part, unless it is finished; returns a word about it.

    Raises:
        subprocess.CalledProcessError: its command failed.
    """
    stamp = out / STAMP
    done: dict[str, Any] = json.loads(stamp.read_text()) if stamp.exists() else {}
    arguments = one.arguments(out, data)
    if (done.get("code"), done.get("arguments")) == (code, arguments[1:]) and (out / one.file).exists():
        return f"made before, in {done['minutes']:.1f} min"
    out.mkdir(parents=True, exist_ok=True)
    begin = time.perf_counter()
    with (out / "log.txt").open("w", encoding="utf-8") as log:
        subprocess.run(arguments, check=True, cwd=ROOT, stdout=log, stderr=subprocess.STDOUT)
    minutes = (time.perf_counter() - begin) / 60
    save_json(stamp, {"code": code, "arguments": arguments[1:], "minutes": minutes})
    return f"made in {minutes:.1f} min"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=[one.name for one in EVERYTHING], default=[], metavar="NAME")
    parser.add_argument("--list", action="store_true", help="show what is made by which command, and stop")
    parser.add_argument("--tolerance", type=float, default=1e-3, help="a smaller relative change is none")
    parser.add_argument("-o", "--out", type=Path, default=Path("out/reproduced"))
    options = parser.parse_args()
    if options.list:
        Console(width=190).print(table())
        return 0
    code, data, worst = code_key(FOLDERS), data_folder(), 0
    report: dict[str, Any] = {}
    for one in chosen(options.only):
        if one.needs_data and data is None:
            print(f"{one.name}: left out; SIMPREP_TEST_DATA names no folder", flush=True)
            continue
        print(f"{one.name}: {one.shown()} (about {one.minutes:g} min)", flush=True)
        out = (options.out / one.name).resolve()
        try:
            word = make(one, out, data, code)
        except subprocess.CalledProcessError as error:
            print(f"{one.name}: failed with exit code {error.returncode}; see {out / 'log.txt'}", flush=True)
            report[one.name], worst = {"failed": error.returncode}, 2
            continue
        except KeyboardInterrupt:
            print(f"interrupted; finished parts are kept in {options.out}; the same command goes on", file=sys.stderr)
            return 130
        kept = RESULTS / one.folder / one.file
        if not kept.exists():
            print(f"{one.name}: {word}; nothing is kept in {kept.parent.relative_to(ROOT)} to compare with", flush=True)
            continue
        found = compare(json.loads(kept.read_text()), json.loads((out / one.file).read_text()), options.tolerance)
        lines = list(moved_text(found))
        print(f"{one.name}: {word}; {len(found.moved)} of {found.values} values moved", flush=True)
        for line in lines:
            print(f"  {line}", flush=True)
        report[one.name] = {"values": found.values, "moved": len(found.moved), "what": lines}
        worst = max(worst, 1 if found.moved else 0)
    print(f"written: {save_json(options.out / 'moved.json', report)}")
    return worst


if __name__ == "__main__":
    sys.exit(main())
