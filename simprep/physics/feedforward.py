"""Servo targets that lead the reference by its velocities and by the torques that it needs."""

from collections.abc import Sequence

import numpy as np

from simprep.physics.controller import ControlTask, feedforward_targets
from simprep.physics.inverse_dynamics import InverseDynamics
from simprep.physics.reference import Reference

LEAD_S = 0.5
"""How far beyond what is asked for the reference's torques are worked out at a time [s]."""


class Feedforward:
    """Targets of all bodies' servos for tracking references without any correction. Call `follow` before anything else.

    Args:
        task: who tracks, and in what model.
        torque_share: share of the inverse-dynamics torques that the targets lead by.

    Attributes:
        targets: (N + 1, controls) [rad], as of `feedforward_targets`; with torques up to the step of the last `lead`.
    """

    def __init__(self, task: ControlTask, torque_share: float) -> None:
        self._bodies, self._model, self._torque_share = task.bodies, task.model, torque_share
        self._dynamics = [InverseDynamics(body.character) for body in task.bodies]

    def follow(self, references: Sequence[Reference], first: int) -> None:
        """Lead other references from now on.

        Args:
            references: of each body, at the world's steps, 0 to N.
            first: the first of these steps that is asked for from now on.
        """
        targets = [feedforward_targets(one, body) for one, body in zip(references, self._bodies)]
        self.targets = np.concatenate(targets, axis=1)
        self._references, self._led = references, first

    def lead(self, until: int) -> None:
        """Let the targets lead by the torques up to a step of the world, and `LEAD_S` beyond."""
        first, end = self._led, len(self.targets) - 1
        if self._torque_share <= 0 or first > min(until, end):
            return
        last = min(until + round(LEAD_S / self._model.opt.timestep), end)
        for reference, body, dynamics in zip(self._references, self._bodies, self._dynamics):
            needed = dynamics.torques(reference, since=first, until=last)
            torque = np.clip(needed, *self._model.actuator_forcerange[body.controls].T)
            lead = self._torque_share * torque / body.character.gains[:, 0]
            self.targets[first : last + 1, body.controls] += lead
        self._led = last + 1
