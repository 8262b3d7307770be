"""People around the character in an experiment's pictures: built-in motions played along the path of a source of influence.

They are drawn only: nothing simulates them, nothing collides with them, and they do not react to being hit.
"""

from dataclasses import replace

import numpy as np

from simprep.controller.influence import Influence
from simprep.errors import SettingError
from simprep.library.registry import library_motion
from simprep.library.walking.walk import WalkStyle, walk
from simprep.motion.edit import cut, move, repeat
from simprep.motion.motion import Motion
from simprep.preparation.transition import launch, launch_frame

BLEND_S = 0.45
"""Over which the walk gives way to the guard."""
PAUSE_S = 0.5
"""In guard between two attacks."""
_LEAST_M_S = 0.3


def walk_at(speed: float) -> Motion:
    """The built-in walk with steps and cadence that go with a slower pace, both with the square root of the speed.

    Args:
        speed: along the course, 0.3 m/s to that of the built-in walk, 1.24 m/s.

    Returns:
        One cycle, of exactly this mean speed: feet stay where they are set down.

    Raises:
        SettingError: a speed outside.
    """
    usual = WalkStyle()
    if not _LEAST_M_S <= speed <= usual.speed + 1e-9:
        raise SettingError(f"walking at {speed:g} m/s; valid: {_LEAST_M_S:g} to {usual.speed:g}")
    share = float(np.sqrt(speed / usual.speed))
    frames = 4 * round(usual.frames / share / 4)
    style = replace(
        usual,
        frames=frames,
        step_length=speed * frames / 60 / 2,
        com_bounce=usual.com_bounce * share,
        arm_swing_deg=usual.arm_swing_deg * share,
        foot_roll=share,
    )
    return walk(style)


def attacker(influence: Influence, behind: float, attack: str, duration: float) -> Motion:
    """Walks up with a source of influence, stops with it, and attacks again and again from guard.

    The walk leads straight to where the source stops; it begins in that phase with which the root, on average, is as far
    behind the source as it is when it stands. So the root's path differs from the source's by the sway of a walk and by
    stopping within a step instead of at once.

    Args:
        influence: moving, and stopping at a time.
        behind: the root follows the source's path this far behind it [m].
        attack: a built-in punch, with the event `target`; its movement up to guard again is repeated.
        duration: of the motion [s].

    Returns:
        The motion, from time 0.

    Raises:
        SettingError: the source does not move, or never stops, or moves at no walking speed.
    """
    speed = float(np.linalg.norm(influence.velocity))
    if not speed or not np.isfinite(influence.stops_s):
        raise SettingError(
            "an opponent walks up to a place; valid: an influence with a velocity and a time at which it stops"
        )
    blow = _from_guard_to_guard(library_motion(attack))
    cycle = walk_at(speed)  # along x, the course at y = 0
    fps, entry = cycle.fps, 1
    cycles = int(np.ceil(influence.stops_s * fps / len(cycle))) + 3
    steps = replace(repeat(cycle, cycles), loop=False)
    last = len(steps) - len(cycle)
    # of one cycle, the frame from which guard is entered best
    frame = launch_frame(steps, last - len(cycle), last, blow, entry)
    whole = launch(steps, frame, blow, entry, BLEND_S)
    # the walk advances evenly by speed * time; its root sways about that
    sway = cycle.qpos[:, 0] - speed * cycle.times
    stands = float(whole.qpos[frame + round(BLEND_S * fps), 0])
    stops = round((stands - float(sway.mean())) / speed * fps)  # frame in which the even advance gets there
    first = stops - round(influence.stops_s * fps)
    whole = cut(whole, first, len(whole))
    while whole.duration < duration:
        whole = launch(whole, len(whole) - 1, blow, entry, BLEND_S)
    whole = cut(whole, 0, round(duration * fps) + 1)
    direction = np.asarray(influence.velocity) / speed
    goal = influence.at(influence.stops_s) - behind * direction
    whole = move(whole, turn=float(np.arctan2(direction[1], direction[0])))
    x, y = goal - direction * stands
    return replace(
        move(whole, translation=(float(x), float(y))), name="opponent", source=f"simprep library: walk, {attack}"
    )


def _from_guard_to_guard(punch: Motion) -> Motion:
    """From just before the target movement to where the pose is nearest to that again, and a pause there."""
    begin = punch.events["target"] - 1
    away = np.abs(punch.qpos[:, 7:] - punch.qpos[begin, 7:]).max(axis=1)
    out = int(punch.events["impact"]) + round(0.1 * punch.fps)
    back = out + int(np.argmin(away[out:]))
    pause = round(PAUSE_S * punch.fps)
    part = cut(punch, begin, back + 1)
    return replace(
        part,
        qpos=np.concatenate([part.qpos, np.repeat(part.qpos[-1:], pause, axis=0)]),
        contacts=np.concatenate([part.contacts, np.repeat(part.contacts[-1:], pause, axis=0)]),
    )
