"""Simulate a motion among things that collide: balls that fly, bars that stop who does not clear them."""

from collections.abc import Mapping, Sequence

import numpy as np

from simprep.motion.motion import Motion
from simprep.physics.run import Run
from simprep.physics.settings import SimulationSettings
from simprep.physics.tracker import Tracker
from simprep.report.replay.actor import Prop
from simprep.scene import Obstacle, SceneSettings

FPS = 60.0
"""Of what is kept of the things."""


def simulate_among(motion: Motion, things: Sequence[Obstacle], seed: int) -> tuple[Run, dict[str, Prop]]:
    """Track a motion with mpc in a world of things; it does not follow from its reference that they are there.

    Args:
        motion: what to track.
        things: what stands around; those with a mass move when they are hit.
        seed: of the controller's random numbers.

    Returns:
        The run, and where each thing with a mass was.
    """
    settings = SimulationSettings(scene=SceneSettings(obstacles=tuple(things)))
    tracker = Tracker([motion.character], None, seed, "mpc", settings, stands=False)
    tracker.extend(motion)
    free = [thing for thing in things if thing.mass]
    starts = [int(tracker.model.jnt_qposadr[tracker.model.joint(thing.name).id]) for thing in free]
    every = max(1, round(1 / FPS / tracker.timestep))
    kept = []
    number = 0
    while not tracker.end:
        if number % every == 0 and number:
            kept.append([tracker.data.qpos[start : start + 7].copy() for start in starts])
        tracker.step()
        number += 1
    if free:
        kept = [[np.array([*thing.position, 1.0, 0.0, 0.0, 0.0]) for thing in free], *kept]
    rate = 1 / (every * tracker.timestep)
    way = np.array(kept, dtype=np.float64).reshape(len(kept), len(free), 7)
    props = {thing.name: Prop(thing, way[:, k, :3], rate, way[:, k, 3:]) for k, thing in enumerate(free)}
    return tracker.run(), props


def fastest_m_s(prop: Prop) -> float:
    """Largest speed of a thing [m/s]."""
    if len(prop.positions) < 2:
        return 0.0
    return float(np.linalg.norm(np.diff(prop.positions, axis=0), axis=1).max() * prop.fps)


def as_arrays(props: Mapping[str, Prop]) -> dict[str, np.ndarray]:
    """Positions and orientations (N, 7) by name."""
    none = np.array([1.0, 0.0, 0.0, 0.0])
    return {
        name: np.hstack([prop.positions, none + np.zeros((len(prop.positions), 4)) if prop.orientations is None else prop.orientations])
        for name, prop in props.items()
    }  # fmt: skip
