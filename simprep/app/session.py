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
from simprep.app.lane import Lane, both, both_stages
from simprep.app.moments import FPS, History, Moment
from simprep.app.page_tracker import PageTracker
from simprep.app.stage import BALL, LAUNCHES, STAGES, Stage, ball_on_post, ball_task, stage, struck
from simprep.character import Character
from simprep.duel.fight.modes import MODES
from simprep.errors import SettingError, UnknownNameError
from simprep.motion.edit import at_origin
from simprep.motion.motion import Motion
from simprep.motion.store import save_motion
from simprep.physics.controller import ControllerFactory
from simprep.preparation.scenario import ARMS

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
        beside: another of `ARMS`, which is simulated and shown beside the first; None: none. A fight has none.
    """

    scene: str = "ball"
    arm: str = "optimised"
    preset: str = "live"
    controller: str | ControllerFactory = "mpc"
    seed: int = 0
    folder: Path = field(default=Path("results/app"))
    beside: str | None = None


class Session:
    """One simulation. All methods may be called from any thread; `advance` from one.

    Args:
        settings: what to begin with.
        director: makes who leads the bodies in a scene; None: the learned controller, or the fight model.

    Attributes:
        lanes: the simulated worlds: one, or two for two arms side by side. What is asked for is done in both.
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
        for arm in (self.settings.arm, self.settings.beside or self.settings.arm):
            if arm not in ARMS:
                raise UnknownNameError("arm", arm, ARMS)
        self.restart(self.settings.scene)

    @property
    def tracker(self) -> PageTracker:
        """Of the first lane."""
        return self.lanes[0].tracker

    @property
    def director(self) -> Director:
        """Of the first lane."""
        return self.lanes[0].director

    @property
    def shown(self) -> tuple[Stage, tuple[Character, ...]]:
        """What is drawn: things and bodies of all lanes, the first one's first."""
        stage = self.stage if len(self.lanes) == 1 else both_stages(self.stage)
        return stage, tuple(one for lane in self.lanes for one in lane.director.characters)

    @property
    def ended(self) -> str | None:
        """How a simulation ended that cannot go on; None while all do."""
        return next((lane.tracker.end for lane in self.lanes if lane.tracker.end), None)

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
            if self.is_duel and s.beside is not None:
                s = self.settings = replace(s, beside=None)
            self.lanes = tuple(
                Lane(self.stage, self._directed(arm), s.preset, s.seed, s.controller)
                for arm in (s.arm, s.beside)
                if arm is not None
            )
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
                tasks = (ball_task(self._ball, self.lanes[0].own_place),)
            if not isinstance(self.director, Approaching) or not tasks:
                raise SettingError(f"scene {self.settings.scene} has no tasks of its own; click the floor")
            strike = struck(self.stage)
            if strike is not None and any(np.linalg.norm(lane.place_of(0) - strike) > 0.02 for lane in self.lanes):
                raise SettingError("the ball is not on its post any more; begin anew")
            for one in self._approaching():
                one.go(*tasks, strike=strike)
            self.told = "on the way"

    def set_goal(self, goal: Point, target: str | None = None) -> None:
        """Go to a place, and launch a target there if one is named (a key of `LAUNCHES`). In a duel: where the avatar goes."""
        goal = _checked_point(goal)
        with self.lock:
            if isinstance(self.director, Dueling):
                self.director.request("", goal)
            else:
                task = task_at(goal, None if target is None else _launched(target))
                for one in self._approaching():
                    one.go(task)
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
                target = _launched(name)
                for one in self._approaching():
                    one.launch(target)
            self.told = name

    def switch(self, arm: str) -> None:
        """Prepare in another way from the next action on; one of `ARMS`. It is the first lane that does."""
        with self.lock:
            if arm not in ARMS:
                raise UnknownNameError("arm", arm, ARMS)
            if isinstance(self.director, Approaching):
                self.director.switch(arm)
            self.settings = replace(self.settings, arm=arm)
            self.told = f"arm {arm}"

    def show_beside(self, arm: str | None) -> None:
        """Begin anew with another of `ARMS` beside the present one, or without; SettingError in a duel."""
        with self.lock:
            if arm is not None and arm not in ARMS:
                raise UnknownNameError("arm", arm, ARMS)
            if arm is not None and self.is_duel:
                raise SettingError("a fight is shown in one arm; valid: a scene of the preparation")
            self.settings = replace(self.settings, beside=arm)
            self.restart()

    def push(
        self, force: float, angle_deg: float = 0.0, seconds: float = 0.2, body: int | None = None, segment: int = 0
    ) -> None:
        """Push a body sideways, an outside force.

        Args:
            force: up to `HARDEST_N` [N].
            angle_deg: direction in the world: 0 along x, 90 along y [deg].
            seconds: how long.
            body: number of who is pushed, among those of all lanes; None: the first of each lane.
            segment: where, a number in its segments; 0: the pelvis.
        """
        if not (0 < force <= HARDEST_N and 0 < seconds <= LONGEST_PUSH_S and np.isfinite(angle_deg)):
            raise SettingError(
                f"push of {force} N for {seconds} s; valid: up to {HARDEST_N:g} N and {LONGEST_PUSH_S:g} s"
            )
        with self.lock:
            angle = np.radians(angle_deg)
            vector = (float(force * np.cos(angle)), float(force * np.sin(angle)), 0.0)
            if body is None:
                names = {lane.push(vector, seconds, 0, segment) for lane in self.lanes}
            else:
                lane, own = divmod(body, len(self.director.characters))
                if not 0 <= lane < len(self.lanes):
                    raise SettingError(f"nothing to push: body {body}; valid: 0 to {len(self.shown[1]) - 1}")
                names = {self.lanes[lane].push(vector, seconds, own, segment)}
            self.told = f"push of {force:.0f} N at {', '.join(names)}, from outside"

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
            if self.ended:
                return False
            self._moments += 1
            for lane in self.lanes:
                lane.director.advance(self._moments / FPS)
            if self.ended:
                self.told = f"the simulation {self.ended}; begin anew"
            self._time = self.tracker.state.time
            self.history.add(self._moment())
            self._clock.append((time.perf_counter(), self._time))
            longest = self.director.longest_s
            if self._time > longest:
                self.restart()
                self.told = f"began anew after {longest:g} s"
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
            _, characters = self.shown
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

    def _directed(self, arm: str) -> Director:
        """Who leads a new lane."""
        if self._custom is not None:
            return self._custom()
        s = self.settings
        if self.is_duel:
            return Dueling(s.scene.removeprefix("duel "), s.seed, optimise=arm == "optimised")
        return Approaching(self.stage, arm)

    def _approaching(self) -> list[Approaching]:
        """Who leads the character of each lane in which it still stands."""
        directors = [lane.director for lane in self.lanes]
        if not all(isinstance(one, Approaching) for one in directors):
            raise SettingError("in a duel, ask for what fighters do; valid: a scene of the preparation")
        up = [
            lane.director
            for lane in self.lanes
            if isinstance(lane.director, Approaching) and 0 not in lane.tracker.state.fallen
        ]
        if not up:
            raise SettingError("the character is down; begin anew")
        return up

    def _moment(self) -> Moment:
        moments = [lane.moment() for lane in self.lanes]
        if self.settings.beside is None:
            return moments[0]
        return both(moments[0], moments[1], (self.settings.arm, self.settings.beside))


def _launched(name: str) -> str:
    if name not in LAUNCHES:
        raise UnknownNameError("launch", name, LAUNCHES)
    return LAUNCHES[name]


def _checked_point(point: Point) -> Point:
    x, y = (float(value) for value in point)
    if not (abs(x) <= FARTHEST_M and abs(y) <= FARTHEST_M):
        raise SettingError(f"place {x:g}, {y:g}; valid: within {FARTHEST_M:g} m of the world's origin")
    return x, y
