"""Run what a store lacks of a sweep. Stopped at any moment and called again, it goes on; called again at the end, it does nothing."""

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from simprep.study.sweep.cases import SweepCase
from simprep.study.sweep.engines import Engine
from simprep.study.sweep.measure import BAD_INPUT, ERROR
from simprep.study.sweep.store import SweepStore

RETRIED = (BAD_INPUT, ERROR)
"""Ends that another try may change: a file was missing, a process died. A fall stays a fall."""


@dataclass
class Progress:
    """How far a sweep is.

    Attributes:
        total: cases of the sweep.
        recorded: those that were in the store before.
        ends: how many cases ended how, of all that are recorded now.
        others: records in the store that are not of this sweep: of another grid, or of older code.
        damaged: lines of the store that were not whole.
        last: the case that was recorded last, in words.
    """

    total: int = 0
    recorded: int = 0
    ends: Counter[str] = field(default_factory=Counter)
    others: int = 0
    damaged: int = 0
    last: str = ""

    @property
    def done(self) -> int:
        """Cases that are recorded now."""
        return sum(self.ends.values())


def run_sweep(
    cases: Iterable[SweepCase],
    store: SweepStore,
    engine: Engine,
    tell: Callable[[Progress], None] = lambda progress: None,
    retry: bool = False,
) -> Progress:
    """Run every case that is not in the store, and record each as it finishes.

    Args:
        cases: of the sweep; one that comes twice is run once.
        store: where the records are.
        engine: where to run (`simprep.study.sweep.engines`).
        tell: called at the beginning and after every case.
        retry: run cases again that ended in `bad_input` or `error`.

    Raises:
        SettingError: another process is writing to the store.
    """
    wanted = {case.id: case for case in cases}
    with store.writer() as writer:
        index = store.index()
        attempts = dict.fromkeys(wanted, 0)
        progress = Progress(total=len(wanted), damaged=sum(index.damaged.values()))
        for name, entry in index.entries.items():
            if name not in wanted:
                progress.others += 1
            elif retry and entry.end in RETRIED:
                attempts[name] = entry.attempt + 1
            else:
                progress.recorded += 1
                progress.ends[entry.end] += 1
                del attempts[name]
        tell(progress)
        running = engine(wanted[name] for name in list(attempts))
        try:
            for case, content in running:
                writer.append(case.id, attempts[case.id], {**content, "case": case.definition})
                progress.ends[content["end"]] += 1
                progress.last = case.label
                tell(progress)
        finally:
            if hasattr(running, "close"):
                running.close()  # a generator: its processes end now, not some time later
    return progress
