"""Sweeps that are killed on purpose, and what is then in their stores."""

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from simprep.study.sweep.store import SweepStore

CHEAP = """
clips = ["walk", "guard_left_lead", "punch_right", "punch_left", "kick_front", "duck", "jump", "block_high_right", "stand", "crawl"]
seconds = 1.0
controllers = ["motion", "pd"]
characters = [{height_m = 1.55}, {height_m = 1.65}, "humanoid", {height_m = 1.85}, {height_m = 1.95}]
disturbances = ["nominal", "push", "weak_motors"]

[disturbance.push]
push_n_per_kg = 3.0
push_at = 0.3
"""
"""200 cases of about a fifth of a second."""


@dataclass
class Contents:
    """What is in a store.

    Attributes:
        results: by the case's name, everything but checksum and cost.
        lines: how often each is there.
        damaged: lines that are not whole.
    """

    results: dict[str, dict[str, Any]] = field(default_factory=dict)
    lines: Counter[str] = field(default_factory=Counter)
    damaged: int = 0


def contents(folder: Path) -> Contents:
    """Read a store."""
    store = SweepStore(folder)
    found = Contents(damaged=sum(store.index().damaged.values()))
    found.lines.update(name for name, _ in store.entries())
    for record in store.records():
        found.results[record["id"]] = {key: value for key, value in record.items() if key not in ("crc32", "cost")}
    return found


def command(config: Path, out: Path, *options: str) -> list[str]:
    """The command line of a sweep."""
    return [sys.executable, "-m", "simprep.cli.main", "sweep", str(config), "-o", str(out), "--quiet", *options]


def killed(arguments: list[str], out: Path, kills: int, rng: np.random.Generator, longest_s: float = 3.0) -> list[int]:
    """Start a sweep again and again, and kill it each time; then run it to its end.

    It is killed a random time after it has started, or after it has recorded its first case. So some die while they begin,
    most while they record.

    Returns:
        Number of records after each kill.

    Args:
        arguments: the command.
        out: folder of its store.
        kills: how often.
        rng: of the times.
        longest_s: longest time until the kill, counted from the start or the first record [s].
    """
    counts = []
    for _ in range(kills):
        before = _size(out)
        process = subprocess.Popen(arguments, start_new_session=True, stdout=subprocess.DEVNULL)
        delay, waits = rng.uniform(0, longest_s), rng.random() < 0.8
        while waits and _size(out) == before and process.poll() is None:
            time.sleep(0.01)
        time.sleep(delay)
        process.send_signal(signal.SIGKILL)
        process.wait()
        _wait_for_orphans(process.pid)
        counts.append(len(SweepStore(out).index().entries))
    subprocess.run(arguments, check=True, stdout=subprocess.DEVNULL)
    return counts


def _wait_for_orphans(session: int, longest_s: float = 20.0) -> None:
    """Return when no process of the killed one's session is left; they end by themselves."""
    end = time.monotonic() + longest_s
    while _in_session(session):
        if time.monotonic() > end:
            raise AssertionError(f"processes {_in_session(session)} outlived the sweep that started them")
        time.sleep(0.05)


def _in_session(session: int) -> list[int]:
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                if os.getsid(int(entry.name)) == session and " Z " not in (entry / "stat").read_text():
                    found.append(int(entry.name))
            except OSError:
                continue
    return found


def _size(out: Path) -> int:
    return sum(path.stat().st_size for path in SweepStore(out).segments())
