"""From standing into the walk cycle and back: both ends of one short walk.

To start, the pressure moves back towards the foot that will step, then under the other (the anticipatory postural
adjustment); the first step is shorter. To stop, the last foot closes beside the other. In between the walk is that of
`walk`, so that the cut ends join its first pose: the influence of either end on the COM fades by exp(-omega t).
"""

from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from scipy.spatial.transform import Rotation

from simprep.arrays import FloatArray
from simprep.character import SIDES
from simprep.library.entry import FPS, Entry
from simprep.library.parts.feet import both_feet
from simprep.library.parts.posture import RELAXED, hinge_angles
from simprep.library.parts.whole_body import Plan, solve_whole_body
from simprep.library.stand import CENTRE_M, FEET_APART_M, STAND_HEIGHT_M
from simprep.library.walking.walk import (
    Footfall,
    WalkStyle,
    com_height,
    foot_path,
    foot_pitch,
    pressure_keys,
    regular_footfalls,
    trunk_and_arms,
)
from simprep.motion.curves import Curve, key_curve
from simprep.motion.edit import cut, move
from simprep.motion.motion import Motion


@dataclass(frozen=True)
class BoutStyle:
    """A walk from standing to standing, right foot first.

    Attributes:
        walk: the walk in between.
        strides: whole strides from the first push-off to the last left heel strike.
        start_along: start of both feet past the left foot's regular place: shortens the first step [m].
        last_shorter: by how much the last right and left step are shorter [m].
        shift_s: from the first shift of pressure to the first toe-off [s].
        shift_back, shift_aside: shift of the pressure back and towards the stepping foot [m].
        first_roll, last_roll: share of the regular foot pitch at the first toe-off and at the closing step.
        rest_s: standing before the first shift [s].
        settle_s: from the closing step to the end [s].
    """

    walk: WalkStyle = field(default_factory=WalkStyle)
    strides: int = 4
    start_along: float = 0.20
    last_shorter: tuple[float, float] = (0.03, 0.12)
    shift_s: float = 0.65
    shift_back: float = 0.025
    shift_aside: float = 0.035
    first_roll: float = 0.7
    last_roll: float = 0.45
    rest_s: float = 0.4
    settle_s: float = 1.1


JOIN_STRIDE = 2
"""The cut ends are at left mid-stance of this stride."""


def walk_start() -> Motion:
    """From standing to the first pose of `walk`."""
    motion, begin, period = _bout(BoutStyle())
    join = round(((JOIN_STRIDE + 0.25) * period - begin) * FPS)
    return _named(cut(motion, 0, join + 1), "walk_start")


def walk_stop() -> Motion:
    """From the first pose of `walk` to standing."""
    motion, begin, period = _bout(BoutStyle())
    join = round(((JOIN_STRIDE + 0.25) * period - begin) * FPS)
    rest = cut(motion, join, len(motion))
    return _named(move(rest, translation=(-float(rest.qpos[0, 0]), 0.0)), "walk_stop")


@lru_cache(maxsize=1)
def _bout(style: BoutStyle) -> tuple[Motion, float, float]:
    """The whole walk, the time of its first frame (left stance 0 begins at 0) and the stride period [s]."""
    walk = style.walk
    period, last = walk.frames / FPS, style.strides
    first_off = (walk.stance_share - 0.5) * period
    begin = -np.ceil((style.shift_s + style.rest_s - first_off) * FPS) / FPS
    closing = (last + 0.5) * period
    end = closing + style.settle_s
    times = np.arange(begin, end + 1e-9, 1 / FPS)
    falls = _footfalls(style, begin, end)
    paths = [foot_path(side, each, walk, _pitch(side, style)) for side, each in zip(SIDES, falls)]
    phase = times / period
    share = key_curve([first_off - 0.55, 0.5 * period, last * period, closing + 0.55], [0.0, 1.0, 1.0, 0.0])(times)
    root, hinges = trunk_and_arms(phase, np.zeros(len(times)), walk)
    turned = Rotation.from_rotvec(Rotation.from_matrix(root).as_rotvec() * share[:, None])
    plan = Plan(
        FPS,
        *both_feet(paths, times),
        zmp=_pressure(style, falls, begin, end)(times),
        com_height=(1 - share) * STAND_HEIGHT_M + share * com_height(phase, walk),
        root_rotation=turned.as_matrix(),
        hinges=(1 - share[:, None]) * hinge_angles(RELAXED) + share[:, None] * hinges,
    )
    motion = Motion(solve_whole_body(plan), FPS, plan.contacts, character=plan.character)
    return motion, float(begin), period


def _footfalls(style: BoutStyle, begin: float, end: float) -> tuple[list[Footfall], list[Footfall]]:
    walk, last = style.walk, style.strides
    beside = FEET_APART_M / 2
    left = regular_footfalls("left", walk, range(last + 1))
    right = regular_footfalls("right", walk, range(-1, last + 1))
    first_left, first_right = left[0], right[0]
    left[0] = replace(
        first_left, start=begin - 1, along=style.start_along, reach=first_left.reach - style.start_along, outward=beside
    )
    stand, step = style.start_along, first_right.along + first_right.reach
    right[0] = replace(first_right, start=begin - 1, along=stand, reach=step - stand, outward=beside)
    before, after = style.last_shorter
    right[-3] = replace(right[-3], reach=right[-3].reach - before)
    right[-2] = replace(right[-2], along=right[-2].along - before)
    final = left[-1].along - before - after
    left[-2] = replace(left[-2], reach=final - left[-2].along)
    left[-1] = replace(left[-1], end=end + 1, along=final, outward=beside)
    right[-2] = replace(right[-2], reach=left[-1].along - right[-2].along)
    right[-1] = replace(right[-1], end=end + 1, along=left[-1].along, outward=beside)
    return left, right


def _pitch(side: str, style: BoutStyle) -> Curve:
    """The regular pitch, faded in before the first toe-off and out after the last heel strike."""
    regular = foot_pitch(side, style.walk)
    period, last = style.walk.frames / FPS, style.strides
    if side == "left":  # flat from 0.085 to 0.36 of a stride
        keys = [(0.0, 0.0), (0.3, 1.0), (last + 0.1, 1.0), (last + 0.3, 0.0)]
    else:
        keys = [
            (-0.4, 0.0), (-0.2, style.first_roll), (0.3, style.first_roll), (0.4, 1.0), (last - 0.4, 1.0),
            (last + 0.3, 1.0), (last + 0.4, style.last_roll), (last + 0.6, style.last_roll), (last + 0.8, 0.0),
        ]  # fmt: skip
    times, shares = np.array(keys).T
    envelope = key_curve(list(times * period), shares)
    return lambda at: np.asarray(regular(at) * envelope(at))


def _pressure(style: BoutStyle, falls: tuple[list[Footfall], list[Footfall]], begin: float, end: float) -> Curve:
    walk, last = style.walk, style.strides
    period = walk.frames / FPS
    regular = (regular_footfalls("left", walk, range(last + 1)), regular_footfalls("right", walk, range(last + 1)))
    regular[0][0] = replace(regular[0][0], along=style.start_along, outward=FEET_APART_M / 2)
    regular[0][-1] = replace(regular[0][-1], along=falls[0][-1].along, outward=FEET_APART_M / 2)
    regular[1][-2] = replace(regular[1][-2], along=falls[1][-2].along)
    times, points = pressure_keys(regular, walk)
    off = falls[1][0].end
    centre = np.array([style.start_along + CENTRE_M, 0.0])
    start = [
        (begin, *centre),
        (off - style.shift_s, *centre),
        (off - 0.55 * style.shift_s, centre[0] - style.shift_back, -style.shift_aside),
        (off - 0.02, style.start_along + 0.03, FEET_APART_M / 2),
    ]
    final = falls[0][-1].along
    closing = (last + 0.5) * period
    stop = [
        (closing + 0.05, final + 0.15, 0.4 * FEET_APART_M),  # the toes brake
        (closing + 0.4, final + CENTRE_M, 0.0),
        (end, final + CENTRE_M, 0.0),
    ]
    keep = np.array([(off + 0.01 < time) and (time < (last + 0.40) * period) for time in times])
    table: FloatArray = np.concatenate([start, np.column_stack([times, points])[keep], stop])
    return key_curve(list(table[:, 0]), table[:, 1:])


def _named(motion: Motion, name: str) -> Motion:
    return replace(motion, name=name, source=f"simprep library: {name}")


ENTRIES = (
    Entry("walk_start", "locomotion", "starts to walk from standing", walk_start, {"speed_m_s": 1.24}),
    Entry("walk_stop", "locomotion", "stops walking and stands", walk_stop, {"speed_m_s": 1.24}),
)
