"""What a replay shows: bodies with their reference, forces, marks and things in the world."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from simprep.arrays import FloatArray
from simprep.errors import SettingError
from simprep.motion.motion import Motion
from simprep.physics.contacts import BodyContact
from simprep.physics.run import DONE, Run
from simprep.report.figures import COLOURS, body_colour
from simprep.scene import Obstacle

FLASHES = 200
"""Most contacts that are shown."""
LEAST_NS = 0.5
"""A contact with less impulse is not shown [N s]."""
FLASH_S = 0.2
"""A contact is shown at least so long [s]."""


@dataclass(frozen=True)
class Actor:
    """One body of a replay.

    Attributes:
        label: written above it.
        motion: what is shown solid.
        reference: shown transparent at the same place, where there is one.
        colour: of the body, as `#rrggbb`.
        place: (x, y) by which body and reference are moved on the floor [m].
        end_note: written where the motion is over before the replay is, such as `fell at 2.31 s`.
        ground_force: (N, 3) force of the floor on the body at the motion's frames [N]; N 0 where it is not known.
        centre_of_pressure: (N, 2) where it acts [m], NaN where nothing is borne.
    """

    label: str
    motion: Motion
    reference: Motion | None = None
    colour: str = COLOURS[2]
    place: tuple[float, float] = (0.0, 0.0)
    end_note: str = ""
    ground_force: FloatArray | None = None
    centre_of_pressure: FloatArray | None = None


@dataclass(frozen=True)
class Flash:
    """Something that happens at an instant and a place, such as a hit.

    Attributes:
        start_s: from when it is shown [s].
        duration_s: how long [s]; `FLASH_S` at least.
        position: (x, y, z) world [m].
        radius: of the ball that shows it [m].
        label: written beside it.
    """

    start_s: float
    duration_s: float
    position: tuple[float, float, float]
    radius: float
    label: str = ""


@dataclass(frozen=True)
class Prop:
    """A thing that moves: its shape, and where it is.

    Attributes:
        shape: the shape; its own position is not used.
        positions: (N, 3) world [m].
        fps: of the positions [1/s].
        orientations: (N, 4) quaternions, wxyz; None: it does not turn.
    """

    shape: Obstacle
    positions: FloatArray
    fps: float
    orientations: FloatArray | None = None

    def at(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Positions (T, 3) [m] and orientations (T, 4) at instants (T,) [s], held at the ends."""
        known = np.arange(len(self.positions)) / self.fps
        places = np.stack([np.interp(times, known, column) for column in self.positions.T], axis=1)
        if self.orientations is None:
            return places, np.repeat([[1.0, 0.0, 0.0, 0.0]], len(times), axis=0)
        nearest = np.clip(np.rint(np.asarray(times) * self.fps).astype(int), 0, len(self.orientations) - 1)
        return places, self.orientations[nearest]


@dataclass(frozen=True)
class Replay:
    """Bodies in one world, over the same time.

    Attributes:
        title: names the replay where a page has several.
        actors: at least one.
        obstacles: things that stay where they are.
        props: things that move.
        flashes: what happens at an instant.
        marks: labels of instants [s], such as `{"launch": 2.1}`.
    """

    title: str
    actors: tuple[Actor, ...]
    obstacles: tuple[Obstacle, ...] = ()
    props: tuple[Prop, ...] = ()
    flashes: tuple[Flash, ...] = ()
    marks: tuple[tuple[str, float], ...] = ()

    def __post_init__(self) -> None:
        if not self.actors:
            raise SettingError("a replay of no body; valid: 1 or more")

    @property
    def duration(self) -> float:
        """Time until the last body's motion ends [s]."""
        return max(actor.motion.duration for actor in self.actors)


def end_note(run: Run) -> str:
    """How a run ended, where it did not complete, such as `fell at 2.31 s`."""
    return "" if run.end == DONE else f"{run.end} at {run.end_s:.2f} s"


def run_actor(run: Run, label: str = "", colour: str = COLOURS[2]) -> Actor:
    """A simulated body with its reference and the force of the floor.

    Args:
        run: of one body; of several give `run.body(k)`.
        label: written above it; empty for the controller's name.
        colour: as `#rrggbb`.
    """
    return Actor(
        label=label or f"simulated, {run.controller}",
        motion=run.simulated_motion(),
        reference=run.reference,
        colour=colour,
        end_note=end_note(run),
        ground_force=run.ground_force,
        centre_of_pressure=run.centre_of_pressure,
    )


def run_replay(run: Run, title: str = "") -> Replay:
    """A run of one body, or of several with their contacts as flashes."""
    if len(run.bodies) == 1:
        return Replay(title or run.reference.name, (run_actor(run),), marks=event_marks(run.reference))
    actors = tuple(
        run_actor(run.body(number), body.reference.name, body_colour(number)[1])
        for number, body in enumerate(run.bodies)
    )
    flashes = contact_flashes(run.contacts, ["" for _ in run.contacts])
    return Replay(title or " and ".join(actor.label for actor in actors), actors, flashes=flashes)


def contact_flashes(contacts: Sequence[BodyContact], words: Sequence[str]) -> tuple[Flash, ...]:
    """The `FLASHES` hardest contacts between bodies as balls with their impulse, the larger the harder.

    Args:
        contacts: of a run.
        words: of each contact, what is written before its impulse.
    """
    pairs = sorted(zip(contacts, words), key=lambda pair: -pair[0].impulse_ns)[:FLASHES]
    return tuple(
        Flash(
            one.start_s,
            one.duration_s,
            one.position,
            float(np.clip(0.03 * np.sqrt(one.impulse_ns), 0.03, 0.15)),
            f"{word} {one.impulse_ns:.1f} N s".strip(),
        )
        for one, word in sorted(pairs, key=lambda pair: pair[0].start_s)
        if one.impulse_ns >= LEAST_NS
    )


def motion_replay(motion: Motion, title: str = "") -> Replay:
    """A motion as it is, without physics."""
    return Replay(title or motion.name, (Actor(motion.name, motion),), marks=event_marks(motion))


def event_marks(motion: Motion) -> tuple[tuple[str, float], ...]:
    """Events of a motion and their times [s]."""
    return tuple((name, frame / motion.fps) for name, frame in motion.events.items())


def side_by_side(actors: Sequence[Actor], spacing: float = 1.4) -> tuple[Actor, ...]:
    """Actors moved apart to the side of where the first one goes, the first farthest left.

    Args:
        actors: the bodies.
        spacing: distance from one to the next [m].
    """
    if not actors:
        return ()
    root = actors[0].motion.qpos[:, :3]
    way = root[-1, :2] - root[0, :2]
    if np.linalg.norm(way) < 0.5:  # it stays: its own forward direction
        w, x, y, z = actors[0].motion.qpos[0, 3:7]
        way = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z)])
    forward = way / max(float(np.linalg.norm(way)), 1e-9)
    left = np.array([-forward[1], forward[0]])
    middle = (len(actors) - 1) / 2
    moved = []
    for number, actor in enumerate(actors):
        x, y = spacing * (middle - number) * left
        moved.append(replace(actor, place=(float(x), float(y))))
    return tuple(moved)
