"""From one action into the next: the difference dies away, and standing feet stay where they are.

The difference in pose, velocity and acceleration at the seam decays along a quintic (inertialisation; Bollo 2018,
"Inertialization: high-performance animation transitions in Gears of War", GDC). Then feet are planted by
`preparation.planting`.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from scipy.spatial.transform import Rotation

from simprep.arrays import BoolArray, FloatArray
from simprep.character import Character
from simprep.errors import SettingError
from simprep.motion.contacts import stances
from simprep.motion.curves import minimum_jerk
from simprep.motion.kinematics import Kinematics, forward_kinematics
from simprep.motion.limb_ik import legs
from simprep.motion.rotations import rotation_matrix, unwrapped, wrap_angle
from simprep.motion.turns import rotation_between
from simprep.preparation.planting import Standing, foot_heading, plant_feet
from simprep.preparation.settings import PreparationSettings


@dataclass(frozen=True)
class StitchSettings:
    """How actions are joined.

    Attributes:
        window_s: time over which the difference dies away [s].
        landing_s: least time for a foot in the air to come down where the next action already stands [s].
        drop_s: further time per metre that it is above the floor [s/m].
        ease_s: time within which the pelvis may begin to sink so that legs reach [s].
        stray_m: a standing foot that is farther than this from where the action wants it makes a step [m].
        stray_rad: so does one that is turned by more than this [rad].
        step_s: least duration of such a step [s].
        stride_s: further time per metre [s/m].

    Raises:
        SettingError: a time that is not positive.
    """

    window_s: float = 0.3
    landing_s: float = 0.15
    drop_s: float = 0.3
    ease_s: float = 0.1
    stray_m: float = 0.08
    stray_rad: float = 0.5
    step_s: float = 0.2
    stride_s: float = 0.3

    def __post_init__(self) -> None:
        for name in ("window_s", "landing_s", "drop_s", "ease_s"):
            if not 0 < getattr(self, name) <= 2:
                raise SettingError(f"{name} {getattr(self, name)}; valid: above 0, up to 2 s")


DEFAULT_STITCH = StitchSettings()
_PLANTING = PreparationSettings()
PIVOTING, HEEL_UP, HEEL_S = 0.6, 0.18, 0.04
"""A standing foot that turns this fast [rad/s] or faster stands on its toe, the heel raised by this angle [rad] from so
long before to so long after, and as smoothly [s]: the ball must be clear of the floor, or it rubs."""
DEEP_M, SINK_S = 0.005, 0.1
"""Feet deeper in the floor than this raise the pelvis [m], within this time [s]."""
DEEPEST_M = 0.15
"""Farthest that the pelvis sinks for legs to reach [m]."""
LOST_M, STEP_S = 0.01, 0.08
"""A foot that is missed by more than this does not stand [m], nor from this long before to this long after [s]."""
GONE_M, MOMENT_S = 0.03, 0.1
"""A leg that misses its place by more than this [m] for less than this [s] passes from its last place to the next."""
LOOSE = 0.25
"""Half of the difference in heading is left to a standing foot where it is this large [rad]."""
_ANKLE = 4  # of the hinges in the order of `solve_leg`: turns the foot about y, its heel up


@dataclass(frozen=True)
class Seam:
    """A fighter at the moment when the next action takes over.

    Attributes:
        poses: (3, nq) the frame before, this one, and the one that would have followed.
        contacts: (2,) feet that stand.
        lift: (2,) height of their soles [m].
    """

    poses: FloatArray
    contacts: BoolArray
    lift: FloatArray


@dataclass(frozen=True)
class Stitched:
    """An action as performed.

    Attributes:
        qpos: (F, nq), the first frame being the seam's pose.
        contacts: (F, 2) supporting feet.
        kinematics: of the poses.
        miss: (F, 2) distance of each ankle from where it should be [m].
    """

    qpos: FloatArray
    contacts: BoolArray
    kinematics: Kinematics
    miss: FloatArray


def inertialise(seam: FloatArray, target: FloatArray, before: FloatArray, frames: float) -> FloatArray:
    """Poses (F, nq) that begin with given pose, velocity and acceleration and become the target.

    Args:
        seam: (3, nq) poses before, at and after the first frame, of what goes on.
        target: (F, nq) poses, F at least 2.
        before: (nq,) pose before the target's first one.
        frames: after so many nothing of the difference is left.
    """
    ways = _difference(
        np.stack([target[0], seam[0], seam[1], before, target[0]]),
        np.stack([seam[1], seam[1], seam[2], target[0], target[1]]),
    )
    offset, own, other = ways[0], ways[1:3], ways[3:]
    slope = 0.5 * (own.sum(axis=0) - other.sum(axis=0)) * frames
    bend = ((own[1] - own[0]) - (other[1] - other[0])) * frames**2
    x = np.minimum(np.arange(len(target)) / frames, 1.0)[:, None]
    fade = (
        offset * (1 - x**3 * (10 - 15 * x + 6 * x**2))
        + slope * (x - x**3 * (6 - 8 * x + 3 * x**2))
        + bend * 0.5 * x**2 * (1 - x) ** 3
    )
    out = target.copy()
    out[:, :3] += fade[:, :3]
    turned = Rotation.from_rotvec(fade[:, 3:6]) * Rotation.from_quat(target[:, 3:7], scalar_first=True)
    quat = turned.as_quat(scalar_first=True)
    out[:, 3:7] = quat * np.where((quat * target[:, 3:7]).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    out[:, 7:] += fade[:, 6:]
    return out


def _difference(a: FloatArray, b: FloatArray) -> FloatArray:
    """(N, nv) from poses a to b (N, nq): position, rotation vector in the world, hinges."""
    turn = rotation_between(a[:, 3:7], b[:, 3:7])
    return np.concatenate([b[:, :3] - a[:, :3], turn, b[:, 7:] - a[:, 7:]], axis=1)


def plan_contacts(contacts: BoolArray, seam: Seam, fps: float, settings: StitchSettings = DEFAULT_STITCH) -> BoolArray:
    """Contacts (F, 2) of an example that begins in a seam.

    A foot in the air lands a little later than the example has it, and the other one waits for it.
    """
    out = contacts.copy()
    flies = not seam.contacts.any()
    for side in range(2):
        if contacts[0, side] and not seam.contacts[side]:
            frames = max(1, int(np.ceil((settings.landing_s + settings.drop_s * max(seam.lift[side], 0.0)) * fps)))
            out[:frames, side] = False
            if not flies and contacts[:frames].any(axis=1).all():
                out[:frames, 1 - side] |= seam.contacts[1 - side]
    return out


def plan_steps(
    contacts: BoolArray, ankles: FloatArray, headings: FloatArray, length: int, fps: float, settings: StitchSettings
) -> BoolArray:
    """Planned contacts (F, 2) with further steps, where a foot that stands throughout would be left behind.

    Drift and stitching move the body, not standing feet; so these step one after the other, while the other one stands.

    Args:
        contacts: (F, 2) planned.
        ankles: (F, 2, 2) on the floor, where the action has them [m]; where feet stand in the first frame.
        headings: (F, 2) of the feet, the same [rad].
        length: frames of the action; F may be more.
        fps: frames per second [1/s].
        settings: thresholds and times.
    """
    out = contacts.copy()
    stray = np.linalg.norm(ankles[length - 1] - ankles[0], axis=-1)
    turned = np.abs(wrap_angle(headings[length - 1] - headings[0]))
    need = np.maximum(stray / settings.stray_m, turned / settings.stray_rad)
    for side in np.argsort(-need):
        if need[side] < 1 or not contacts[:length, side].all():
            continue
        frames = int(np.ceil((settings.step_s + settings.stride_s * stray[side]) * fps))
        # the other foot stands from the frame before lift-off to the one after touch-down
        other = np.concatenate([[0], np.cumsum(out[:, 1 - side])])
        starts = np.arange(2, length - frames - 1)
        free = starts[other[starts + frames + 1] - other[starts - 1] == frames + 2]
        if len(free):
            # neither at once nor so early that the body has not yet gone where the foot should follow
            begin = int(free[np.argmin(np.abs(free + 0.5 * frames - 0.5 * length))])
            out[begin : begin + frames, side] = False
    return out


def stitch(
    seam: Seam,
    target: FloatArray,
    before: FloatArray,
    contacts: BoolArray,
    turning: FloatArray,
    length: int,
    fps: float,
    character: Character,
    settings: StitchSettings = DEFAULT_STITCH,
) -> Stitched:
    """Perform an action from a seam on.

    Args:
        seam: where it begins.
        target: (F, nq) the example, placed.
        before: (nq,) pose before the first one, placed.
        contacts: (F, 2) of the example.
        turning: (F, 2) headings of the example's feet: standing feet pivot by their changes [rad].
        length: frames of the action; F may be more.
        fps: frames per second [1/s].
        character: whose poses they are.
        settings: times.
    """
    planned = plan_contacts(contacts, seam, fps, settings)
    low, high = character.model.jnt_range[1:].T
    qpos = inertialise(seam.poses, target, before, settings.window_s * fps)
    qpos[:, 7:] = np.clip(qpos[:, 7:], low, high)
    natural, heading = _feet(qpos, character)
    planned = plan_steps(planned, natural, heading, length, fps, settings)
    # a foot lands where the example has it, whatever is left of the difference
    wanted, facing = _feet(target, character)
    landing = np.zeros((len(qpos), 2, 4))
    landing[..., :2] = wanted - natural
    landing[..., 3] = wrap_angle(facing - heading)
    made = plant(qpos, planned, follow(turning, heading, planned), fps, character, settings.ease_s, landing)
    made.qpos[0] = seam.poses[1]
    return made


def _feet(qpos: FloatArray, character: Character) -> tuple[FloatArray, FloatArray]:
    """Ankles on the floor (F, 2, 2) [m] and headings (F, 2) [rad] of the feet."""
    found = forward_kinematics(qpos, character)
    return found.xpos[:, character.feet, :2], foot_heading(rotation_matrix(found.xquat[:, character.feet]))


def follow(turning: FloatArray, heading: FloatArray, contacts: BoolArray) -> FloatArray:
    """Headings by whose changes feet pivot, so that standing feet follow where the body has them.

    Small differences are left, large ones reduced to about `LOOSE`: hips turn no further than that.

    Args:
        turning: (F, 2) headings of the example's feet [rad].
        heading: (F, 2) headings that the feet would have without standing [rad].
        contacts: (F, 2) feet that stand.
    """
    out = turning.copy()
    for side in range(2):
        for first, after in stances(contacts[:, side]):
            part = slice(first, after)
            ahead = unwrapped(heading[part, side]) - heading[first, side] - (turning[part, side] - turning[first, side])
            out[part, side] += ahead * ahead**2 / (ahead**2 + LOOSE**2)
            out[after:, side] += out[after - 1, side] - turning[after - 1, side]
    return out


def plant(
    qpos: FloatArray,
    contacts: BoolArray,
    turning: FloatArray,
    fps: float,
    character: Character,
    ease_s: float = 0.0,
    landing: FloatArray | None = None,
) -> Stitched:
    """A motion (F, nq) whose standing feet stay where they are in its first frame, or where they land.

    Args:
        qpos: (F, nq) poses.
        contacts: (F, 2) supporting feet.
        turning: (F, 2) headings of the feet: standing feet pivot by their changes [rad].
        fps: frames per second [1/s].
        character: whose poses they are.
        ease_s: time within which the pelvis may begin to sink so that legs reach; 0 where the first frame is free [s].
        landing: (F, 2, 4) corrections with which feet land (`planting.Standing`); None: where `qpos` has them.
    """
    qpos = qpos.copy()
    start = minimum_jerk(np.arange(len(qpos)) / (ease_s * fps)) if ease_s > 0 else np.ones(len(qpos))
    speed = np.abs(np.gradient(turning, 1 / fps, axis=0)) * contacts
    pivots = maximum_filter1d(np.minimum(speed / PIVOTING, 1.0), 2 * round(HEEL_S * fps) + 1, axis=0, mode="nearest")
    lift = HEEL_UP * gaussian_filter1d(pivots, HEEL_S * fps, axis=0, mode="nearest") * start[:, None]
    for leg, wanted in zip(legs(character), lift.T):
        column, sign = 7 + leg.hinges[_ANKLE], leg.sign[_ANKLE]
        most = leg.high[_ANKLE] if sign > 0 else -leg.low[_ANKLE]
        qpos[:, column] += sign * np.minimum(wanted, np.maximum(most - sign * qpos[:, column], 0.0))
    standing = Standing(ease_s, DEEPEST_M, turning, landing, yielding=True)
    made = _plant(qpos, contacts, fps, character, standing)
    lost = contacts & (made.miss > LOST_M)
    if lost[1:].any():  # out of reach: better a step than a foot that slides
        wide = maximum_filter1d(lost.astype(np.uint8), 2 * round(STEP_S * fps) + 1, axis=0, mode="nearest") > 0
        wide[0] = False
        contacts = contacts & ~wide
        made = _plant(qpos, contacts, fps, character, standing)
    depth = -made.kinematics.foot_points[..., 2].min(axis=(1, 2))
    if depth.max() > DEEP_M:  # no knee bends so far: the pelvis must not sink so low
        wider = maximum_filter1d(np.maximum(depth, 0.0), 2 * round(SINK_S * fps) + 1, mode="nearest")
        qpos[:, 2] += gaussian_filter1d(wider, 0.5 * SINK_S * fps, mode="nearest") * start
        made = _plant(qpos, contacts, fps, character, standing)
    return _mend(made, fps, character)


def _mend(made: Stitched, fps: float, character: Character) -> Stitched:
    """Where a leg has no solution for a moment, its angles pass from those before to those after."""
    out, mended = made.qpos.copy(), False
    for side, leg in enumerate(legs(character)):
        bad = made.miss[:, side] > GONE_M
        bad[0] = False
        for first, after in stances(bad):
            if after < len(bad) and after - first <= MOMENT_S * fps:
                share = (np.arange(1, after - first + 1) / (after - first + 1))[:, None]
                columns = 7 + leg.hinges
                out[first:after, columns] = (1 - share) * out[first - 1, columns] + share * out[after, columns]
                mended = True
    return replace(made, qpos=out, kinematics=forward_kinematics(out, character)) if mended else made


def _plant(qpos: FloatArray, contacts: BoolArray, fps: float, character: Character, standing: Standing) -> Stitched:
    made = plant_feet(
        qpos, None, contacts, np.ones(len(qpos)), np.zeros(2), fps, character, _PLANTING, standing=standing
    )
    return Stitched(made.qpos, contacts, made.kinematics, made.foot_error)
