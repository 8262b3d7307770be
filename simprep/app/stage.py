"""What the page can show: the paper's three scenes, with things that collide, and the tasks that belong to them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from simprep.app.aiming import strike, task_at
from simprep.character import Character
from simprep.controller.runtime.task import Task
from simprep.errors import UnknownNameError
from simprep.humanoid_model import humanoid
from simprep.library import library_motion
from simprep.library.crawl import CrawlStyle, crawl
from simprep.motion.edit import move
from simprep.motion.motion import Motion
from simprep.preparation.reference_posture import reference_posture
from simprep.scene import Obstacle

BALL = "ball"
BALL_RADIUS_M, BALL_KG = 0.11, 0.43
"""Of a football."""
BAR_HALF_M, BAR_KG = 0.03, 0.8
"""Of a gate's bar: half its thickness, and its mass."""
STOPS_M = 0.35
"""About where a character that has reached its goal comes to stand before it."""
KICK, JUMP = "kick_front", "jump_over_low"
LAUNCHES = {"punch": "punch_right", "kick": KICK, "duck": "duck", "jump": JUMP, "crawl": "crawl"}
"""What can be launched, by the word on its button: a target motion of the library."""
TARGETS = (*dict.fromkeys(LAUNCHES.values()), "punch_left")
DUCKED_WALK = CrawlStyle(
    step_length=0.22, step_time=0.52, swing_time=0.36, com_height=0.80, pitch_deg=28.0, lumbar_deg=24.0,
    thorax_deg=22.0, neck_deg=30.0, down_s=0.6, up_s=0.7,
)  # fmt: skip
"""Walks on while ducked. The library's `duck` stays on the spot: whoever does it before a bar meets the bar on rising."""
DUCK_UNDER = "duck_under"
BARS = {DUCK_UNDER: (0.90, 1.45), JUMP: (0.55, 0.14), "crawl": (0.85, 1.13)}
"""Of the course, by the target that passes it: how far ahead of the root at the launch, and how high its lower edge [m].

Measured in the motions: ducked, nothing is higher than 1.30 m from 0.6 to 1.2 m ahead; in a crawl, 1.01 m from 0.7 to
0.9 m. The jump is made for something 0.20 m high, 0.55 m ahead; a bar is 0.06 m thick."""
STRIKE_M = 0.6
"""An opponent stands so far behind the place where a punch is launched [m]."""
GUARD = "guard_left_lead"


@dataclass(frozen=True)
class Stage:
    """A scene of the page.

    Attributes:
        name: of the scene.
        target: what is launched at a goal first.
        obstacles: things in the world; those with a mass fly when hit.
        others: motions of further bodies, which are simulated too and stay where they are.
        tasks: what `begin` does, one after the other.
    """

    name: str
    target: str
    obstacles: tuple[Obstacle, ...] = ()
    others: tuple[Motion, ...] = ()
    tasks: tuple[Task, ...] = ()

    @property
    def characters(self) -> tuple[Character, ...]:
        """Who is in it, the one that the user leads first."""
        return (humanoid(), *(motion.character for motion in self.others))

    @property
    def moving(self) -> tuple[Obstacle, ...]:
        """Things that move freely, in the order of their entries in qpos."""
        return tuple(one for one in self.obstacles if one.mass)


def ball_task(ball: tuple[float, float], own: tuple[float, float]) -> Task:
    """Go from one's own place to where the kick meets a ball at (x, y) [m]."""
    ahead, _ = _foot_at_strike()
    way = np.array(ball) - own
    towards = way / max(float(np.linalg.norm(way)), 1e-9)
    goal = np.array(ball) - (ahead - STOPS_M) * towards
    return task_at((float(goal[0]), float(goal[1])), KICK)


def _empty() -> Stage:
    return Stage("empty", "punch_right")


def _ball() -> Stage:
    """A ball on a post, as high as the kick strikes."""
    place = (2.6, 0.0)
    return Stage("ball", KICK, ball_on_post(place), tasks=(ball_task(place, (0.0, 0.0)),))


def ball_on_post(place: tuple[float, float], name: str = BALL, free: bool = True) -> tuple[Obstacle, ...]:
    """A ball at (x, y) [m] on a post, as high as the foot strikes; it flies when it is hit, where it is free."""
    _, high = _foot_at_strike()
    ball = Obstacle(name, (*place, high), (BALL_RADIUS_M,) * 3, ball=True, mass=BALL_KG if free else 0.0)
    half = (high - BALL_RADIUS_M) / 2
    return ball, Obstacle("post" if name == BALL else f"{name}_post", (*place, half), (0.03, 0.03, half))


def gate(name: str, place: tuple[float, float], high: float, free: bool = True) -> tuple[Obstacle, ...]:
    """Two posts beside (x, y) [m], and a bar across the x axis that lies on them; it falls when it is hit, where it is free.

    Args:
        name: the bar is called `NAME_bar`.
        place: of its middle.
        high: of the bar's lower edge [m].
        free: whether the bar moves; a controller that plans ahead simulates it too, which takes several times as long.
    """
    x, y = place
    posts = [
        Obstacle(f"{name}_{side}", (x, y + 0.62 * sign, high / 2), (0.04, 0.04, high / 2))
        for side, sign in (("left", 1), ("right", -1))
    ]
    bar = Obstacle(
        f"{name}_bar", (x, y, high + BAR_HALF_M), (BAR_HALF_M, 0.68, BAR_HALF_M), mass=BAR_KG if free else 0.0
    )
    return (*posts, bar)


def _opponents() -> Stage:
    places = ((2.4, 0.3), (3.4, -1.0))
    guard = library_motion(GUARD)
    others = []
    for x, y in places:
        turn = float(np.arctan2(-y, -x))
        at = (x + STRIKE_M * x / float(np.hypot(x, y)), y + STRIKE_M * y / float(np.hypot(x, y)))
        others.append(replace(move(guard, turn=turn), loop=False))
        root = others[-1].qpos[0, :2]
        others[-1] = move(others[-1], (at[0] - float(root[0]), at[1] - float(root[1])))
    tasks = tuple(task_at(place, punch) for place, punch in zip(places, ("punch_right", "punch_left")))
    return Stage("opponents", "punch_right", others=tuple(others), tasks=tasks)


def _course() -> Stage:
    """A bar to duck under, a low one to jump over, and one to crawl under; the bars fall when they are hit."""
    things: list[Obstacle] = []
    tasks: list[Task] = []
    for (name, (ahead, high)), x in zip(BARS.items(), (1.9, 4.4, 7.0)):
        things += gate(name, (x, 0.0), high)
        tasks.append(task_at((x - ahead + STOPS_M, 0.0), name))
    return Stage("course", DUCK_UNDER, tuple(things), tasks=tuple(tasks))


@lru_cache(maxsize=1)
def targets() -> tuple[str | Motion, ...]:
    """What can be launched in a scene: motions of the library, and the ducked walk of the course."""
    return (*TARGETS, crawl(DUCKED_WALK, DUCK_UNDER))


STAGES: dict[str, Callable[[], Stage]] = {"ball": _ball, "opponents": _opponents, "course": _course, "empty": _empty}


def stage(name: str) -> Stage:
    """A scene by name; UnknownNameError for another."""
    if name not in STAGES:
        raise UnknownNameError("scene", name, STAGES)
    return STAGES[name]()


def struck(stage: Stage) -> tuple[float, float, float] | None:
    """Where the ball of a scene is to be struck (x, y, z) [m]; None where there is none."""
    return next((one.position for one in stage.obstacles if one.name == BALL), None)


def _foot_at_strike() -> tuple[float, float]:
    """How far before the root at the launch, and how high, the sole is when the kick strikes [m]."""
    kick = library_motion(KICK)
    sole = strike(kick, 1)
    start = kick.qpos[reference_posture(kick).frame]
    return float(sole[0] - start[0]), float(sole[2])
