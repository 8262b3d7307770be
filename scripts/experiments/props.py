"""How near a part of the body comes to a thing."""

from dataclasses import dataclass, replace

import mujoco
import numpy as np

from simprep.arrays import FloatArray
from simprep.motion.motion import Motion
from simprep.scene import Obstacle, SceneSettings, scene_spec

STRIKES_S = 1.2
"""A strike is looked for so long after its launch [s]."""
FARTHEST_M = 5.0
"""Distances beyond are not measured."""


@dataclass(frozen=True)
class Pass:
    """How a part of the body passes a thing.

    Attributes:
        miss_m: least distance between their surfaces [m]; 0 where they touch.
        frame: of the motion, at the first touch, or where they are nearest.
        touches: whether they touch.
        normal: (3,) at that frame, from the part to the thing; of length 1.
        velocity: (3,) of the part's nearest point [m/s], world.
    """

    miss_m: float
    frame: int
    touches: bool
    normal: FloatArray
    velocity: FloatArray


def nearest_pass(motion: Motion, segment: str, thing: Obstacle, first: int = 0, after: int | None = None) -> Pass:
    """How near a segment comes to a thing in frames first to after - 1.

    Args:
        motion: the motion, simulated or not.
        segment: name of the segment.
        thing: it stays where it is.
        first: of the frames.
        after: behind the last of the frames; None for all.
    """
    model = scene_spec(SceneSettings((motion.character,), (replace(thing, mass=0.0),))).compile()
    data = mujoco.MjData(model)
    body, target = model.body(segment).id, model.geom(thing.name).id
    geoms = [int(geom) for geom in np.flatnonzero(model.geom_bodyid == body)]
    least, frame, ends = np.inf, first, np.zeros(6)
    for at in range(first, len(motion) if after is None else min(after, len(motion))):
        data.qpos[:] = motion.qpos[at]
        mujoco.mj_kinematics(model, data)
        between = np.zeros(6)
        for geom in geoms:
            distance = mujoco.mj_geomDistance(model, data, geom, target, FARTHEST_M, between)
            if distance < least:
                least, frame, ends = distance, at, between.copy()
        if least <= 0:
            break
    # the distance's sign: where they overlap, the way from the part to the thing is backwards
    way = (ends[3:] - ends[:3]) * (1.0 if least > 0 else -1.0)
    length = float(np.linalg.norm(way))
    normal = way / length if length > 1e-9 else np.zeros(3)
    return Pass(max(0.0, float(least)), frame, least <= 0, normal, _velocity(model, motion, body, frame, ends[:3]))


def miss_m(motion: Motion, segment: str, thing: Obstacle, launch_s: float) -> float:
    """By how much a strike launched at a time misses a thing [m]; 0 where it meets it.

    NaN where the motion is over before the launch.
    """
    first = round(launch_s * motion.fps)
    if first >= len(motion):
        return float("nan")
    return nearest_pass(motion, segment, thing, first, first + round(STRIKES_S * motion.fps)).miss_m


def clearance_m(motion: Motion, thing: Obstacle, first: int, after: int, every: int = 2) -> float:
    """Least distance between the surfaces of the whole body and of a thing [m]; below 0 where they touch.

    Args:
        motion: the motion, simulated or not.
        thing: it stays where it is.
        first: of the frames.
        after: behind the last of them.
        every: only one frame of so many is looked at.
    """
    model = scene_spec(SceneSettings((motion.character,), (replace(thing, mass=0.0),))).compile()
    data, target = mujoco.MjData(model), model.geom(thing.name).id
    geoms = [int(geom) for geom in np.flatnonzero(model.geom_bodyid > 0)]
    least = np.inf
    for at in range(first, min(after, len(motion)), every):
        data.qpos[:] = motion.qpos[at]
        mujoco.mj_kinematics(model, data)
        for geom in geoms:
            least = min(least, mujoco.mj_geomDistance(model, data, geom, target, FARTHEST_M, None))
    return float(least)


def _velocity(model: mujoco.MjModel, motion: Motion, body: int, frame: int, point: FloatArray) -> FloatArray:
    """Velocity (3,) of a point of a body [m/s], by central difference."""
    data, local = mujoco.MjData(model), np.zeros(3)
    places: list[FloatArray] = []
    low, high = max(frame - 1, 0), min(frame + 1, len(motion) - 1)
    for at in (frame, low, high):
        data.qpos[:] = motion.qpos[at]
        mujoco.mj_kinematics(model, data)
        rotation = data.xmat[body].reshape(3, 3)
        if at == frame and not places:
            local = rotation.T @ (point - data.xpos[body])
        places.append(data.xpos[body] + rotation @ local)
    return np.asarray((places[2] - places[1]) * motion.fps / max(high - low, 1))
