"""Simulate a free-floating humanoid that tracks a motion with joint motors only."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from simprep.errors import SettingError, UnknownNameError
from simprep.humanoid import HINGES
from simprep.motion.motion import Motion
from simprep.physics.controller import Controller, PdController
from simprep.physics.ground import GroundReader
from simprep.physics.mpc import MpcController, MpcSettings
from simprep.physics.reference import Reference, ReferenceSettings, make_reference
from simprep.physics.run import DIVERGED, DONE, FELL, Assist, Run
from simprep.scene import SceneSettings, build_scene

CONTROLLERS = ("pd", "mpc")


@dataclass(frozen=True)
class Push:
    """An external force on one body, for robustness tests; reported as assist in every result.

    Attributes:
        body: name of the body.
        start: time of its begin [s].
        duration: how long [s].
        force: (x, y, z) in the world frame, at the body's COM [N].
    """

    body: str
    start: float
    duration: float
    force: tuple[float, float, float]


@dataclass(frozen=True)
class FallRule:
    """When a run counts as a fall.

    Attributes:
        drop: the pelvis or head is lower than the reference's by more than this [m].
        clearance: or pelvis, trunk, neck or head touch the floor while the reference's is higher than this [m].
    """

    drop: float = 0.35
    clearance: float = 0.10


@dataclass(frozen=True)
class TrackSettings:
    """Everything that a run depends on besides motion, controller and seed.

    Attributes:
        scene: obstacles, timestep, friction; its body is replaced by the motion's.
        reference: processing of the motion.
        mpc: configuration of `mpc`.
        fall: when a run counts as a fall.
        pushes: external forces; none by default.
    """

    scene: SceneSettings = field(default_factory=SceneSettings)
    reference: ReferenceSettings = field(default_factory=ReferenceSettings)
    mpc: MpcSettings = field(default_factory=MpcSettings)
    fall: FallRule = field(default_factory=FallRule)
    pushes: tuple[Push, ...] = ()


def track(
    motion: Motion,
    controller: str = "mpc",
    seed: int = 0,
    settings: TrackSettings | None = None,
    progress: Callable[[float], None] | None = None,
) -> Run:
    """Simulate the humanoid tracking a motion from its first frame until the end, a fall or divergence.

    No force acts on the body but joint motors, gravity and contact, unless `settings.pushes` says so.

    Args:
        motion: what to track; a loop is tracked for one cycle (see `simprep.motion.edit.repeat`).
        controller: `pd` or `mpc`.
        seed: of the controller's random generator.
        settings: scene, reference processing, controller configuration.
        progress: called with the completed share (0 to 1) about thirty times a second of motion.

    Returns:
        The run, with its end stated.

    Raises:
        UnknownNameError: no such controller.
        SettingError: a push on an unknown body.
    """
    settings = settings or TrackSettings()
    scene = replace(settings.scene, bodies=(motion.body,))
    model = build_scene(scene)
    reference = make_reference(motion, scene.timestep, settings.reference)
    with _quiet_warnings():
        brain = _make_controller(controller, reference, model, scene, seed, settings)
        return _simulate(model, reference, brain, seed, settings, progress)


@contextmanager
def _quiet_warnings() -> Iterator[None]:
    """Keep MuJoCo from printing and logging to a file what a run reports as its end or as rejected samples."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda message: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def _make_controller(
    name: str, reference: Reference, model: Any, scene: SceneSettings, seed: int, settings: TrackSettings
) -> PdController | MpcController:
    if name == "pd":
        return PdController(reference, model)
    if name == "mpc":
        return MpcController(reference, model, scene, seed, settings.mpc)
    raise UnknownNameError("controller", name, CONTROLLERS)


def _simulate(
    model: Any,
    reference: Reference,
    brain: Controller,
    seed: int,
    settings: TrackSettings,
    progress: Callable[[float], None] | None,
) -> Run:
    begin = perf_counter()
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = reference.qpos[0], reference.qvel[0]
    mujoco.mj_forward(model, data)
    steps = len(reference.qpos) - 1
    ground = GroundReader(model)
    recorder = _Recorder(steps, model)
    pushes = [(push, _body_id(model, push.body)) for push in settings.pushes]
    push_force = 0.0
    simulation_s = 0.0
    end, reason, taken = DONE, "the motion ended", steps
    recorder.state(0, data)
    for step in range(steps):
        data.ctrl[:] = brain.target(step, data)
        push_force = max(push_force, _apply_pushes(data, pushes))
        before = perf_counter()
        mujoco.mj_step(model, data)
        simulation_s += perf_counter() - before
        diverged = _divergence(data)
        if diverged:
            end, reason, taken = DIVERGED, diverged, step
            break
        recorder.step(step, data, ground)
        recorder.state(step + 1, data)
        fall = _fall(model, data, reference, step + 1, ground, settings.fall)
        if fall:
            end, reason, taken = FELL, fall, step + 1
            break
        if progress and step % 4 == 0:
            progress((step + 1) / steps)
    wall = perf_counter() - begin
    if isinstance(brain, MpcController):
        simulation_s += brain.simulation_s
    dt = float(model.opt.timestep)
    return Run(
        reference=reference.motion,
        controller=brain.name,
        seed=seed,
        timestep=dt,
        time=np.arange(taken + 1, dtype=np.float64) * dt,
        reference_qpos=reference.qpos[: taken + 1],
        reference_qvel=reference.qvel[: taken + 1],
        torque_limit=model.actuator_forcerange[:, 1].copy(),
        **recorder.arrays(taken),
        end=end,
        end_s=taken * dt,
        fell_at_s=taken * dt if end == FELL else None,
        end_reason=reason,
        processing=reference.processing,
        settings=brain.settings(),
        assist=Assist(force_n=push_force),
        wall_s=wall,
        overhead_share=max(0.0, 1 - simulation_s / wall),
    )


class _Recorder:
    def __init__(self, steps: int, model: Any) -> None:
        self.qpos = np.zeros((steps + 1, model.nq))
        self.qvel = np.zeros((steps + 1, model.nv))
        self.target = np.zeros((steps, len(HINGES)))
        self.torque = np.zeros((steps, len(HINGES)))
        self.ground_force = np.zeros((steps, 3))
        self.foot_force = np.zeros((steps, 2, 3))
        self.centre_of_pressure = np.full((steps, 2), np.nan)
        self.foot_contact = np.zeros((steps, 2), dtype=bool)
        self.penetration = np.zeros(steps)

    def state(self, index: int, data: Any) -> None:
        self.qpos[index], self.qvel[index] = data.qpos, data.qvel

    def step(self, step: int, data: Any, ground: GroundReader) -> None:
        self.target[step], self.torque[step] = data.ctrl, data.actuator_force
        reading = ground.read(data)
        self.ground_force[step] = reading.force
        self.foot_force[step] = reading.foot_force
        self.centre_of_pressure[step] = reading.centre_of_pressure
        self.foot_contact[step] = reading.foot_force[:, 2] > 20.0
        self.penetration[step] = reading.penetration

    def arrays(self, taken: int) -> dict[str, NDArray[Any]]:
        states = {"qpos": self.qpos[: taken + 1], "qvel": self.qvel[: taken + 1]}
        names = ("target", "torque", "ground_force", "foot_force", "centre_of_pressure", "foot_contact", "penetration")
        return {**states, **{name: getattr(self, name)[:taken] for name in names}}


def _fall(model: Any, data: Any, reference: Reference, step: int, ground: GroundReader, rule: FallRule) -> str:
    """The rule by which this state is a fall, in words; empty if it is none."""
    heights = data.xpos[1:, 2]
    goal = reference.kinematics.xpos[step - 1, :, 2]  # xpos belongs to the state before the step
    for name, index in (("pelvis", 0), ("head", 4)):
        if heights[index] < goal[index] - rule.drop:
            return f"the {name} is {goal[index] - heights[index]:.2f} m lower than the reference's"
    for index, name in ground.trunk_contacts(data):
        if reference.clearance[step - 1, index] > rule.clearance:
            return f"the {name} touches the floor"
    return ""


_BAD_WARNINGS = (
    mujoco.mjtWarning.mjWARN_BADQPOS,
    mujoco.mjtWarning.mjWARN_BADQVEL,
    mujoco.mjtWarning.mjWARN_BADQACC,
    mujoco.mjtWarning.mjWARN_BADCTRL,
)


def _divergence(data: Any) -> str:
    # MuJoCo resets a state that turned NaN by itself, so finite numbers alone prove nothing
    for kind in _BAD_WARNINGS:
        if data.warning[kind].number:
            return f"MuJoCo warning {mujoco.mjtWarning(kind).name}"
    if not np.isfinite(data.qpos).all():
        return "NaN in qpos"
    return ""


def _body_id(model: Any, name: str) -> int:
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
    if index < 0:
        raise SettingError(
            f"push on unknown body {name!r}; valid: {', '.join(model.body(i).name for i in range(1, model.nbody))}"
        )
    return int(index)


def _apply_pushes(data: Any, pushes: list[tuple[Push, int]]) -> float:
    largest = 0.0
    for _, body in pushes:
        data.xfrc_applied[body] = 0.0
    for push, body in pushes:
        if push.start <= data.time < push.start + push.duration:
            data.xfrc_applied[body, :3] += push.force
            largest = max(largest, float(np.linalg.norm(push.force)))
    return largest
