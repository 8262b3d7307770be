"""Identified dynamics of one tracked motion: runs with small pushes, the laws found in them, and the push they predict."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from simprep.arrays import FloatArray
from simprep.errors import MotionError, SettingError
from simprep.metrics.balance import extrapolated_com
from simprep.metrics.com_laws import AXES, ComLaws, ComSignals, com_signals, fit_com_laws, loop_eigenvalues, loop_matrix
from simprep.metrics.push_prediction import capture_push, closed_loop_push
from simprep.metrics.sparse_law import SparseLaw
from simprep.motion.edit import yaw
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.support import polygons, support_points
from simprep.physics.controller import ControllerFactory
from simprep.physics.pushes import Push
from simprep.physics.settings import SimulationSettings
from simprep.physics.simulate import track
from simprep.study.push_limits import PushSettings


@dataclass(frozen=True)
class ExcitationSettings:
    """Small random pushes that show how a controller answers. A SettingError says what is out of range.

    Attributes:
        runs: how many, with the seeds 0, 1 and so on; each is held out once.
        every_s: time between two pushes [s].
        duration_s: how long each acts [s].
        least_n: smallest force [N], largest_n: largest.
        segment: that is pushed, at its COM.
    """

    runs: int = 6
    every_s: float = 0.8
    duration_s: float = 0.1
    least_n: float = 30.0
    largest_n: float = 100.0
    segment: str = "pelvis"

    def __post_init__(self) -> None:
        if self.runs < 3:
            raise SettingError(f"{self.runs} runs; valid: 3 or more, as each is held out once")
        if not 0 < self.duration_s < self.every_s or not 0 <= self.least_n <= self.largest_n:
            raise SettingError(f"excitation {self}; valid: 0 < duration_s < every_s, 0 <= least_n <= largest_n")


def pushed_runs(
    motion: Motion,
    settings: ExcitationSettings,
    controller: str | ControllerFactory = "mpc",
    simulation: SimulationSettings | None = None,
    on_progress: Callable[[int], None] | None = None,
) -> list[ComSignals]:
    """Signals of the runs, those left out that fell early or left the floor.

    Args:
        motion: to track, straight on: forces and laws are in the axes of its mean heading.
        settings: the pushes.
        controller: as of `simprep.track`.
        simulation: as of `simprep.track`; the pushes are added to its pushes.
        on_progress: called with the number of runs finished.
    """
    simulation, found = simulation or SimulationSettings(), []
    for seed in range(settings.runs):
        pushes = random_pushes(settings, motion.duration, np.random.default_rng(seed))
        run = track(motion, controller, seed, replace(simulation, pushes=(*simulation.pushes, *pushes)))
        signals = com_signals(run, pushes)
        if signals is not None:
            found.append(signals)
        if on_progress:
            on_progress(seed + 1)
    return found


def random_pushes(settings: ExcitationSettings, duration: float, generator: np.random.Generator) -> tuple[Push, ...]:
    """Horizontal pushes of random directions and sizes over a motion of that duration [s]."""
    pushes = []
    for start in np.arange(settings.every_s, duration - settings.every_s, settings.every_s):
        angle = generator.uniform(0, 2 * np.pi)
        force = generator.uniform(settings.least_n, settings.largest_n)
        vector = (float(force * np.cos(angle)), float(force * np.sin(angle)), 0.0)
        pushes.append(Push(settings.segment, float(start), settings.duration_s, vector))
    return tuple(pushes)


def identify(signals: Sequence[ComSignals], seed: int = 0) -> ComLaws:
    """The laws of runs of one motion.

    Raises:
        MotionError: fewer than three runs are usable.
    """
    if len(signals) < 3:
        raise MotionError(f"{len(signals)} usable runs; valid: 3 or more that stay on the floor for a second")
    return fit_com_laws(signals, np.random.default_rng(seed))


def predicted_pushes(motion: Motion, laws: ComLaws, signals: Sequence[ComSignals], push: PushSettings) -> list[Any]:
    """For each direction of the settings the largest push predicted [N], None where a law is not good enough.

    `capture_n`: by the plant, the best that feet in their place can do; `steps_n`: with steps; `closed_loop_n`: by the closed
    loop, which shows what the controller does with feet in their place (standing only: its pressure at rest is the runs' mean). A push
    along one axis needs the loop of that axis only, which is then taken as not coupled to the other.
    `pendulum_n`, `pendulum_steps_n`: as the first two, by g / height in place of the identified law.
    """
    mass = float(motion.character.model.body_mass.sum())
    frame = round(push.at_s * motion.fps)
    # the velocity of one frame is that of its neighbours
    first, after = max(0, frame - 1), min(len(motion), frame + 2)
    poses = forward_kinematics(motion.qpos[first:after], motion.character)
    span = (after - first - 1) / motion.fps
    com = poses.com[frame - first]
    velocity = (poses.com[-1] - poses.com[0]) / span
    heading = float(yaw(motion.qpos[frame, 3:7]))
    c, s = np.cos(heading), np.sin(heading)
    turn = np.array([[c, -s], [s, c]])
    points, mask = support_points(poses.foot_points, motion.contacts[first:after])
    polygon = polygons(points, mask)[frame - first] @ turn
    xcom = extrapolated_com(com[None], velocity[None])[0] @ turn
    rest = np.mean([one.pressure.mean(axis=0) - one.com.mean(axis=0) for one in signals], axis=0) + com[:2] @ turn
    omega = [law.of("lever") if law.reported and law.of("lever") > 0 else None for law in laws.plant]
    standing = float(np.linalg.norm(velocity[:2])) < 0.05 and len(polygon) > 2 and _inside(polygon, rest)
    rows: list[Any] = []
    for degrees in push.directions_deg:
        direction = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
        row: dict[str, Any] = {"direction_deg": degrees}
        identified = _along(omega, direction)
        for name, value, steps in (
            ("capture_n", identified, False), ("steps_n", identified, True),
            ("pendulum_n", laws.expected_per_s2, False), ("pendulum_steps_n", laws.expected_per_s2, True),
        ):  # fmt: skip
            row[name] = None
            if value is not None and len(polygon):
                row[name] = capture_push(polygon, xcom, direction, value, mass, push.duration_s, steps)
        row["closed_loop_n"] = None
        matrix = _loop_along(laws, direction)
        if standing and omega[0] and omega[1] and matrix is not None:
            row["closed_loop_n"] = closed_loop_push(
                matrix, polygon - rest, direction, (omega[0], omega[1]), mass, push.duration_s
            )
        rows.append(row)
    return rows


def laws_record(laws: ComLaws) -> dict[str, Any]:
    """The laws in JSON's types; of a law that is not good enough, R^2 alone."""
    return {
        "expected_per_s2": laws.expected_per_s2,
        "plant": {axis: _law_record(law) for axis, law in zip(AXES, laws.plant)},
        "loop": {axis: _law_record(law) for axis, law in zip(AXES, laws.loop)},
        "eigenvalues_per_s": [asdict(value) for value in loop_eigenvalues(laws)],
    }


def _law_record(law: SparseLaw) -> dict[str, Any]:
    judged: dict[str, Any] = {
        "reported": law.reported,
        "held_out_r2": law.held_out_r2,
        "least_squares_r2": law.least_squares_r2,
        "pendulum_r2": law.baseline_r2,
        "n_runs": law.run_count,
    }
    if not law.reported:
        return judged
    rows = zip(law.names, law.units, law.coefficients, law.low, law.high, law.share)
    judged["terms"] = [
        {"term": name, "unit": unit, "value": value, "low": low, "high": high, "ensemble_share": share}
        for name, unit, value, low, high, share in rows
        if value != 0
    ]
    return judged


def _along(omega_squared: Sequence[float | None], direction: FloatArray) -> float | None:
    """omega^2 of the plant along a direction; None where an axis that it needs has none."""
    total = 0.0
    for weight, value in zip((direction**2).tolist(), omega_squared):
        if weight > 1e-9:
            if value is None:
                return None
            total += weight * value
    return total


def _loop_along(laws: ComLaws, direction: FloatArray) -> FloatArray | None:
    """Closed loop (4, 4) for pushes in a direction; None where an axis that it needs is not known well enough."""
    known = [law.reported for law in laws.loop]
    if all(known):
        return loop_matrix(laws.loop[0].coefficients, laws.loop[1].coefficients)
    axis = int(np.argmax(np.abs(direction)))
    if not known[axis] or abs(direction[1 - axis]) > 1e-9:
        return None
    alone = laws.loop[axis].coefficients * np.array([1.0, 1.0, 1.0, 0.0, 0.0])
    return loop_matrix(alone, alone)


def _inside(polygon: FloatArray, point: FloatArray) -> bool:
    edges = np.roll(polygon, -1, axis=0) - polygon
    away = point - polygon
    return bool((edges[:, 0] * away[:, 1] - edges[:, 1] * away[:, 0] > 0).all())
