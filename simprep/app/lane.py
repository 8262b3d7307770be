"""One simulated world of the page: a scene, who leads its bodies in which arm, and what is measured of them.

Two lanes show two arms side by side: the same scene, controller and seed, each in a world of its own. Only for drawing is the second
one shifted to the side.
"""

from dataclasses import replace

import numpy as np

from simprep.app.director import Director, Point
from simprep.app.moments import FPS, FloorMarks, FloorReader, Moment
from simprep.app.page_tracker import PageTracker
from simprep.app.stage import Stage
from simprep.arrays import FloatArray
from simprep.errors import SettingError
from simprep.physics.controller import ControllerFactory
from simprep.physics.pushes import Push
from simprep.physics.settings import SimulationSettings
from simprep.scene import SceneSettings

LANE_M = 2.5
"""How far to the left the second lane is drawn [m]."""
BESIDE = "beside_"
"""Before the names of the second lane's things."""
NO_PUSH = (0.0, 0.0, 0.0)


class Lane:
    """A world that goes on a moment at a time.

    Args:
        stage: the scene.
        director: who leads the bodies.
        preset, seed, controller: of the `Tracker`.
    """

    def __init__(
        self, stage: Stage, director: Director, preset: str | None, seed: int, controller: str | ControllerFactory
    ) -> None:
        self.director = director
        world = SceneSettings(obstacles=stage.obstacles)
        self.tracker = PageTracker(director.characters, preset, seed, controller, SimulationSettings(scene=world))
        director.begin(self.tracker)
        model = self.tracker.model
        self._floor = [FloorReader(model, body) for body in self.tracker.bodies]
        self._things = np.array([int(model.jnt_qposadr[model.joint(one.name).id]) for one in stage.moving], dtype=int)
        self._push: tuple[float, float, tuple[float, float, float], int] | None = None

    @property
    def own_place(self) -> Point:
        """Where the led character's reference is [m]."""
        pose = self.tracker.state.reference_qpos[0]
        return float(pose[0]), float(pose[1])

    def place_of(self, thing: int) -> FloatArray:
        """(3,) place of something that moves freely, a number in `Stage.moving` [m]."""
        return np.asarray(self.tracker.data.qpos[self._things[thing] :][:3])

    def push(self, force: tuple[float, float, float], seconds: float, body: int, segment: int) -> str:
        """Push a segment of a body from now on [N, s]; its name. SettingError if there is none of that number."""
        bodies = self.tracker.bodies
        if not (0 <= body < len(bodies) and 0 <= segment < len(bodies[body].segment_names)):
            raise SettingError(f"nothing to push: body {body}, segment {segment}; valid: numbers of what is drawn")
        name = bodies[body].prefix + bodies[body].segment_names[segment]
        now = self.tracker.state.time
        self.tracker.push(Push(name, now, seconds, force))
        self._push = (now, now + seconds, force, body)
        return name

    def moment(self) -> Moment:
        """What is to be shown now."""
        state, data = self.tracker.state, self.tracker.data
        push, pushed = NO_PUSH, 0
        if self._push is not None and self._push[0] <= state.time <= self._push[1] + 1 / FPS:
            push, pushed = self._push[2:]
        return Moment(
            time=state.time,
            bodies=state.bodies_qpos,
            references=state.reference_qpos,
            things=np.array([data.qpos[at : at + 7] for at in self._things]).reshape(-1, 7),
            marks=tuple(reader.read(data) for reader in self._floor),
            caption=self.director.caption(state.time),
            hits=tuple(
                (hit.parts, hit.impulse, (float(hit.position[0]), float(hit.position[1]), float(hit.position[2])))
                for hit in self.tracker.hits.hits
                if hit.last > state.time - 0.5
            ),
            push=push,
            pushed=(pushed,),
            fallen=state.fallen,
        )


def both(first: Moment, second: Moment, arms: tuple[str, str]) -> Moment:
    """Two lanes' moments as one: the second one's bodies come after the first one's, and stand beside them.

    Args:
        first: of the first lane.
        second: of the second one, at the same time.
        arms: what each is called; said before what it is doing.
    """
    count = len(first.bodies)
    pushed = (
        *(first.pushed if any(first.push) else ()),
        *((count + one for one in second.pushed) if any(second.push) else ()),
    )
    return replace(
        first,
        bodies=(*first.bodies, *map(_aside, second.bodies)),
        references=(*first.references, *map(_aside, second.references)),
        things=np.concatenate([first.things, _aside(second.things)]),
        marks=(*first.marks, *map(_marks_aside, second.marks)),
        caption=replace(
            first.caption,
            doing=tuple(f"{arm}: {', '.join(moment.caption.doing)}" for arm, moment in zip(arms, (first, second))),
        ),
        hits=(*first.hits, *((parts, impulse, (x, y + LANE_M, z)) for parts, impulse, (x, y, z) in second.hits)),
        push=first.push if any(first.push) else second.push,
        pushed=pushed or (0,),
        fallen=(*first.fallen, *(count + one for one in second.fallen)),
    )


def both_stages(stage: Stage) -> Stage:
    """What is drawn of two lanes: everything twice."""
    return replace(
        stage,
        obstacles=(
            *stage.obstacles,
            *(
                replace(
                    one, name=BESIDE + one.name, position=(one.position[0], one.position[1] + LANE_M, one.position[2])
                )
                for one in stage.obstacles
            ),
        ),
    )


def _aside(pose: FloatArray) -> FloatArray:
    """A pose (..., n) whose second number is y [m], beside itself."""
    moved = pose.copy()
    moved[..., 1] += LANE_M
    return moved


def _marks_aside(marks: FloorMarks) -> FloorMarks:
    return replace(
        marks,
        com=_aside(marks.com),
        xcom=_aside(marks.xcom),
        pressure=_aside(marks.pressure),
        polygon=_aside(marks.polygon),
    )
