"""From the approach into the target: a motion-graph transition, the same for every way of preparing.

The target is entered at its reference posture, placed so that the planted feet fit. The difference in pose and velocity
dies away over a short window (inertialisation); planted feet stay put by inverse kinematics.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from simprep.arrays import FloatArray
from simprep.errors import MotionError, SettingError
from simprep.motion.contacts import stances
from simprep.motion.edit import cut, move
from simprep.motion.kinematics import Kinematics, forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.rotations import in_heading
from simprep.motion.turns import rotation_between, turned
from simprep.preparation.blending import split_heading
from simprep.preparation.planting import Standing, plant_feet
from simprep.preparation.settings import DEFAULT_SETTINGS, PreparationSettings

LAUNCH_EVENT = "launch"
DEFAULT_WINDOW_S = 0.3

_ROOT_SHARE_S = 0.2  # how much the root counts in the placement, as seconds of stance of a foot
_FOOT_SHARE_S = 1.0
_CLOSING_S = 0.5  # of a step by a foot that the target never lifts
VELOCITY_S = 0.1
"""In pose distances, a velocity difference of 1 m/s weighs as much as this many metres [s]."""


@dataclass(frozen=True)
class _State:
    """Pose and change per frame at one instant."""

    qpos: FloatArray
    step: FloatArray  # (nv,) root displacement, root rotation vector (world), hinges


def launch(
    approach: Motion,
    frame: int,
    target: Motion,
    entry: int,
    window: float = DEFAULT_WINDOW_S,
    settings: PreparationSettings = DEFAULT_SETTINGS,
    carry: float = 0.0,
    ease: float = 0.0,
    stray: float = np.inf,
) -> Motion:
    """Play an approach, and from one of its frames on the target; the event `launch` marks the target's first frame.

    Args:
        approach: motion with at least one frame after `frame` (for its velocity there).
        frame: frame of the approach in whose place the target begins.
        target: at the approach's frame rate.
        entry: frame of the target with which it is entered.
        window: time over which the difference between the two dies away [s].
        settings: for the planted feet.
        carry: time over which the difference in the root's speed along the floor dies away [s]. What the root travels in it
            is kept: the target goes on from there. The speed turns as the target does. 0: the root comes back to where the
            target fits the planted feet.
        stray: where the feet's places towards each other differ by more than this from the target's, the one behind is lifted at
            once, not when the target lifts it, and steps to where the target has it next; within 0.5 s where that never lifts it [m].
        ease: time within which the pelvis may begin to sink so that legs reach [s]; 0: as early as it needs to, also at once.

    Raises:
        MotionError: different bodies or frame rates, or a frame outside its motion.
        SettingError: the window is not positive.
    """
    if approach.character != target.character or abs(approach.fps - target.fps) > 1e-6:
        raise MotionError(
            f"{approach.name} and {target.name} differ in body or frame rate: {approach.character} at {approach.fps:g} 1/s, "
            f"{target.character} at {target.fps:g} 1/s"
        )
    for motion, given in ((approach, frame), (target, entry)):
        if not 0 <= given < len(motion):
            raise MotionError(f"{motion.name}: frame {given}; valid: 0 to {len(motion) - 1}")
    if not window > 0:
        raise SettingError(f"transition window {window} s; valid: above 0")
    standing = forward_kinematics(approach.qpos[frame : frame + 1], approach.character)
    placed = _place(target, entry, approach, frame, standing)
    lifted = _stray_foot(placed, entry, approach, frame, standing, stray)
    if lifted is not None:
        placed = _place(target, entry, approach, frame, standing, lifted)
    landing = max(2, round(window * approach.fps))
    qpos, weight = _inertialise(_state(approach, frame), placed, entry, landing, round(carry * approach.fps))
    contacts = placed.contacts[entry:].copy()
    for side in (0, 1):
        if not approach.contacts[frame, side]:  # in the air at the launch: it lands when the two motions agree
            contacts[:landing, side] = False
    if lifted is not None:
        run = next(after for first, after in stances(placed.contacts[:, lifted]) if first <= entry < after) - entry
        contacts[: run if run < len(contacts) else round(_CLOSING_S * approach.fps), lifted] = False
    planted = plant_feet(
        qpos,
        forward_kinematics(placed.qpos[entry:], target.character),
        contacts,
        weight,
        standing.foot_points[0, :, :, 2].min(axis=1),
        approach.fps,
        approach.character,
        settings,
        standing=Standing(ease),
    )
    own = {name: at for name, at in approach.events.items() if at < frame}
    events = {name: at - entry + frame for name, at in target.events.items() if at >= entry}
    return replace(
        approach,
        qpos=np.concatenate([approach.qpos[:frame], planted.qpos]),
        contacts=np.concatenate([approach.contacts[:frame], contacts]),
        events={**events, **own, LAUNCH_EVENT: frame},  # names in both mean the approach's
        name=f"{approach.name}_{target.name}",
        source=f"{approach.source}; then {target.source}",
        loop=False,
    )


def launch_frame(locomotion: Motion, first: int, after: int, target: Motion, entry: int) -> int:
    """Frame of a locomotion, `first` to `after` - 1, from which a target at its frame rate is best entered at frame `entry`.

    Among the frames whose foot contacts equal those of the target's entry (all frames, if none do), the one whose body
    positions (relative to the root on the floor, in its heading) and velocities are nearest.
    """
    candidates = np.arange(first, after)
    pose, velocity = local_state(locomotion)
    goal_pose, goal_velocity = local_state(
        cut(replace(target, loop=False), max(entry - 1, 0), min(entry + 2, len(target)))
    )
    at = min(entry, 1)
    distance = ((pose[candidates] - goal_pose[at]) ** 2).sum(axis=(1, 2))
    distance += VELOCITY_S**2 * ((velocity[candidates] - goal_velocity[at]) ** 2).sum(axis=(1, 2))
    same = (locomotion.contacts[candidates] == target.contacts[entry]).all(axis=1)
    if same.any():
        distance = np.where(same, distance, np.inf)
    return int(candidates[np.argmin(distance)])


def local_state(motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Body positions [m] and velocities [m/s] in the axes of the root's heading, so that poses anywhere on the floor compare.

    Both are (T, segments, 3); the positions are relative to the root on the floor.
    """
    positions = forward_kinematics(motion.qpos, motion.character).xpos
    heading, _ = split_heading(motion.qpos[:, 3:7])
    velocity = np.gradient(positions, 1 / motion.fps, axis=0) if len(motion) > 1 else np.zeros_like(positions)
    floor = np.concatenate([motion.qpos[:, :2], np.zeros((len(motion), 1))], axis=1)
    return in_heading(positions - floor[:, None], heading), in_heading(velocity, heading)


def _stray_foot(
    placed: Motion, entry: int, approach: Motion, frame: int, standing: Kinematics, stray: float
) -> int | None:
    """The foot to lift at once (see `launch`): of two that stand in both, the one behind."""
    if not (np.isfinite(stray) and approach.contacts[frame].all() and placed.contacts[entry].all()):
        return None
    feet = list(approach.character.feet)
    there = forward_kinematics(placed.qpos[entry : entry + 1], placed.character)
    apart = [np.subtract(*found.xpos[0, feet, :2]) for found in (standing, there)]
    if np.linalg.norm(apart[0] - apart[1]) <= stray:
        return None
    heading, _ = split_heading(approach.qpos[frame, 3:7])
    return int(np.argmin(standing.xpos[0, feet, :2] @ [np.cos(heading), np.sin(heading)]))


def _place(
    target: Motion, entry: int, approach: Motion, frame: int, standing: Kinematics, lifted: int | None = None
) -> Motion:
    """Turn and shift the target so that at its entry the heading, and the feet that stay planted, fit the approach."""
    heading_to, _ = split_heading(approach.qpos[frame, 3:7])
    heading_from, _ = split_heading(target.qpos[entry, 3:7])
    turned = move(replace(target, loop=False), turn=float(heading_to - heading_from))
    there = forward_kinematics(turned.qpos[entry : entry + 1], target.character)
    shares, gaps = [_ROOT_SHARE_S], [approach.qpos[frame, :2] - turned.qpos[entry, :2]]
    for side, foot in enumerate(approach.character.feet):
        if side != lifted and approach.contacts[frame, side] and target.contacts[entry, side]:
            run = next(after for first, after in stances(target.contacts[:, side]) if first <= entry < after)
            shares.append(min((run - entry) / target.fps, _FOOT_SHARE_S))
            gaps.append(standing.xpos[0, foot, :2] - there.xpos[0, foot, :2])
    shift = np.average(np.array(gaps), axis=0, weights=shares)
    return move(turned, translation=(float(shift[0]), float(shift[1])))


def _state(motion: Motion, frame: int) -> _State:
    before, after = max(frame - 1, 0), min(frame + 1, len(motion) - 1)
    span = max(after - before, 1)
    return _State(motion.qpos[frame], _difference(motion.qpos[before], motion.qpos[after]) / span)


def _difference(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.concatenate([b[:3] - a[:3], rotation_between(a[3:7], b[3:7]), b[7:] - a[7:]])


def _inertialise(state: _State, target: Motion, entry: int, frames: int, carry: int) -> tuple[FloatArray, FloatArray]:
    """Target poses (T, nq) from `entry` on, led in from the approach's pose and velocity; what is left of the offset (T,)."""
    qpos = target.qpos[entry:].copy()
    own = _state(target, entry)
    offset = _difference(own.qpos, state.qpos)
    slope = (state.step - own.step) * frames
    x = np.minimum(np.arange(len(qpos)) / frames, 1.0)[:, None]
    left = (1 + 2 * x) * (1 - x) ** 2
    fade = left * offset + x * (1 - x) ** 2 * slope
    if carry:
        along = _carried(offset[:2], (state.step - own.step)[:2], carry, len(qpos))
        turn = np.unwrap(split_heading(qpos[:, 3:7])[0])
        fade[:, :2] = along[0] + np.cumsum(turned(np.diff(along, axis=0, prepend=along[:1]), turn - turn[0]), axis=0)
    qpos[:, :3] += fade[:, :3]
    rotation = Rotation.from_rotvec(fade[:, 3:6]) * Rotation.from_quat(qpos[:, 3:7], scalar_first=True)
    qpos[:, 3:7] = rotation.as_quat(scalar_first=True)
    low, high = target.character.limits.T
    inside = np.clip(qpos[:, 7:] + fade[:, 6:], low, high)
    qpos[:, 7:] = np.where(np.abs(fade[:, 6:]) > 0, inside, qpos[:, 7:])
    qpos[0] = state.qpos
    return qpos, left[:, 0]


def _carried(offset: FloatArray, speed: FloatArray, frames: int, count: int) -> FloatArray:
    """Offset (count, 2) of the root along the floor that never goes back against its speed [m].

    A cubic from an offset and a speed to rest is monotone if it covers at least a third of what the speed alone would
    (Fritsch & Carlson 1980, SIAM J Numer Anal 17:238). It ends there, or at 0 where that is farther on.

    Args:
        offset: (2,) at the beginning [m].
        speed: (2,) per frame.
        frames: until it rests.
        count: of the result.
    """
    way = np.linalg.norm(speed)
    along = speed / way if way > 0 else np.zeros(2)
    end = along * max(0.0, float(offset @ along) + float(way) * frames / 3)
    x = np.minimum(np.arange(count) / frames, 1.0)[:, None]
    return np.asarray(end + (offset - end) * (1 + 2 * x) * (1 - x) ** 2 + speed * frames * x * (1 - x) ** 2)
