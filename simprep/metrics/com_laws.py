"""Laws of the horizontal motion of the COM under a tracking controller, found in pushed runs.

Two laws for each floor axis. The *plant*: what the pressure under the feet does to the COM, whoever controls. The *closed loop*:
how an error of the COM against the reference dies away, the controller included.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simprep.arrays import FloatArray
from simprep.humanoid_model import GRAVITY
from simprep.metrics.identified import smooth_pressure
from simprep.metrics.smoothing import EDGE_S
from simprep.metrics.sparse_law import RESAMPLES, Samples, SparseLaw, fit_sparse_law
from simprep.motion.edit import yaw
from simprep.physics.pushes import Push
from simprep.physics.run import Run
from simprep.physics.whole_body import whole_body

AXES = ("forward", "left")
PLANT_TERMS = ("1", "v", "lever", "lever*load", "lever*rise", "lever^3", "spin")
PLANT_UNITS = ("m/s^2", "1/s", "1/s^2", "1/s^2", "1/s^2", "1/(m^2 s^2)", "1")
LOOP_TERMS = ("1", "error", "error_rate", "other_error", "other_error_rate")
LOOP_UNITS = ("m/s^2", "1/s^2", "1/s", "1/s^2", "1/s")
LOOP_WINDOW_S = 0.5
"""Width of the closed loop's windows: an answer to a push lasts a second, and the sampling of `mpc` is noise about it."""
_RATE_HZ = 120.0


@dataclass(frozen=True)
class ComSignals:
    """The COM of one run, in axes of the reference's mean heading: forward, left.

    Attributes:
        dt: spacing [s].
        com: (n, 2) [m], velocity: (n, 2) [m/s].
        error: (n, 2) of the COM against the reference's at the same time [m], error_rate: (n, 2) [m/s].
        pressure: (n, 2) centre of pressure [m].
        load: (n,) vertical force over body weight, less 1.
        height: (n,) of the COM [m].
        spin: (n, 2) rate of the angular momentum about the COM, as the acceleration that it takes from the COM [m/s^2].
        push: (n, 2) acceleration by the pushes from outside [m/s^2].
    """

    dt: float
    com: FloatArray
    velocity: FloatArray
    error: FloatArray
    error_rate: FloatArray
    pressure: FloatArray
    load: FloatArray
    height: FloatArray
    spin: FloatArray
    push: FloatArray


@dataclass(frozen=True)
class ComLaws:
    """Laws of both axes, forward and left.

    Attributes:
        plant: of the acceleration of the COM.
        loop: of the acceleration of the error.
        expected_per_s2: g / mean COM height, the linear inverted pendulum's omega^2 [1/s^2].
    """

    plant: tuple[SparseLaw, SparseLaw]
    loop: tuple[SparseLaw, SparseLaw]
    expected_per_s2: float


def com_signals(run: Run, pushes: Sequence[Push] = ()) -> ComSignals | None:
    """Signals of a run of one body at about 120 Hz; None where the body was in flight or the run is under 1 s.

    Args:
        run: of one body; of one that fell, the last 0.5 s are left out.
        pushes: that acted on it, horizontal.
    """
    stride = max(1, round(1 / run.timestep / _RATE_HZ))
    last = run.steps if run.fallen is None else run.steps - round(0.5 / run.timestep)
    edge = round(EDGE_S / run.timestep)
    rows = np.arange(edge, last - edge, stride)
    if len(rows) * stride * run.timestep < 1.0:
        return None
    force, pressure = smooth_pressure(run)
    if not np.isfinite(pressure[rows]).all():
        return None
    model = run.reference.character.model
    mass, dt = float(model.body_mass.sum()), stride * run.timestep
    nothing = np.zeros((len(rows), model.nv))
    body = whole_body(model, run.qpos[rows], run.qvel[rows], nothing)
    wanted = whole_body(model, run.reference_qpos[rows], run.reference_qvel[rows], nothing)
    headings = yaw(run.reference_qpos[rows, 3:7])
    heading = float(np.arctan2(np.sin(headings).mean(), np.cos(headings).mean()))
    c, s = np.cos(heading), np.sin(heading)
    turn = np.array([[c, -s], [s, c]])  # rows of world vectors times it: forward, left
    pushed = np.zeros((len(rows), 2))
    time = run.time[rows]
    for push in pushes:  # the mean of each sample's own interval, as its edges matter
        until = np.minimum(push.start + push.duration, time + dt / 2)
        share = np.clip((until - np.maximum(push.start, time - dt / 2)) / dt, 0.0, 1.0)
        pushed += share[:, None] * np.asarray(push.force[:2]) / mass
    moment = np.gradient(body.angular_momentum, dt, axis=0)
    # Euler's law: horizontal acceleration = omega^2 lever + (-dH_y, dH_x) / (m height)
    spin = np.stack([-moment[:, 1], moment[:, 0]], axis=1) / (mass * body.com[:, 2:3])
    flat = body.com[:, :2], body.com_velocity[:, :2], pressure[rows], spin, pushed
    com, velocity, pressure, spin, pushed = (one @ turn for one in flat)
    return ComSignals(
        dt=dt,
        com=com,
        velocity=velocity,
        error=com - wanted.com[:, :2] @ turn,
        error_rate=velocity - wanted.com_velocity[:, :2] @ turn,
        pressure=pressure,
        load=force[rows] / (mass * GRAVITY) - 1,
        height=body.com[:, 2],
        spin=spin,
        push=pushed,
    )


def fit_com_laws(runs: Sequence[ComSignals], generator: np.random.Generator, resamples: int = RESAMPLES) -> ComLaws:
    """Plant and closed loop of both axes, with held-out R^2 of each and of its baselines.

    The plant's baseline is the linear inverted pendulum, g / height times the lever. The law holds `spin` as a candidate, since a
    walking body is no pendulum fore and aft: its angular momentum changes. With all terms the plant is Newton's and Euler's law, so
    what it says is which of them matter. The closed loop is no law of nature: its terms are the tracker's, near its reference.

    Args:
        runs: of one motion and controller, 3 or more.
        generator: of the ensembles.
        resamples: size of each ensemble.
    """
    height = float(np.mean([run.height.mean() for run in runs]))
    expected = GRAVITY / height
    pendulum = np.zeros(len(PLANT_TERMS))
    pendulum[PLANT_TERMS.index("lever")] = expected
    plant = [
        fit_sparse_law(
            [_plant(run, axis, height) for run in runs],
            PLANT_TERMS,
            PLANT_UNITS,
            generator,
            pendulum,
            resamples=resamples,
        )
        for axis in (0, 1)
    ]
    loop = [
        fit_sparse_law(
            [_loop(run, axis) for run in runs],
            LOOP_TERMS,
            LOOP_UNITS,
            generator,
            window_s=LOOP_WINDOW_S,
            resamples=resamples,
        )
        for axis in (0, 1)
    ]
    return ComLaws((plant[0], plant[1]), (loop[0], loop[1]), expected)


def loop_matrix(forward: FloatArray, left: FloatArray) -> FloatArray:
    """Closed loop (4, 4) of forward and left errors, then their rates, from coefficients (5,) of `LOOP_TERMS`."""
    _, a, b, other_a, other_b = forward
    _, c, d, other_c, other_d = left
    zero, one = np.zeros((2, 2)), np.eye(2)
    stiffness = np.array([[a, other_a], [other_c, c]])
    damping = np.array([[b, other_b], [other_d, d]])
    return np.block([[zero, one], [stiffness, damping]])


@dataclass(frozen=True)
class Eigenvalue:
    """An eigenvalue of the closed loop with percentile intervals of the ensemble, real and imaginary part [1/s]."""

    real: float
    imaginary: float
    real_interval: tuple[float, float]
    imaginary_interval: tuple[float, float]


def loop_eigenvalues(laws: ComLaws) -> tuple[Eigenvalue, ...]:
    """Eigenvalues of the closed loop, least damped first: four, of both axes coupled; two of the one axis that is reported; or none.

    Negative real parts die away. One of a pair has a negative imaginary part.
    """
    axes = [axis for axis, law in enumerate(laws.loop) if law.reported]
    if not axes:
        return ()
    middle = _eigenvalues([laws.loop[axis].coefficients for axis in axes])
    drawn = np.array([_eigenvalues(list(some)) for some in zip(*(laws.loop[axis].ensemble for axis in axes))])
    result = []
    for k, value in enumerate(middle):
        real, imaginary = (np.percentile(part[:, k], [2.5, 97.5]).tolist() for part in (drawn.real, drawn.imag))
        result.append(
            Eigenvalue(float(value.real), float(value.imag), (real[0], real[1]), (imaginary[0], imaginary[1]))
        )
    return tuple(result)


def _eigenvalues(coefficients: Sequence[FloatArray]) -> np.ndarray:
    if len(coefficients) == 2:
        matrix = loop_matrix(coefficients[0], coefficients[1])
    else:
        _, stiffness, damping, *_ = coefficients[0]
        matrix = np.array([[0.0, 1.0], [stiffness, damping]])
    values = np.linalg.eigvals(matrix)
    return values[np.lexsort((values.imag, -np.round(values.real, 9)))]


def _plant(run: ComSignals, axis: int, height: float) -> Samples:
    lever = run.com[:, axis] - run.pressure[:, axis]
    rise = run.height / height - 1
    one = np.ones(len(lever))
    terms = np.stack(
        [one, run.velocity[:, axis], lever, lever * run.load, lever * rise, lever**3, run.spin[:, axis]], axis=1
    )
    return Samples(run.velocity[:, axis], terms, run.push[:, axis], run.dt)


def _loop(run: ComSignals, axis: int) -> Samples:
    other = 1 - axis
    own = run.error[:, axis], run.error_rate[:, axis], run.error[:, other], run.error_rate[:, other]
    terms = np.stack([np.ones(len(run.error)), *own], axis=1)
    return Samples(run.error_rate[:, axis], terms, run.push[:, axis], run.dt)
