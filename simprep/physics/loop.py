"""The simulation loop: servo targets in, states and contacts of one or two humanoids out."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter
from typing import Any, Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from simprep.humanoid import HINGES, N_QPOS, N_QVEL
from simprep.physics.controller import Controller
from simprep.physics.falls import FallRule, divergence, fall
from simprep.physics.fighters import Fighter, fighter_of_scene
from simprep.physics.ground import GroundReader
from simprep.physics.mpc import MpcController
from simprep.physics.pushes import Push, PushApplier
from simprep.physics.reference import Reference
from simprep.physics.run import DIVERGED, DONE, FELL, Assist, Run


class Observer(Protocol):
    """Reads something else off every step."""

    def step(self, step: int, data: Any) -> None:
        """Read a step.

        Args:
            step: index of the step.
            data: mujoco.MjData after it: contacts and positions are those at its begin.
        """
        ...


@dataclass(frozen=True)
class Simulated:
    """What came out of a loop.

    Attributes:
        recorders: of each humanoid.
        taken: steps that are data.
        end: `done`, `fell` or `diverged`.
        reason: the rule that ended it, in words.
        fallen: number of the humanoid that fell; None if none did.
        assist: external forces used.
        wall_s: computing time [s].
        overhead_share: share of it spent outside MuJoCo.
    """

    recorders: tuple["Recorder", ...]
    taken: int
    end: str
    reason: str
    fallen: int | None
    assist: Assist
    wall_s: float
    overhead_share: float

    def run(self, number: int, reference: Reference, brain: Controller, seed: int, model: Any) -> Run:
        """One humanoid's part, as a run that ended when the loop did.

        Args:
            number: which humanoid.
            reference: what it tracked.
            brain: what moved it.
            seed: of the brain's random generator.
            model: mujoco.MjModel of the scene.
        """
        dt, taken = float(model.opt.timestep), self.taken
        fell = self.end == FELL and self.fallen == number
        return Run(
            reference=reference.motion,
            controller=brain.name,
            seed=seed,
            timestep=dt,
            time=np.arange(taken + 1, dtype=np.float64) * dt,
            reference_qpos=reference.qpos[: taken + 1],
            reference_qvel=reference.qvel[: taken + 1],
            torque_limit=model.actuator_forcerange[fighter_of_scene(number).controls, 1].copy(),
            **self.recorders[number].arrays(taken),
            end=self.end,
            end_s=taken * dt,
            fell_at_s=taken * dt if fell else None,
            end_reason=self.reason,
            processing=reference.processing,
            settings=brain.settings(),
            assist=self.assist,
            wall_s=self.wall_s,
            overhead_share=self.overhead_share,
        )


@contextmanager
def quiet_warnings() -> Iterator[None]:
    """Keep MuJoCo from printing and logging to a file what a run reports as its end or as rejected samples."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda message: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def simulate(
    model: Any,
    references: Sequence[Reference],
    brain: Controller,
    rule: FallRule,
    pushes: tuple[Push, ...] = (),
    progress: Callable[[float], None] | None = None,
    observer: Observer | None = None,
) -> Simulated:
    """Simulate from the references' first states until their end, a fall of anybody, or divergence.

    Args:
        model: mujoco.MjModel of a scene with as many humanoids as references.
        references: what each tracks, equally long.
        brain: chooses all servo targets.
        rule: what counts as a fall.
        pushes: external forces.
        progress: called with the completed share (0 to 1) every fourth step.
        observer: sees every step that is data.

    Raises:
        SettingError: a push on an unknown body.
    """
    begin = perf_counter()
    data = mujoco.MjData(model)
    fighters = [fighter_of_scene(number) for number in range(len(references))]
    for fighter, reference in zip(fighters, references):
        data.qpos[fighter.qpos], data.qvel[fighter.qvel] = reference.qpos[0], reference.qvel[0]
    mujoco.mj_forward(model, data)
    steps = len(references[0].qpos) - 1
    recorders = tuple(Recorder(steps, model, fighter) for fighter in fighters)
    push = PushApplier(model, pushes)
    simulation_s = 0.0
    end, reason, taken, fallen = DONE, "the motion ended", steps, None
    for recorder in recorders:
        recorder.state(0, data)
    for step in range(steps):
        data.ctrl[:] = brain.target(step, data)
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
        if observer:
            observer.step(step, data)
        falls = [
            fall(data, recorder.fighter, reference, step + 1, recorder.ground, rule)
            for recorder, reference in zip(recorders, references)
        ]
        if any(falls):
            fallen = next(number for number, words in enumerate(falls) if words)
            end, reason, taken = FELL, falls[fallen], step + 1
            break
        if progress and step % 4 == 0:
            progress((step + 1) / steps)
    wall = perf_counter() - begin
    if isinstance(brain, MpcController):
        simulation_s += brain.simulation_s
    return Simulated(
        recorders, taken, end, reason, fallen, Assist(force_n=push.largest), wall, max(0.0, 1 - simulation_s / wall)
    )


class Recorder:
    """States, controls and floor contacts of one humanoid, step by step.

    Args:
        steps: steps at most.
        model: mujoco.MjModel of the scene.
        fighter: which humanoid.
    """

    def __init__(self, steps: int, model: Any, fighter: Fighter) -> None:
        self.fighter, self.ground = fighter, GroundReader(model, fighter)
        self.qpos = np.zeros((steps + 1, N_QPOS))
        self.qvel = np.zeros((steps + 1, N_QVEL))
        self.target = np.zeros((steps, len(HINGES)))
        self.torque = np.zeros((steps, len(HINGES)))
        self.ground_force = np.zeros((steps, 3))
        self.foot_force = np.zeros((steps, 2, 3))
        self.centre_of_pressure = np.full((steps, 2), np.nan)
        self.foot_contact = np.zeros((steps, 2), dtype=bool)
        self.penetration = np.zeros(steps)

    def state(self, index: int, data: Any) -> None:
        """Note a state.

        Args:
            index: of the state.
            data: mujoco.MjData.
        """
        self.qpos[index], self.qvel[index] = data.qpos[self.fighter.qpos], data.qvel[self.fighter.qvel]

    def step(self, step: int, data: Any) -> None:
        """Note what acted during a step.

        Args:
            step: index of the step.
            data: mujoco.MjData after it.
        """
        controls = self.fighter.controls
        self.target[step], self.torque[step] = data.ctrl[controls], data.actuator_force[controls]
        reading = self.ground.read(data)
        self.ground_force[step] = reading.force
        self.foot_force[step] = reading.foot_force
        self.centre_of_pressure[step] = reading.centre_of_pressure
        self.foot_contact[step] = reading.foot_force[:, 2] > 20.0
        self.penetration[step] = reading.penetration

    def arrays(self, taken: int) -> dict[str, NDArray[Any]]:
        """What was noted, by the names of `simprep.physics.run.Run`.

        Args:
            taken: steps that are data.
        """
        states = {"qpos": self.qpos[: taken + 1], "qvel": self.qvel[: taken + 1]}
        names = ("target", "torque", "ground_force", "foot_force", "centre_of_pressure", "foot_contact", "penetration")
        return {**states, **{name: getattr(self, name)[:taken] for name in names}}
