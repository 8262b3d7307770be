"""Does a sweep keep its word? Killed at random moments, with a worker killed on a cluster, timed, and read back.

Example: python scripts/sweep_study.py -o results/sweep

Parts: `kills` (200 cases, killed 20 times with SIGKILL and resumed, against a run that was left alone), `dask` (the same on a
local cluster of which a worker is killed midway), `speed` (the same cases on one and two processes; let nothing else run),
`read` (100 000 records into one table). Writes OUT/sweep.json; exit code 1 if something is not as it must be.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from simprep.report.results import provenance, save_json
from simprep.study.sweep.config import read_sweep
from simprep.study.sweep.engines import Engine, in_processes
from simprep.study.sweep.run import run_sweep
from simprep.study.sweep.store import SweepStore
from simprep.study.sweep.table import read_table
from sweeping.cluster import swept_with_a_killed_worker
from sweeping.trials import CHEAP, Contents, command, contents, killed

READ_S, RECORDS = 10.0, 100_000
SPEEDUP = 1.8
SPEED = """
clips = ["walk", "guard_left_lead", "kick_front", "punch_right", "duck", "jump", "block_high_right", "punch_left"]
seconds = 2.0
seeds = 2
"""
"""Sixteen cases of several seconds each."""


def compared(found: Contents, whole: Contents) -> dict[str, Any]:
    """What is lost, doubled or other against a sweep that was left alone."""
    return {
        "cases": len(whole.results),
        "lost": len(set(whole.results) - set(found.results)),
        "doubled": sum(count > 1 for count in found.lines.values()),
        "different": sum(found.results.get(name) != result for name, result in whole.results.items()),
        "damaged_lines": found.damaged,
    }


def kills(folder: Path, number: int) -> dict[str, Any]:
    config = folder / "cheap.toml"
    config.write_text(CHEAP)
    subprocess.run(command(config, folder / "whole", "--processes", "1"), check=True, stdout=subprocess.DEVNULL)
    out = folder / "killed"
    counts = killed(command(config, out, "--processes", "2"), out, number, np.random.default_rng(number))
    result = compared(contents(out), contents(folder / "whole"))
    good = not (result["lost"] or result["doubled"] or result["different"])
    return {"kills": number, "records_after_each": counts, **result, "holds": good}


def dask(folder: Path, number: int) -> dict[str, Any]:
    del number
    config = folder / "cheap.toml"
    config.write_text(CHEAP)
    if not (folder / "whole").exists():
        subprocess.run(command(config, folder / "whole", "--processes", "1"), check=True, stdout=subprocess.DEVNULL)
    recorded = swept_with_a_killed_worker(config, folder / "dask", after=60)
    result = compared(contents(folder / "dask"), contents(folder / "whole"))
    good = not (result["lost"] or result["doubled"] or result["different"])
    return {"workers": 2, "killed_at_record": recorded, **result, "holds": good}


def speed(folder: Path, number: int) -> dict[str, Any]:
    del number
    config = folder / "speed.toml"
    config.write_text(SPEED)
    cases = list(read_sweep(config).cases())
    engines: dict[str, Engine] = {
        "one_s": partial(in_processes, processes=1, threads=1),
        "two_s": partial(in_processes, processes=2, threads=1),
        "one_with_two_threads_s": partial(in_processes, processes=1, threads=2),
    }
    times = {}
    for name, engine in engines.items():
        begin = time.perf_counter()
        run_sweep(cases, SweepStore(folder / name), engine)
        times[name] = time.perf_counter() - begin
    ratio = times["one_s"] / times["two_s"]
    return {"cases": len(cases), **times, "speedup": ratio, "wanted": SPEEDUP, "holds": ratio >= SPEEDUP}


def read(folder: Path, number: int) -> dict[str, Any]:
    del number
    config = folder / "cheap.toml"
    config.write_text(CHEAP)
    if not (folder / "whole").exists():
        subprocess.run(command(config, folder / "whole", "--processes", "1"), check=True, stdout=subprocess.DEVNULL)
    store = SweepStore(folder / "many")
    known = list(SweepStore(folder / "whole").records())
    with store.writer() as writer:
        for index in range(RECORDS):
            record = {
                key: value for key, value in known[index % len(known)].items() if key not in ("crc32", "id", "attempt")
            }
            writer.append(f"{index:020x}", 0, record)
    begin = time.perf_counter()
    table = read_table(store.folder)
    seconds = time.perf_counter() - begin
    size = sum(path.stat().st_size for path in store.segments())
    holds = table.num_rows == RECORDS and seconds <= READ_S
    return {"records": table.num_rows, "bytes": size, "wall_s": seconds, "wanted_s": READ_S, "holds": holds}


PARTS: dict[str, Callable[[Path, int], dict[str, Any]]] = {"kills": kills, "dask": dask, "speed": speed, "read": read}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("-o", "--out", type=Path, default=Path("results/sweep"))
    options = parser.parse_args()
    path = options.out / "sweep.json"
    before = json.loads(path.read_text()) if path.exists() else {}
    found = {part: before[part] for part in PARTS if part in before}
    with tempfile.TemporaryDirectory() as folder:
        for part in options.only:
            found[part] = PARTS[part](Path(folder), options.kills)
            print(part, json.dumps(found[part]), flush=True)
    save_json(path, {"schema": "simprep.sweep_study/1", **provenance(sys.argv), **found})
    print(f"written: {path}")
    return 0 if all(found[part]["holds"] for part in options.only) else 1


if __name__ == "__main__":
    sys.exit(main())
