"""`balance`: servos fed by inverse dynamics, with a small quadratic program that keeps the body on its feet.

A hundred times a second it looks at the state. It wants accelerations: of the COM along a way that was planned ahead
(`simprep.physics.balance_preview`), of joints, the root's orientation and the COM's height towards the reference, of contact points
to zero, of a swinging foot to where the extrapolated COM asks for it; if the feet cannot catch
the body, one of them makes a step of its own (`simprep.physics.balance_steps`). A quadratic program finds the contact forces within the friction pyramid, and the torques
within the motors' limits, that serve these wishes best (`simprep.physics.contact_forces`). In between, the servos hold the motion
that it expects.

It lies between `pd`, which falls at once, and `mpc`, which looks ahead with the whole body. A standing or slow body holds, a badly balanced
one falls. It has no random numbers. Floor contacts are the only ones that it knows of.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import mujoco
import numpy as np

from simprep.arrays import FloatArray
from simprep.humanoid_model import GRAVITY
from simprep.physics.balance_goals import BalanceReference, BalanceSettings, balance_reference
from simprep.physics.balance_steps import ExtraStep
from simprep.physics.balance_tasks import balance_tasks
from simprep.physics.bodies import SceneBody
from simprep.physics.contact_forces import EquationsOfMotion, best_motion
from simprep.physics.controller import ControlTask
from simprep.physics.reference import Reference


@dataclass(frozen=True)
class _Plan:
    """Angles, velocities, accelerations and torques (joints,) of one body's motors at the last decision."""

    angle: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    torque: FloatArray


class BalanceController:
    """Joint torques from a balance program, held by the servos; its only state is the last decision."""

    name = "balance"

    def __init__(self, task: ControlTask, settings: BalanceSettings | None = None) -> None:
        self._settings, self._task, self._model = settings or BalanceSettings(), task, task.model
        self._data = mujoco.MjData(task.model)
        self._dt = float(task.model.opt.timestep)
        self._every = max(1, round(1 / self._settings.rate / self._dt))
        self._gains = [body.character.gains.T for body in task.bodies]
        self._weight = [GRAVITY * float(task.model.body_mass[body.segments].sum()) for body in task.bodies]
        self._decided_at = -1
        self._plans: list[_Plan] = []
        self._unsolved = 0
        self._extra: list[ExtraStep | None] = [None] * len(task.bodies)
        self._extra_steps = 0
        self.follow(task.references, 0)

    def follow(self, references: Sequence[Reference], shift: int) -> None:
        """Track other references from now on (see `Controller`)."""
        self._goals = [balance_reference(one, body, self._settings) for one, body in zip(references, self._task.bodies)]
        self._decided_at += shift if self._decided_at >= 0 else 0
        self._extra = [one and replace(one, begin=one.begin + shift, end=one.end + shift) for one in self._extra]

    def target(self, step: int, data: mujoco.MjData) -> FloatArray:
        """Servo targets for the coming step (see `Controller.target`)."""
        if self._decided_at < 0 or step - self._decided_at >= self._every:
            self._decide(step, data)
            self._decided_at = step
        ahead = (step - self._decided_at + 1) * self._dt
        targets = np.empty(self._model.nu)
        for body, (kp, kd), plan in zip(self._task.bodies, self._gains, self._plans):
            velocity = plan.velocity + ahead * plan.acceleration
            angle = plan.angle + 0.5 * ahead * (plan.velocity + velocity)
            targets[body.controls] = angle + (plan.torque + kd * velocity) / kp
        return targets

    def settings(self) -> dict[str, Any]:
        """Configuration, for the record."""
        return {**asdict(self._settings), "unsolved_programs": self._unsolved, "extra_steps": self._extra_steps}

    def _decide(self, step: int, told: mujoco.MjData) -> None:
        model, data = self._model, self._data
        data.qpos[:], data.qvel[:], data.qacc[:] = told.qpos, told.qvel, 0.0
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_makeM(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_rnePostConstraint(model, data)
        inertia = np.empty((model.nv, model.nv))
        mujoco.mj_fullM(model, data, inertia)
        bias = data.qfrc_bias - data.qfrc_passive
        self._plans = [
            self._decide_one(step, body, goal, inertia[body.qvel, body.qvel], bias[body.qvel], weight)
            for body, goal, weight in zip(self._task.bodies, self._goals, self._weight)
        ]

    def _decide_one(
        self, step: int, body: SceneBody, goal: BalanceReference, inertia: FloatArray, bias: FloatArray, weight: float
    ) -> _Plan:
        data, s = self._data, self._settings
        at = min(step + 1, len(goal.qacc) - 1)
        before = self._extra[body.number]
        tasks, jacobians, extra = balance_tasks(goal, at, body, data, inertia, bias, s, before)
        self._extra[body.number] = extra
        self._extra_steps += extra is not None and extra is not before
        limits = self._model.actuator_forcerange[body.controls, 1]
        equations = EquationsOfMotion(inertia, bias, jacobians, body.joint_qvel, limits, weight)
        qacc, torque, solved = best_motion(tasks, equations, s.friction, s.regularisation)
        self._unsolved += not solved
        angle, velocity = data.qpos[body.qpos][body.joint_qpos], data.qvel[body.qvel][body.joint_qvel]
        return _Plan(angle, velocity, qacc[body.joint_qvel], torque)
