"""The reference a controller tracks: a motion brought to the simulation rate, smoothed and lifted out of the floor."""

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from simprep.arrays import FloatArray
from simprep.errors import MotionError
from simprep.motion.edit import resample, sample
from simprep.motion.kinematics import Kinematics, body_clearance, forward_kinematics
from simprep.motion.motion import Motion, differentiate
from simprep.motion.rotations import continuous_quat


@dataclass(frozen=True)
class ReferenceSettings:
    """What is done to a motion before it is tracked; recorded with the run.

    Attributes:
        smoothing: standard deviation of the Gaussian over poses [s]; 0 for none. Servos cannot follow the second
            derivative of captured noise.
        lift: raise the root by a slowly varying offset so that no geom is in the floor.
        lift_smoothing: standard deviation of the Gaussian over that offset [s].
    """

    smoothing: float = 0.02
    lift: bool = True
    lift_smoothing: float = 0.1


@dataclass(frozen=True)
class Reference:
    """A motion sampled at every simulation step, steps 0 to N.

    Attributes:
        motion: the processed motion at the simulation rate.
        qpos: (N + 1, nq).
        qvel: (N + 1, nv).
        kinematics: positions at every step.
        clearance: (N + 1, segments) height of each segment's lowest geom point above the floor [m].
        processing: what was done, for the record.
    """

    motion: Motion
    qpos: FloatArray
    qvel: FloatArray
    kinematics: Kinematics
    clearance: FloatArray
    processing: dict[str, Any]


def make_reference(motion: Motion, timestep: float, settings: ReferenceSettings | None = None) -> Reference:
    """Process a motion for tracking.

    Args:
        motion: the motion; loops are tracked for one cycle (repeat them first).
        timestep: simulation step [s].
        settings: smoothing and lift.

    Raises:
        MotionError: fewer than two frames.
    """
    return process(at_rate(motion, timestep), settings or ReferenceSettings())


def at_rate(motion: Motion, timestep: float) -> Motion:
    """A motion with a frame for each simulation step.

    Args:
        motion: as of `make_reference`.
        timestep: simulation step [s].

    Raises:
        MotionError: fewer than two frames.
    """
    if len(motion) < 2:
        raise MotionError(f"{motion.name}: {len(motion)} frame; tracking needs at least 2")
    fps = 1.0 / timestep
    plain = replace(motion, loop=False)
    steps = int(np.floor(plain.duration * fps + 1e-9))
    qpos = sample(plain, np.arange(steps + 1, dtype=np.float64) * timestep)
    resampled = resample(plain, fps)
    contacts = resampled.contacts[np.minimum(np.arange(steps + 1), len(resampled) - 1)]
    events = {key: min(frame, steps) for key, frame in resampled.events.items()}
    return replace(plain, qpos=qpos, fps=fps, contacts=contacts, events=events)


def process(motion: Motion, settings: ReferenceSettings) -> Reference:
    """Smooth a motion that has a frame for each simulation step, and lift it out of the floor.

    Args:
        motion: of `at_rate`.
        settings: smoothing and lift.
    """
    qpos, fps = motion.qpos.copy(), motion.fps
    if settings.smoothing > 0:
        qpos = _smooth(qpos, settings.smoothing * fps)
    clearance = body_clearance(qpos, motion.character)
    lift = np.zeros(len(qpos))
    if settings.lift:
        lift = lift_offset(-clearance.min(axis=1), settings.lift_smoothing * fps)
        qpos[:, 2] += lift
        clearance = clearance + lift[:, None]
    processed = replace(motion, qpos=qpos)
    return Reference(
        motion=processed,
        qpos=processed.qpos,
        qvel=differentiate(processed.qpos, fps, motion.character),
        kinematics=forward_kinematics(processed.qpos, motion.character),
        clearance=clearance,
        processing={
            **asdict(settings),
            "largest_lift_m": float(lift.max()),
            "start": "on the reference; the controller may change velocities",
        },
    )


def _smooth(qpos: FloatArray, sigma: float) -> FloatArray:
    out = qpos.copy()
    out[:, 3:7] = continuous_quat(qpos[:, 3:7])
    # point reflection keeps value and slope at the ends
    pad = min(len(qpos) - 1, int(4 * sigma) + 1)
    extended = np.concatenate([2 * out[0] - out[pad:0:-1], out, 2 * out[-1] - out[-2 : -pad - 2 : -1]])
    out = gaussian_filter1d(extended, sigma, axis=0, mode="nearest")[pad : pad + len(qpos)]
    out[:, 3:7] /= np.linalg.norm(out[:, 3:7], axis=1, keepdims=True)
    return np.asarray(out)


def lift_offset(depth: FloatArray, sigma: float) -> FloatArray:
    """Smooth offset (T,), 0 or more, that is at least the depth everywhere [m].

    Args:
        depth: (T,) of the lowest point below the floor; negative above it [m].
        sigma: standard deviation of the Gaussian [frames].
    """
    needed = np.maximum(depth, 0.0)
    if needed.max() <= 0:
        return needed
    width = 2 * int(2 * sigma) + 1
    envelope = maximum_filter1d(needed, width, mode="nearest")
    return np.maximum(gaussian_filter1d(envelope, sigma, mode="nearest"), needed)
