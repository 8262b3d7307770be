"""The simulation loop: servo targets in; states, floor contacts and contacts between bodies out."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from simprep.arrays import FloatArray
from simprep.errors import SettingError
from simprep.physics.bodies import SceneBody
from simprep.physics.contacts import ContactReader
from simprep.physics.controller import Controller, ControlTask
from simprep.physics.falls import FallRule, divergence, fall
from simprep.physics.ground import LEAST_LOAD_N, GroundReader
from simprep.physics.pushes import Push, PushApplier
from simprep.physics.run import DIVERGED, DONE, FELL


@dataclass(frozen=True)
class Recording:
    """Result of a simulation loop.

    Attributes:
        bodies: what each body did.
        between: contacts between them.
        taken: number of valid steps.
        end: `done`, `fell` or `diverged`.
        reason: the rule that ended it, in words.
        fallen: number of the body that fell; None if none did.
        push_n: largest external force [N].
        wall_s: computing time [s].
        overhead_share: share of it spent outside MuJoCo.
    """

    bodies: tuple["BodyRecorder", ...]
    between: ContactReader
    taken: int
    end: str
    reason: str
    fallen: int | None
    push_n: float
    wall_s: float
    overhead_share: float


@contextmanager
def quiet_warnings() -> Iterator[None]:
    """Silence MuJoCo's warnings and log file; a run reports its end, and rejected samples, itself."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda message: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def run_loop(
    task: ControlTask,
    controller: Controller,
    rule: FallRule,
    pushes: tuple[Push, ...] = (),
    progress: Callable[[float], None] | None = None,
) -> Recording:
    """Simulate from the references' first states until their end, the first fall of a body, or divergence.

    Args:
        task: the scene and what each body tracks, equally long.
        controller: chooses all servo targets.
        rule: what counts as a fall.
        pushes: external forces.
        progress: called with the completed share (0 to 1) every fourth step.

    Raises:
        SettingError: a push on an unknown segment, or targets of another shape than the controls.
    """
    begin = perf_counter()
    model, references = task.model, task.references
    data = mujoco.MjData(model)
    for body, reference in zip(task.bodies, references, strict=True):
        data.qpos[body.qpos], data.qvel[body.qvel] = reference.qpos[0], reference.qvel[0]
    mujoco.mj_forward(model, data)
    steps = len(references[0].qpos) - 1
    recorders = tuple(BodyRecorder(steps, model, body) for body in task.bodies)
    between = ContactReader(model, task.bodies, steps)
    push = PushApplier(model, pushes)
    simulation_s = 0.0
    end, reason, taken, fallen = DONE, "the motion ended", steps, None
    for recorder in recorders:
        recorder.state(0, data)
    for step in range(steps):
        data.ctrl[:] = _targets(controller, step, data)
        push.apply(data)
        before = perf_counter()
        mujoco.mj_step(model, data)
        simulation_s += perf_counter() - before
        diverged = divergence(data)
        if diverged:
            end, reason, taken = DIVERGED, diverged, step
            break
        for recorder in recorders:
            recorder.step(step, data)
            recorder.state(step + 1, data)
        between.step(step, data)
        falls = [
            fall(data, recorder.body, reference, step + 1, recorder.ground, rule)
            for recorder, reference in zip(recorders, references)
        ]
        if any(falls):
            fallen = next(number for number, words in enumerate(falls) if words)
            end, reason, taken = FELL, falls[fallen], step + 1
            break
        if progress and step % 4 == 0:
            progress((step + 1) / steps)
    wall = perf_counter() - begin
    simulation_s += getattr(controller, "simulation_s", 0.0)
    share = max(0.0, 1 - simulation_s / wall)
    return Recording(recorders, between, taken, end, reason, fallen, push.largest, wall, share)


def _targets(controller: Controller, step: int, data: mujoco.MjData) -> FloatArray:
    targets = controller.target(step, data)
    if np.shape(targets) != data.ctrl.shape:
        raise SettingError(
            f"controller {controller.name!r}: target() returned shape {np.shape(targets)}; valid: {data.ctrl.shape}, "
            "one angle for each actuator of the scene"
        )
    return targets


class BodyRecorder:
    """States, controls and floor contacts of one body, for at most `steps` steps."""

    def __init__(self, steps: int, model: mujoco.MjModel, body: SceneBody) -> None:
        self.body, self.ground = body, GroundReader(model, body)
        self.qpos = np.zeros((steps + 1, body.qpos.stop - body.qpos.start))
        self.qvel = np.zeros((steps + 1, body.qvel.stop - body.qvel.start))
        self.target = np.zeros((steps, len(body.joint_names)))
        self.torque = np.zeros((steps, len(body.joint_names)))
        self.ground_force = np.zeros((steps, 3))
        self.foot_force = np.zeros((steps, 2, 3))
        self.centre_of_pressure = np.full((steps, 2), np.nan)
        self.foot_contact = np.zeros((steps, 2), dtype=bool)
        self.penetration = np.zeros(steps)

    def state(self, index: int, data: mujoco.MjData) -> None:
        """Note the state of an index."""
        self.qpos[index], self.qvel[index] = data.qpos[self.body.qpos], data.qvel[self.body.qvel]

    def step(self, step: int, data: mujoco.MjData) -> None:
        """Note what acted during a step; `data` is taken after it."""
        controls = self.body.controls
        self.target[step], self.torque[step] = data.ctrl[controls], data.actuator_force[controls]
        reading = self.ground.read(data)
        self.ground_force[step] = reading.force
        self.foot_force[step] = reading.foot_force
        self.centre_of_pressure[step] = reading.centre_of_pressure
        self.foot_contact[step] = reading.foot_force[:, 2] > LEAST_LOAD_N
        self.penetration[step] = reading.penetration

    def arrays(self, taken: int) -> dict[str, NDArray[Any]]:
        """The first `taken` steps of what was noted, named as in `simprep.physics.run.BodyRun`."""
        states = {"qpos": self.qpos[: taken + 1], "qvel": self.qvel[: taken + 1]}
        names = ("target", "torque", "ground_force", "foot_force", "centre_of_pressure", "foot_contact", "penetration")
        return {**states, **{name: getattr(self, name)[:taken] for name in names}}
