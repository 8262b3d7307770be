"""The yardstick: how long a frozen model takes, so that costs compare between machines."""

from collections.abc import Callable
from pathlib import Path
from time import perf_counter, process_time

import mujoco
import numpy as np
from mujoco.batch import Batch

from simprep.arrays import FloatArray

YARDSTICK = Path(__file__).parent / "yardstick.xml"
YARDSTICK_STEPS, YARDSTICK_BATCH, YARDSTICK_THREADS = 100_000, 28, 2
YARDSTICK_ROLLOUT = 60
"""Steps from standing until the batch begins again [1]: half a second, the planner's look-ahead."""


def best_rate(work: Callable[[], float], repeats: int = 3, clock: Callable[[], float] = perf_counter) -> float:
    """Largest of a few rates: work returns how much it did [1]; the rate is per second of the clock."""
    rates = []
    for _ in range(repeats):
        begin = clock()
        amount = work()
        rates.append(amount / (clock() - begin))
    return max(rates)


def yardsticks(cpu_s_per_s: float | None, yardstick_s: float) -> float | None:
    """Cost of a second of simulation in yardsticks, as if two cores had shared its processor time; None where that is unknown.

    Args:
        cpu_s_per_s: processor time of all cores for each simulated second [s].
        yardstick_s: of `Yardstick.processor_seconds` [s].
    """
    return None if cpu_s_per_s is None else cpu_s_per_s / YARDSTICK_THREADS / yardstick_s


class Yardstick:
    """The frozen model, simulated in a batch from standing, with constant controls."""

    def __init__(self) -> None:
        self.model = mujoco.MjModel.from_xml_path(str(YARDSTICK))
        self.batch = Batch(self.model, YARDSTICK_BATCH, nthread=YARDSTICK_THREADS)
        self._qpos = self.batch.bind("qpos")
        self._at_rest = [self.batch.bind(name) for name in ("qvel", "qacc_warmstart", "time")]
        self._control = np.zeros((YARDSTICK_BATCH, YARDSTICK_ROLLOUT, self.model.nu))

    def rollout(self) -> FloatArray:
        """One rollout of the batch; (YARDSTICK_BATCH, YARDSTICK_ROLLOUT, nq) poses after every step."""
        self._qpos[:] = self.model.qpos0
        for state in self._at_rest:
            state[:] = 0.0
        spec = mujoco.mjtState.mjSTATE_CTRL
        record = self.batch.rollout(YARDSTICK_ROLLOUT, control=self._control, control_spec=spec, record=("qpos",))
        return np.asarray(record["qpos"])

    def seconds(self) -> float:
        """How long YARDSTICK_STEPS steps take [s]."""
        return 1.0 / best_rate(self._steps)

    def processor_seconds(self) -> float:
        """The same by processor time, as if both threads were always at work [s]; other work beside it counts for less."""
        return 1.0 / best_rate(self._steps, clock=process_time) / YARDSTICK_THREADS

    def _steps(self) -> float:
        per_rollout = YARDSTICK_BATCH * YARDSTICK_ROLLOUT
        rollouts = -(-YARDSTICK_STEPS // per_rollout)
        for _ in range(rollouts):
            self.rollout()
        return rollouts * per_rollout / YARDSTICK_STEPS
