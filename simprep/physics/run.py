"""What a simulation returns: everything needed to judge it, and nothing that was not simulated."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simprep.motion.motion import Motion

DONE, FELL, DIVERGED = "done", "fell", "diverged"


@dataclass(frozen=True)
class Assist:
    """Largest external force and torque applied anywhere in a run (pushes; never the controllers).

    Attributes:
        force_n: largest force [N].
        torque_nm: largest torque [N m].
    """

    force_n: float = 0.0
    torque_nm: float = 0.0


@dataclass(frozen=True)
class Run:
    """A tracked motion: N simulation steps, N + 1 states.

    Attributes:
        reference: the motion as it was tracked (after the recorded processing).
        controller: name of the controller.
        seed: seed of its random generator.
        timestep: simulation step [s].
        time: (N + 1,) [s].
        qpos: (N + 1, 44) simulated states.
        qvel: (N + 1, 43).
        reference_qpos: (N + 1, 44) the reference at the same times.
        reference_qvel: (N + 1, 43).
        target: (N, 37) servo targets [rad].
        torque: (N, 37) servo torques after their limits [N m].
        torque_limit: (37,) limits [N m].
        ground_force: (N, 3) force of the floor and obstacles on the body, world frame [N].
        foot_force: (N, 2, 3) the part of it on the left and right foot [N].
        centre_of_pressure: (N, 2) on the floor [m]; NaN while the floor bears less than 20 N.
        foot_contact: (N, 2) whether each foot bears more than 20 N.
        penetration: (N,) deepest overlap of any geom with the floor [m], 0 or more.
        end: `done`, `fell` or `diverged`.
        end_s: time of the last state [s].
        fell_at_s: time of the fall [s]; None if there was none.
        end_reason: the rule that ended the run, in words.
        processing: what was done to the motion before tracking (smoothing, height correction, start state).
        settings: the controller's configuration, for the record.
        assist: external forces used.
        wall_s: computing time [s].
        overhead_share: share of the computing time spent outside MuJoCo.
    """

    reference: Motion
    controller: str
    seed: int
    timestep: float
    time: NDArray[np.float64]
    qpos: NDArray[np.float64]
    qvel: NDArray[np.float64]
    reference_qpos: NDArray[np.float64]
    reference_qvel: NDArray[np.float64]
    target: NDArray[np.float64]
    torque: NDArray[np.float64]
    torque_limit: NDArray[np.float64]
    ground_force: NDArray[np.float64]
    foot_force: NDArray[np.float64]
    centre_of_pressure: NDArray[np.float64]
    foot_contact: NDArray[np.bool_]
    penetration: NDArray[np.float64]
    end: str
    end_s: float
    fell_at_s: float | None
    end_reason: str
    processing: Mapping[str, Any] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)
    assist: Assist = field(default_factory=Assist)
    wall_s: float = 0.0
    overhead_share: float = 0.0

    @property
    def completed_share(self) -> float:
        """Share of the reference's duration that was simulated, 0 to 1."""
        whole = self.reference.duration
        return 1.0 if whole <= 0 else min(1.0, self.end_s / whole)

    def simulated_motion(self) -> Motion:
        """The simulated poses as a Motion at the simulation rate; contacts are the measured ones."""
        contacts = np.zeros((len(self.qpos), 2), dtype=bool)
        contacts[:-1] = self.foot_contact  # MuJoCo finds the contacts of a step at the state before it
        contacts[-1:] = self.foot_contact[-1:]
        return Motion(
            qpos=self.qpos,
            fps=1.0 / self.timestep,
            contacts=contacts,
            name=f"{self.reference.name}_{self.controller}",
            source=f"simulated: {self.reference.source}",
            body=self.reference.body,
        )
