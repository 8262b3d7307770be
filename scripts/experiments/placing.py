"""Place an approach by what its target would miss: the start of a kick, the goals before gates, the place of an opponent.

A task can be moved on the floor as a whole without changing anything else, so where it begins is free. All of this looks at
the motion as it is synthesised. What the simulated body misses is measured afterwards.
"""

from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np

from experiments.setting import Gate, Setting
from simprep.app.aiming import strike
from simprep.arrays import FloatArray
from simprep.controller.influence import Influence
from simprep.controller.runtime.approach import Approach, approach
from simprep.controller.runtime.task import Task, World
from simprep.motion.edit import move
from simprep.motion.motion import Motion
from simprep.preparation.blending import split_heading
from simprep.scene import SceneSettings, scene_spec

RIGHT = 1
GATE_TRIES = 5
NEAR_ENOUGH_M = 0.08
"""A gate's bar is met by its target so near to where it should be: no other goal is tried [m]."""
LARGEST_SHIFT_M = 0.5
"""A goal before a gate is moved this far at most."""
TRUNK = ("pelvis", "abdomen", "thorax", "head")
REACHES_M = 0.02
"""How deep a fist is placed in an opponent's trunk or head."""


def walked(setting: Setting, world: World) -> Approach:
    """The approach from where the setting begins."""
    return approach(world, setting.tasks, setting.place, "walk", setting.frame)


def place_kick(setting: Setting, world: World, ball: Sequence[float]) -> tuple[Setting, Approach, dict[str, float]]:
    """Move the beginning, and the goal with it, so that the middle of the sole passes through a ball when it strikes.

    Args:
        setting: the task.
        world: motions, graph, policy.
        ball: (x, y, z) [m].
    """
    result = walked(setting, world)
    if not result.launches:
        return setting, result, {}
    shift = np.asarray(ball)[:2] - strike(result.motion, RIGHT)[:2]
    moved = shifted(setting, shift)
    result = replace(result, motion=move(result.motion, (float(shift[0]), float(shift[1]))))
    miss = float(np.linalg.norm(np.asarray(ball) - strike(result.motion, RIGHT)))
    return moved, result, {"start_shift_m": float(np.linalg.norm(shift)), "strike_miss_m": miss}


def place_gates(
    setting: Setting, world: World, gates: Sequence[Gate]
) -> tuple[Setting, Approach, dict[str, list[float]]]:
    """Move the beginning, and the goals before later gates, so that each target is launched at its distance before its bar.

    Args:
        setting: the tasks, one for each gate.
        world: motions, graph, policy.
        gates: in the order of the tasks.
    """
    place = np.array([gate.x for gate in gates])
    wanted = np.zeros(len(gates))  # how far each goal is moved
    best: tuple[float, Setting, Approach, FloatArray] | None = None
    for _ in range(GATE_TRIES):
        tried = _with_goals(setting, wanted)
        result = walked(tried, world)
        launched = np.array(result.launches)
        if len(launched) == 0:
            break
        pose = result.motion.qpos[launched]
        heading = split_heading(pose[:, 3:7])[0]
        ahead = np.array([gate.ahead for gate in gates])[: len(launched)]
        miss = place[: len(launched)] - (pose[:, 0] + ahead * np.cos(heading))
        # all of it can begin elsewhere: the first launch is then where it should be
        start = miss[0]
        left = miss - start
        worst = float(np.abs(left).max()) + 10.0 * (len(gates) - len(launched))
        if best is None or worst < best[0]:
            moved = shifted(tried, np.array([start, 0.0]))
            best = worst, moved, replace(result, motion=move(result.motion, (float(start), 0.0))), left
        if worst < NEAR_ENOUGH_M:
            break
        wanted[: len(left)] = np.clip(wanted[: len(left)] + left, -LARGEST_SHIFT_M, LARGEST_SHIFT_M)
        wanted[0] = 0.0
    if best is None:
        return setting, walked(setting, world), {}
    return best[1], best[2], {"gate_miss_m": [float(value) for value in best[3]]}


def place_opponent(result: Approach, person: Motion, hand: str) -> FloatArray:
    """By how much (2,) an opponent is moved so that a fist meets trunk or head at the impact [m].

    Args:
        result: the approach, with the event `impact`.
        person: the opponent.
        hand: name of the striking segment.
    """
    shift = np.zeros(2)
    if "impact" not in result.motion.events:
        return shift
    frame = result.motion.events["impact"]
    for _ in range(4):
        there = move(person, (float(shift[0]), float(shift[1])))
        distance, way = fist_to_person(result.motion, there, hand, frame)
        flat = way[:2]
        length = float(np.linalg.norm(flat))
        if distance <= 0 or length < 1e-6:
            break
        shift = shift - flat * (1 + REACHES_M / length)
    return shift


def fist_to_person(motion: Motion, person: Motion, hand: str, frame: int) -> tuple[float, FloatArray]:
    """Distance between the surfaces of a hand and of another's trunk or head at a frame [m], and the way (3,) from it there."""
    best, way = fist_ways(motion, person, hand, frame, frame + 1)[0]
    return best, way


def fist_ways(motion: Motion, person: Motion, hand: str, first: int, after: int) -> list[tuple[float, FloatArray]]:
    """As `fist_to_person`, for frames first to after - 1 that both have."""
    model = scene_spec(SceneSettings((motion.character, person.character))).compile()
    data = mujoco.MjData(model)
    own = np.flatnonzero(model.geom_bodyid == model.body(f"a_{hand}").id)
    names = [f"b_{name}" for name in person.character.segments if any(part in name for part in TRUNK)]
    ids = [model.body(name).id for name in names]
    theirs = np.flatnonzero(np.isin(model.geom_bodyid, ids))
    out = []
    for frame in range(first, min(after, len(motion))):
        at = min(round(frame * person.fps / motion.fps), len(person) - 1)
        data.qpos[:] = np.concatenate([motion.qpos[frame], person.qpos[at]])
        mujoco.mj_kinematics(model, data)
        least, way, ends = np.inf, np.zeros(3), np.zeros(6)
        for a in own:
            for b in theirs:
                distance = mujoco.mj_geomDistance(model, data, int(a), int(b), 5.0, ends)
                if distance < least:
                    least, way = distance, ends[3:] - ends[:3]
        out.append((float(least), way))
    return out


def shifted(setting: Setting, shift: FloatArray) -> Setting:
    """The same task elsewhere on the floor; the things around it stay."""
    x, y = float(shift[0]), float(shift[1])
    place = (setting.place[0] + x, setting.place[1] + y, setting.place[2])
    return replace(setting, place=place, tasks=tuple(_moved_task(task, x, y) for task in setting.tasks))


def _with_goals(setting: Setting, by: FloatArray) -> Setting:
    """Goals and sources of influence moved along x, each by its own distance [m]."""
    goals = {task.goal: float(way) for task, way in zip(setting.tasks, by)}
    tasks = []
    for task, way in zip(setting.tasks, by):
        sources = tuple(
            replace(one, position=(one.position[0] + goals.get(one.position, 0.0), one.position[1]))
            for one in task.influences
        )
        tasks.append(replace(task, goal=(task.goal[0] + float(way), task.goal[1]), influences=sources))
    return replace(setting, tasks=tuple(tasks))


def _moved_task(task: Task, x: float, y: float) -> Task:
    sources = tuple(_moved_source(source, x, y) for source in task.influences)
    return replace(task, goal=(task.goal[0] + x, task.goal[1] + y), influences=sources)


def _moved_source(source: Influence, x: float, y: float) -> Influence:
    return replace(source, position=(source.position[0] + x, source.position[1] + y))
