"""The simulation behind the page, without any web: it is steered by calls and goes on by `advance`, a moment at a time.

    session = Session(SessionSettings(stage="ball"))
    session.begin_tasks()
    while session.time < 8:
        session.advance()

Nothing moves the bodies but their motors, except for pushes, which are asked for and shown.
"""

import re
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from simprep.app.aiming import task_at
from simprep.app.approaching import Approaching
from simprep.app.director import Director, Point
from simprep.app.dueling import Dueling
from simprep.app.moments import FPS, FloorReader, History, Moment
from simprep.app.page_tracker import PageTracker
from simprep.app.stage import BALL, LAUNCHES, STAGES, ball_on_post, ball_task, stage, struck
from simprep.duel.fight.modes import MODES
from simprep.errors import SettingError, UnknownNameError
from simprep.motion.edit import at_origin
from simprep.motion.motion import Motion
from simprep.motion.store import save_motion
from simprep.physics.controller import ControllerFactory
from simprep.physics.pushes import Push
from simprep.physics.settings import SimulationSettings
from simprep.preparation.scenario import ARMS
from simprep.scene import SceneSettings

SCENES = (*STAGES, *(f"duel {mode}" for mode in MODES))
"""What can be shown."""
FARTHEST_M, HARDEST_N, LONGEST_PUSH_S = 50.0, 1000.0, 1.0
RATE_S = 2.0
"""The rate of the simulation is measured over so much time [s]."""
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")


@dataclass(frozen=True)
class SessionSettings:
    """What a session begins with.

    Attributes:
        scene: one of `SCENES`.
        arm: one of `simprep.preparation.scenario.ARMS`.
        preset: of the tracking controller (see `Tracker`).
        controller: `mpc`, `pd` or your own.
        seed: of all chance.
        folder: where motions are saved; nothing is written outside it.
    """

    scene: str = "ball"
    arm: str = "optimised"
    preset: str = "live"
    controller: str | ControllerFactory = "mpc"
    seed: int = 0
    folder: Path = field(default=Path("results/app"))


class Session:
    """One simulation. All methods may be called from any thread; `advance` from one.

    Args:
        settings: what to begin with.
        director: makes who leads the bodies in a scene; None: the learned controller, or the fight model.

    Attributes:
        history: the last minute.
        paused: whether `advance` waits.
        told: what went wrong or was done last, in words.

    Raises:
        UnknownNameError: no such scene, arm, preset or controller.
    """

    def __init__(self, settings: SessionSettings | None = None, director: Callable[[], Director] | None = None) -> None:
        self.settings = settings or SessionSettings()
        self._custom = director
        self.lock = threading.RLock()
        self.history = History()
        self.paused = False
        self.told = ""
        self.version = 0  # another number: another world is shown
        self._ball: Point | None = None
        self._clock: deque[tuple[float, float]] = deque(maxlen=4 * FPS)
        self._steps_asked = 0
        if self.settings.arm not in ARMS:
            raise UnknownNameError("arm", self.settings.arm, ARMS)
        self.restart(self.settings.scene)

    @property
    def time(self) -> float:
        """Simulated since the beginning [s]."""
        return self._time

    @property
    def rate(self) -> float:
        """Simulated seconds for each second of the clock, measured lately; 0 while it stands."""
        clock = self._clock
        if len(clock) < 2 or self.paused:
            return 0.0
        first = next(one for one in clock if one[0] >= clock[-1][0] - RATE_S)
        wall = clock[-1][0] - first[0]
        return (clock[-1][1] - first[1]) / wall if wall > 0 else 0.0

    @property
    def is_duel(self) -> bool:
        """Whether two fight."""
        return self.settings.scene.startswith("duel")

    @property
    def newest(self) -> Moment | None:
        """The newest moment."""
        return self.history.back(0.0)

    def restart(self, scene: str | None = None) -> None:
        """Begin anew, in another scene if one is named; UnknownNameError if there is none of that name."""
        scene = scene or self.settings.scene
        if scene not in SCENES:
            raise UnknownNameError("scene", scene, SCENES)
        with self.lock:
            s = self.settings = replace(self.settings, scene=scene)
            self.stage = stage("empty" if self.is_duel else scene)
            if scene == "ball" and self._ball is not None:
                self.stage = replace(self.stage, obstacles=ball_on_post(self._ball))
            self.director: Director
            if self._custom is not None:
                self.director = self._custom()
            elif self.is_duel:
                self.director = Dueling(scene.removeprefix("duel "), s.seed, optimise=s.arm == "optimised")
            else:
                self.director = Approaching(self.stage, s.arm)
            world = SceneSettings(obstacles=self.stage.obstacles)
            self.tracker = PageTracker(
                self.director.characters, s.preset, s.seed, s.controller, SimulationSettings(scene=world)
            )
            self.director.begin(self.tracker)
            model, bodies = self.tracker.model, self.tracker.bodies
            self._floor = [FloorReader(model, body) for body in bodies]
            self._things = np.array(
                [int(model.jnt_qposadr[model.joint(one.name).id]) for one in self.stage.moving], dtype=int
            )
            self._push: tuple[float, float, tuple[float, float, float], int] | None = None
            self._time, self._moments = 0.0, 0
            self.history.clear()
            self._clock.clear()
            self.version += 1
            self.told = f"{scene}, from the beginning"

    def begin_tasks(self) -> None:
        """Do what belongs to the scene: kick the ball, strike the opponents, go through the course."""
        with self.lock:
            tasks = self.stage.tasks
            if self._ball is not None and self.settings.scene == "ball":
                tasks = (ball_task(self._ball, self._own_place()),)
            if not isinstance(self.director, Approaching) or not tasks:
                raise SettingError(f"scene {self.settings.scene} has no tasks of its own; click the floor")
            strike = struck(self.stage)
            if strike is not None and np.linalg.norm(self.tracker.data.qpos[self._things[0] :][:3] - strike) > 0.02:
                raise SettingError("the ball is not on its post any more; begin anew")
            self.director.go(*tasks, strike=strike)
            self.told = "on the way"

    def set_goal(self, goal: Point, target: str | None = None) -> None:
        """Go to a place, and launch a target there if one is named (a key of `LAUNCHES`). In a duel: where the avatar goes."""
        goal = _checked_point(goal)
        with self.lock:
            if isinstance(self.director, Dueling):
                self.director.request("", goal)
            else:
                self._approaching().go(task_at(goal, None if target is None else _launched(target)))
            self.told = f"goal {goal[0]:.2f}, {goal[1]:.2f}"

    def set_ball(self, place: Point) -> None:
        """Put the ball on its post at a place, and begin anew there."""
        place = _checked_point(place)
        if np.hypot(*place) < 1.0:
            raise SettingError("a ball within 1 m of where the character begins; valid: farther away")
        with self.lock:
            if self.settings.scene != BALL:
                raise SettingError(f"no ball in scene {self.settings.scene}; valid: scene {BALL}")
            self._ball = place
            self.restart()

    def launch(self, name: str) -> None:
        """Launch a target at once (a key of `LAUNCHES`), or in a duel ask the avatar for an attack (`requests.REQUESTS`)."""
        with self.lock:
            if isinstance(self.director, Dueling):
                self.director.request(name)
            else:
                self._approaching().launch(_launched(name))
            self.told = name

    def switch(self, arm: str) -> None:
        """Prepare in another way from the next action on; one of `ARMS`."""
        with self.lock:
            if arm not in ARMS:
                raise UnknownNameError("arm", arm, ARMS)
            if isinstance(self.director, Approaching):
                self.director.switch(arm)
            self.settings = replace(self.settings, arm=arm)
            self.told = f"arm {arm}"

    def push(self, force: float, angle_deg: float = 0.0, seconds: float = 0.2, body: int = 0, segment: int = 0) -> None:
        """Push a body sideways, an outside force.

        Args:
            force: up to `HARDEST_N` [N].
            angle_deg: direction in the world: 0 along x, 90 along y [deg].
            seconds: how long.
            body: number of who is pushed.
            segment: where, a number in its segments; 0: the pelvis.
        """
        if not (0 < force <= HARDEST_N and 0 < seconds <= LONGEST_PUSH_S and np.isfinite(angle_deg)):
            raise SettingError(
                f"push of {force} N for {seconds} s; valid: up to {HARDEST_N:g} N and {LONGEST_PUSH_S:g} s"
            )
        with self.lock:
            angle = np.radians(angle_deg)
            vector = (float(force * np.cos(angle)), float(force * np.sin(angle)), 0.0)
            bodies = self.tracker.bodies
            if not (0 <= body < len(bodies) and 0 <= segment < len(bodies[body].segment_names)):
                raise SettingError(f"nothing to push: body {body}, segment {segment}")
            name = bodies[body].prefix + bodies[body].segment_names[segment]
            self.tracker.push(Push(name, self._time, seconds, vector))
            self._push = (self._time, self._time + seconds, vector, body)
            self.told = f"push of {force:.0f} N at {name}, from outside"

    def pause(self, paused: bool = True) -> None:
        """Wait, or go on."""
        self.paused = paused
        self._clock.clear()

    def single_step(self) -> None:
        """While it waits: go on by one moment."""
        self._steps_asked += 1

    def advance(self) -> bool:
        """Go on by one moment, 1/60 s; False where it waits or has ended."""
        with self.lock:
            if self.paused:
                if not self._steps_asked:
                    return False
                self._steps_asked -= 1
            tracker, director = self.tracker, self.director
            if tracker.end:
                return False
            self._moments += 1
            director.advance(self._moments / FPS)
            if tracker.end:
                self.told = f"the simulation {tracker.end}; begin anew"
            self._time = tracker.state.time
            self.history.add(self._moment())
            self._clock.append((time.perf_counter(), self._time))
            if self._time > director.longest_s:
                self.restart()
                self.told = f"began anew after {director.longest_s:g} s"
            return True

    def save(self, name: str, body: int = 0, seconds: float | None = None) -> Path:
        """Write what a body did in the last minute, or the last seconds, as a motion into the session's folder.

        Raises:
            SettingError: a name with other signs than letters, digits, - and _, or nothing to save.
        """
        if not _NAME.fullmatch(name):
            raise SettingError(f"name {name!r}; valid: letters, digits, - and _, at most 64, no folders")
        with self.lock:
            moments = self.history.all()
            if seconds is not None:
                moments = moments[-max(2, round(seconds * FPS)) :]
            characters = self.director.characters
        if len(moments) < 2 or not 0 <= body < len(characters):
            raise SettingError("nothing to save yet")
        motion = Motion(
            np.array([moment.bodies[body] for moment in moments]),
            FPS,
            np.array([moment.marks[body].contacts for moment in moments]),
            name=name,
            source=f"simulated in simprep app, scene {self.settings.scene}",
            character=characters[body],
        )
        path = save_motion(at_origin(motion), self.settings.folder / f"{name}.npz")
        self.told = f"saved {path}"
        return path

    def _approaching(self) -> Approaching:
        if not isinstance(self.director, Approaching):
            raise SettingError("in a duel, ask for what fighters do; valid: a scene of the preparation")
        newest = self.newest
        if newest is not None and 0 in newest.fallen:
            raise SettingError("the character is down; begin anew")
        return self.director

    def _own_place(self) -> Point:
        pose = self.tracker.state.reference_qpos[0]
        return float(pose[0]), float(pose[1])

    def _moment(self) -> Moment:
        state, data = self.tracker.state, self.tracker.data
        push, pushed = (0.0, 0.0, 0.0), 0
        if self._push is not None and self._push[0] <= self._time <= self._push[1] + 1 / FPS:
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
            pushed=pushed,
            fallen=state.fallen,
        )


def _launched(name: str) -> str:
    if name not in LAUNCHES:
        raise UnknownNameError("launch", name, LAUNCHES)
    return LAUNCHES[name]


def _checked_point(point: Point) -> Point:
    x, y = (float(value) for value in point)
    if not (abs(x) <= FARTHEST_M and abs(y) <= FARTHEST_M):
        raise SettingError(f"place {x:g}, {y:g}; valid: within {FARTHEST_M:g} m of the world's origin")
    return x, y
