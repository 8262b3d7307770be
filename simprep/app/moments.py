"""What is measured of a simulated world for the page: balance on the floor, hits, and the last minute of it all."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from simprep.app.director import Caption
from simprep.arrays import BoolArray, FloatArray
from simprep.metrics.balance import extrapolated_com
from simprep.motion.support import polygons, signed_distance
from simprep.physics.bodies import SceneBody, geom_owners
from simprep.physics.ground import LEAST_LOAD_N, GroundReader

HISTORY_S, FPS = 60.0, 60
"""How far back one can look [s], and how many moments are kept of every second."""
BREAK_S = 1 / 60
"""Touches of the same two things within this time are one hit [s]."""


@dataclass(frozen=True)
class FloorMarks:
    """Balance of one body on the floor, measured in the simulation.

    Attributes:
        com: (2,) centre of mass [m].
        xcom: (2,) extrapolated centre of mass [m].
        pressure: (2,) centre of pressure; NaN where nothing presses [m].
        polygon: (k, 2) corners of the support polygon of the loaded feet, none in flight [m].
        margin: of stability: XcoM to the polygon's edge, positive inside; NaN in flight [m].
        contacts: (2,) loaded feet.
    """

    com: FloatArray
    xcom: FloatArray
    pressure: FloatArray
    polygon: FloatArray
    margin: float
    contacts: BoolArray


class FloorReader:
    """Reads the balance of one body from the simulated world."""

    def __init__(self, model: mujoco.MjModel, body: SceneBody) -> None:
        self._model, self._ground, self._root = model, GroundReader(model, body), body.segments.start
        own = np.flatnonzero((model.geom_bodyid >= body.segments.start) & (model.geom_bodyid < body.segments.stop))
        self._soles = own[0] + body.character.sole_geoms  # (2, N)
        self._radius = model.geom_size[self._soles, 0]

    def read(self, data: mujoco.MjData) -> FloorMarks:
        """Balance after a step; contacts and positions are those of its beginning."""
        mujoco.mj_subtreeVel(self._model, data)
        reading = self._ground.read(data)
        contacts = reading.foot_force[:, 2] > LEAST_LOAD_N
        points = data.geom_xpos[self._soles][None, ..., :2].reshape(1, -1, 2)
        mask = np.repeat(contacts, self._soles.shape[1])[None]
        com, velocity = data.subtree_com[self._root][None], data.subtree_linvel[self._root][None]
        xcom = extrapolated_com(com, velocity)
        margin = float(signed_distance(points, mask, xcom)[0])
        polygon = polygons(points, mask)[0]
        return FloorMarks(com[0, :2].copy(), xcom[0], reading.centre_of_pressure, polygon, margin, contacts)


@dataclass
class Hit:
    """Two things that touch: two bodies, or a body and a thing that moves or stands in the world.

    Attributes:
        parts: names of the two, the struck one last.
        start: time of the first touch [s].
        last: time of the last one so far [s].
        impulse: so far [N s].
        peak: largest force so far [N].
        position: (3,) where, at the peak [m].
    """

    parts: tuple[str, str]
    start: float
    last: float
    impulse: float
    peak: float
    position: FloatArray


class HitReader:
    """Follows touches that are not of the floor, step by step; keeps those of the last minute."""

    def __init__(self, model: mujoco.MjModel, bodies: Sequence[SceneBody]) -> None:
        self._model, self._buffer = model, np.zeros(6)
        self._floor = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, "floor")
        self._owner, _ = geom_owners(model, bodies)
        self._body = np.array(model.geom_bodyid)
        self.hits: deque[Hit] = deque(maxlen=200)

    def step(self, data: mujoco.MjData) -> None:
        """Read a step; `data` is taken after it."""
        if not data.ncon:
            return
        pairs = data.contact.geom
        owner = self._owner[pairs]
        # both things of one owner are a body that touches itself, or two things of the world
        found = np.flatnonzero((pairs != self._floor).all(axis=1) & (owner[:, 0] != owner[:, 1]))
        dt = self._model.opt.timestep
        sums: dict[tuple[str, str], tuple[FloatArray, FloatArray]] = {}
        for index in found:
            geoms = pairs[index][np.argsort(-owner[index])] if (owner[index] < 0).any() else pairs[index]
            mujoco.mj_contactForce(self._model, data, int(index), self._buffer)
            force = data.contact.frame[index].reshape(3, 3).T @ self._buffer[:3]
            if geoms[0] != pairs[index][0]:
                force = -force
            key = self._name(int(geoms[0])), self._name(int(geoms[1]))
            before = sums.get(key, (np.zeros(3), data.contact.pos[index].copy()))
            sums[key] = before[0] + force, before[1]
        for parts, (force, position) in sums.items():
            size = float(np.linalg.norm(force))
            hit = next((one for one in reversed(self.hits) if one.parts == parts), None)
            if hit is None or data.time - hit.last > BREAK_S:
                hit = Hit(parts, data.time, data.time, 0.0, 0.0, position)
                self.hits.append(hit)
            hit.last, hit.impulse = data.time, hit.impulse + size * dt
            if size > hit.peak:
                hit.peak, hit.position = size, position

    def _name(self, geom: int) -> str:
        body = int(self._body[geom])
        return str(self._model.body(body).name if body else self._model.geom(geom).name)


@dataclass(frozen=True)
class Moment:
    """What the page shows of one instant.

    Attributes:
        time: simulated [s].
        bodies: (nq,) pose of each body.
        references: (nq,) of each body's reference.
        things: (N, 7) places of what moves freely.
        marks: balance of each body.
        caption: what is to be said.
        hits: the touches of the last half second: parts, impulse so far [N s], position.
        push: (3,) outside force at this moment [N].
        fallen: numbers of the bodies that are down.
        pushed: numbers of the bodies on which it acts.
    """

    time: float
    bodies: tuple[FloatArray, ...]
    references: tuple[FloatArray, ...]
    things: FloatArray
    marks: tuple[FloorMarks, ...]
    caption: Caption
    hits: tuple[tuple[tuple[str, str], float, tuple[float, float, float]], ...]
    push: tuple[float, float, float]
    fallen: tuple[int, ...]
    pushed: tuple[int, ...] = (0,)


class History:
    """The last minute; older moments are forgotten."""

    def __init__(self, seconds: float = HISTORY_S) -> None:
        self._moments: deque[Moment] = deque(maxlen=max(2, round(seconds * FPS)))

    def __len__(self) -> int:
        return len(self._moments)

    def add(self, moment: Moment) -> None:
        """Note the newest moment."""
        self._moments.append(moment)

    def clear(self) -> None:
        """Forget everything."""
        self._moments.clear()

    def all(self) -> list[Moment]:
        """Oldest first."""
        return list(self._moments)

    def back(self, seconds: float) -> Moment | None:
        """The moment so many seconds before the newest, or the oldest one; None where there is none."""
        moments = self._moments
        if not moments:
            return None
        return moments[max(0, len(moments) - 1 - round(max(seconds, 0.0) * FPS))]

    def between(self, seconds: float) -> tuple[Moment, Moment, float] | None:
        """The moments around a time so many seconds before the newest, and the time's share of the way between them."""
        whole, share = divmod(max(seconds, 0.0) * FPS, 1.0)
        before, after = self.back((whole + 1) / FPS), self.back(whole / FPS)
        return None if before is None or after is None else (before, after, 1.0 - share)
