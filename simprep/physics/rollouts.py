"""A batch of simulations of the planner's model from one state, with the same bits at any number of threads."""

from collections.abc import Mapping
from time import perf_counter

import mujoco
import numpy as np
from mujoco.batch import Batch

from simprep.arrays import BoolArray, FloatArray
from simprep.physics.bodies import SceneBody
from simprep.physics.planner import Planner
from simprep.physics.step_timers import without_step_timers

Record = Mapping[str, FloatArray]


class Rollouts:
    """Simulates sequences of servo targets from the world's present state.

    Args:
        planner: the reduced model.
        samples: simulations in a batch.
        steps: length of each, in the planner's steps.
        threads: simulation threads; 0 for all cores. Does not change the result.
        orientations: record xquat too.
    """

    def __init__(self, planner: Planner, samples: int, steps: int, threads: int, orientations: bool = False) -> None:
        self._planner, self._steps = planner, steps
        self._recorded = ("qpos", "qvel", "xpos", "subtree_com", *(("xquat",) if orientations else ()))
        self._batch = Batch(planner.model, samples, nthread=threads)
        self._body_quat = self._batch.expand("body_quat")
        self._qpos = self._batch.bind("qpos")
        self._qvel = self._batch.bind("qvel")
        self._time = self._batch.bind("time")
        self._warned = np.zeros(samples, dtype=np.int64)  # how often MuJoCo has warned in each simulation
        self._record: Record = {}  # filled anew by every run, as fresh arrays of this size cost page faults
        self.simulation_s = 0.0

    def run(
        self, data: mujoco.MjData, control: FloatArray, change: FloatArray | None = None
    ) -> tuple[Record, BoolArray]:
        """Simulate; returns records qpos, qvel, xpos, subtree_com, and xquat if asked for (samples, steps, ...), and which samples diverged.

        The records are overwritten by the next run.

        Args:
            data: of the world, read only.
            control: (samples, steps, controls) servo targets of the planner's actuators [rad].
            change: (samples, bodies, 6) added to the velocity of each root, world frame [m/s], and its spin, own frame
                [rad/s].
        """
        self._qpos[:] = data.qpos[self._planner.qpos]
        self._qvel[:] = data.qvel[self._planner.qvel]
        if change is not None:
            for number, one in enumerate(self._planner.bodies):
                self._qvel[:, one.qvel.start : one.qvel.start + 6] += change[:, number]
        for body, quat in self._planner.fused_orientations(data):
            self._body_quat[:, body] = quat
        self._time[:] = data.time
        begin = perf_counter()
        with without_step_timers():
            self._record = record = self._batch.rollout(
                self._steps,
                control=control,
                control_spec=mujoco.mjtState.mjSTATE_CTRL,
                record=self._recorded,
                out=self._record,
            )
        self.simulation_s += perf_counter() - begin
        # MuJoCo resets a diverged state, so finite numbers alone prove nothing
        before, self._warned = self._warned, self._batch.warning[:, :, 1].sum(axis=1)
        return record, self._warned > before


def record_of(record: Record, body: SceneBody) -> Record:
    """The part of a record of `Rollouts.run` that belongs to one body of `Planner.bodies`, as if it were alone.

    Entries from 1 on of xpos, xquat and subtree_com are the body's segments; entry 0 means nothing.
    """
    segments = slice(body.segments.start - 1, body.segments.stop)
    return {
        "qpos": record["qpos"][:, :, body.qpos],
        "qvel": record["qvel"][:, :, body.qvel],
        **{name: record[name][:, :, segments] for name in ("xpos", "xquat", "subtree_com") if name in record},
    }
