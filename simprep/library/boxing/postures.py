"""Boxing motions from a few whole-body postures: stand, guard, action, guard, stand.

An action is a list of postures of legs and trunk with their times, and of fist keys. Pelvis and trunk lag behind the
legs by a few hundredths of a second: the proximal to distal order of a strike (Putnam 1993, J Biomech 26 suppl. 1:125).
The left foot is in front; `mirrored` exchanges the sides. The head faces the opponent, ahead along world x.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from simprep.arrays import FloatArray, IndexArray
from simprep.character import SIDES
from simprep.library.parts.feet import FootPath, Stance
from simprep.library.parts.limbs import limb_lengths
from simprep.library.parts.movement import (
    HANGING,
    ArmKey,
    ArmPose,
    Movement,
    build_movement,
    curve,
    degrees_curve,
    shared_pressure,
    support_point,
)
from simprep.library.parts.posture import Pose
from simprep.motion.curves import Curve, minimum_jerk
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.rotations import rotation_matrix

START_S, READY_S, TARGET_S = 0.10, 0.70, 0.90
HOLD_S, LOWER_S, END_S = 0.15, 0.60, 0.05
"""After the action: guard held, arms lowered, standing at rest."""
UPRIGHT_M, GUARD_M = 0.964, 0.943
REST_YAW = -22.0
"""Of the pelvis when standing with one foot before the other [deg]."""
LEAD: ArmPose = ((0.28, -0.05, 0.17), (-0.1, 0.30, -1.0), 35.0)
"""Guard of the front hand: fist at chin height before the face."""
REAR: ArmPose = ((0.19, -0.09, 0.19), (-0.2, 0.30, -1.0), 35.0)
"""Guard of the rear hand: fist beside the chin."""
NECK_SHARE, HEAD_SHARE = 0.46, 0.42
"""Shares of the turn of pelvis and trunk that the neck and the head undo."""

EARLY_PEAK = 1.3
"""Exponent of the remaining time in a thrust: 1 is the minimum-jerk profile, more peaks earlier."""


@dataclass(frozen=True)
class Posture:
    """Legs and trunk at one instant; the default is the guard, left foot in front.

    Attributes:
        yaw, pitch, roll: of the pelvis, to the left, forward, left side up [deg].
        twist: of the trunk on the pelvis, to the left [deg].
        flexion, bend: of the trunk, forward and to the left [deg].
        front_share: of the load that the front foot carries.
        drop: of the COM below that of the guard [m].
        heels: how far the front and the rear heel are raised [deg].
        pivots: how far the front and the rear foot have turned their toes out, on the ball [deg].
    """

    yaw: float = -24.0
    pitch: float = 4.0
    roll: float = 0.0
    twist: float = -10.0
    flexion: float = 12.0
    bend: float = 0.0
    front_share: float = 0.5
    drop: float = 0.0
    heels: tuple[float, float] = (0.0, 0.0)
    pivots: tuple[float, float] = (0.0, 0.0)


GUARD = Posture()


@dataclass(frozen=True)
class Aim:
    """An arm stretched forward to a height and a lateral position in the world, whatever the trunk does.

    Attributes:
        height: of the fist above the floor [m].
        across: of the fist, world y [m].
        reach: shoulder to fist [m].
        elbow: direction in which the elbow points, thorax frame: forward, outward, up.
        pronation_deg: of the forearm [deg].
    """

    height: float
    across: float
    reach: float
    elbow: tuple[float, float, float] = (0.0, 0.5, -1.0)
    pronation_deg: float = 75.0


def linked(upper_arm: tuple[float, float, float], forearm: tuple[float, float, float], pronation_deg: float) -> ArmPose:
    """An arm from the directions of upper arm and forearm, of any length, thorax frame: forward, outward, up."""
    lengths = limb_lengths()
    upper, fore = np.array(upper_arm), np.array(forearm)
    fist = lengths.upper_arm * upper / np.linalg.norm(upper) + lengths.forearm * fore / np.linalg.norm(fore)
    return (float(fist[0]), float(fist[1]), float(fist[2])), upper_arm, pronation_deg


FistKey = tuple[float, ArmPose | Aim]
"""Time after the target [s] and what the arm does then."""


@dataclass(frozen=True)
class Action:
    """What happens between two guards; times count from the first frame of the movement [s].

    Attributes:
        name: of the motion.
        postures: (time at which the legs reach it, posture).
        back: when legs, trunk and arms are in guard again.
        fists: keys of the left and of the right arm; before and after them the guard.
        straight: for each arm, whether its fist moves on straight lines rather than on arcs.
        lags: of pelvis and trunk behind the legs [s].
        events: times of the events but `target`.
        stance: distance of the feet along and across [m].
    """

    name: str
    postures: Sequence[tuple[float, Posture]]
    back: float
    fists: tuple[Sequence[FistKey], Sequence[FistKey]] = ((), ())
    straight: tuple[bool, bool] = (False, False)
    lags: tuple[float, float] = (0.0, 0.0)
    events: Mapping[str, float] = field(default_factory=dict)
    stance: tuple[float, float] = (0.36, 0.24)


def boxing_motion(action: Action, passes: int = 2) -> Motion:
    """The motion of an action at 60 frames per second.

    Args:
        action: postures and fist keys.
        passes: how often the arms are aimed anew; the first aim does not know the trunk's motion.

    Raises:
        MotionError: a pose leaves the joint limits.
    """
    motion = build_movement(_target(action, None))
    aims = any(isinstance(pose, Aim) for keys in action.fists for _, pose in keys)
    for _ in range(passes if aims else 0):
        motion = build_movement(_target(action, motion))
    return motion


def _target(action: Action, before: Motion | None) -> Movement:
    back = TARGET_S + action.back
    lower, end = back + HOLD_S, back + HOLD_S + LOWER_S
    duration = end + END_S
    along, across = action.stance
    front = Stance(0.0, duration, along / 2, across / 2, np.radians(-6))
    rear = Stance(0.0, duration, -along / 2, -across / 2, np.radians(30))
    on_ball = any(posture.heels[0] > 0 for _, posture in action.postures)
    points = (support_point("left", front, 0.10 if on_ball else 0.05), support_point("right", rear, 0.09))
    moments = [(TARGET_S + time, posture) for time, posture in action.postures]

    def keys(part: str, lag: float = 0.0, rest: float = 0.0) -> list[tuple[float, float]]:
        """One number of the postures over time, from and to that of standing."""
        action_keys = [(time + lag, float(getattr(posture, part))) for time, posture in moments]
        guard = float(getattr(GUARD, part))
        return [(START_S, rest), (READY_S, guard), (TARGET_S + lag, guard), *action_keys, (back, guard), (lower, guard),
                (end, rest)]  # fmt: skip

    def foot_keys(part: str, foot: int, inset: float = 0.0) -> Curve:
        """The same for one foot; the pivot begins and ends (inset) while the heel is up."""
        values = [(time, -getattr(p, part)[foot] if part == "heels" else getattr(p, part)[foot]) for time, p in moments]
        return degrees_curve((TARGET_S + inset, 0.0), *values, (back - 2 * inset, 0.0))

    pelvis, trunk = action.lags
    height = [(time, GUARD_M - drop) for time, drop in keys("drop")]
    height[0], height[-1] = (START_S, UPRIGHT_M), (end, UPRIGHT_M)
    share = [(0.0, 0.5), *keys("front_share", rest=0.5)[1:-1], (duration, 0.5)]
    return Movement(
        name=action.name,
        duration=duration,
        feet=(
            FootPath("left", (front,), pitch=foot_keys("heels", 0), pivot=foot_keys("pivots", 0, 0.03)),
            FootPath("right", (rear,), pitch=foot_keys("heels", 1), pivot=foot_keys("pivots", 1, 0.03)),
        ),
        pressure=shared_pressure(points, share),
        com_height=curve(*height),
        trunk=_trunk(
            keys("yaw", pelvis, REST_YAW), keys("roll", pelvis), keys("pitch", pelvis),
            {part: keys(part, trunk) for part in ("twist", "flexion", "bend")},
        ),
        yaw=degrees_curve(*keys("yaw", pelvis, REST_YAW)),
        pitch=degrees_curve(*keys("pitch", pelvis)),
        roll=degrees_curve(*keys("roll", pelvis)),
        arms=(
            _arm(action, 0, LEAD, back, lower, end, before),
            _arm(action, 1, REAR, back, lower, end, before),
        ),
        events={"target": TARGET_S} | {name: TARGET_S + time for name, time in action.events.items()},
    )  # fmt: skip


def _trunk(
    yaw: list[tuple[float, float]],
    roll: list[tuple[float, float]],
    pitch: list[tuple[float, float]],
    parts: Mapping[str, list[tuple[float, float]]],
) -> list[tuple[float, Pose]]:
    """Trunk keys; the neck keeps the face forward and nearly level."""
    times = np.unique(np.round([time for keys in (yaw, *parts.values()) for time, _ in keys], 6))
    turn, side, forward = (curve(*keys)(times) for keys in (yaw, roll, pitch))
    twist, flexion, bend = (curve(*parts[part])(times) for part in ("twist", "flexion", "bend"))
    return [
        (
            float(time),
            {
                "lumbar_rotation": 0.4 * twist[k], "thorax_rotation": 0.6 * twist[k],
                "lumbar_flexion": 0.4 * flexion[k], "thorax_flexion": 0.6 * flexion[k],
                "lumbar_bending": 0.5 * bend[k], "thorax_bending": 0.5 * bend[k],
                "neck_rotation": -NECK_SHARE * (turn[k] + twist[k]),
                "head_rotation": -HEAD_SHARE * (turn[k] + twist[k]),
                "neck_flexion": -0.45 * (flexion[k] + forward[k]) + 3.0 * (k not in (0, len(times) - 1)),
                "neck_bending": -0.6 * (bend[k] - side[k]),
            },
        )
        for k, time in enumerate(times)
    ]  # fmt: skip


def _arm(
    action: Action, side: int, guard: ArmPose, back: float, lower: float, end: float, before: Motion | None
) -> list[ArmKey]:
    keys = [(TARGET_S + time, pose) for time, pose in action.fists[side]]
    if action.straight[side] and before is not None:
        act = _thrust(keys, SIDES[side], guard, back, before)
    else:
        act = [ArmKey(time, *_aimed(pose, SIDES[side], time, before)) for time, pose in keys]
    return [
        ArmKey(START_S, *HANGING),
        ArmKey(READY_S, *guard),
        *act,
        ArmKey(back, *guard),
        ArmKey(lower, *guard),
        ArmKey(end, *HANGING),
    ]


def _thrust(
    keys: Sequence[tuple[float, ArmPose | Aim]], side: str, guard: ArmPose, back: float, before: Motion
) -> list[ArmKey]:
    """Keys, frame by frame, of a fist that moves from the guard straight to a point of the world and back.

    The guard moves with the trunk, the point does not; a minimum-jerk share blends them each way, so the path has no
    kink. The speed peaks early: a nearly straight elbow gives little speed.
    """
    (start, _), (there, aim) = keys
    if not isinstance(aim, Aim):
        raise TypeError("a straight punch needs an aim")
    frames = np.arange(int(np.ceil(start * before.fps)), int(back * before.fps))
    times = frames / before.fps
    out = 1 - minimum_jerk(np.clip((there - times) / (there - start), 0.0, 1.0) ** EARLY_PEAK)
    share = np.where(times < there, out, 1 - minimum_jerk((times - there) / (back - there)))
    turn, shoulder = _thorax(before, side, frames)
    point = _point(aim, side, there, before)
    outward = np.array([1.0, 1.0 if side == "left" else -1.0, 1.0])
    aimed = np.einsum("tji,tj->ti", turn, point - shoulder) * outward
    w = share[:, None]
    fists = (1 - w) * guard[0] + w * aimed
    elbows = (1 - w) * guard[1] + w * aim.elbow
    palms = (1 - w[:, 0]) * guard[2] + w[:, 0] * aim.pronation_deg
    return [
        ArmKey(start - 1e-3, *guard, straight=True),
        *(
            ArmKey(float(frame / before.fps), tuple(fist), tuple(elbow), float(palm), straight=True)
            for frame, fist, elbow, palm in zip(frames, fists, elbows, palms)
        ),
    ]


def _aimed(pose: ArmPose | Aim, side: str, time: float, before: Motion | None) -> ArmPose:
    """The fist in the thorax frame, with the trunk as it was in an earlier solution."""
    if not isinstance(pose, Aim):
        return pose
    if before is None:
        return (0.8 * pose.reach, 0.5 * pose.reach, 0.0), pose.elbow, pose.pronation_deg
    turn, shoulder = _thorax(before, side, np.array([round(time * before.fps)]))
    fist = turn[0].T @ (_point(pose, side, time, before) - shoulder[0])
    outward = 1.0 if side == "left" else -1.0
    return (float(fist[0]), float(outward * fist[1]), float(fist[2])), pose.elbow, pose.pronation_deg


def _point(aim: Aim, side: str, time: float, before: Motion) -> FloatArray:
    """Where in the world the fist arrives."""
    _, shoulder = _thorax(before, side, np.array([round(time * before.fps)]))
    up, over = aim.height - shoulder[0, 2], aim.across - shoulder[0, 1]
    forward = np.sqrt(max(aim.reach**2 - up**2 - over**2, 0.0))
    return np.array([shoulder[0, 0] + forward, aim.across, aim.height])


def _thorax(motion: Motion, side: str, frames: IndexArray) -> tuple[FloatArray, FloatArray]:
    """Rotation of the thorax and position of a shoulder."""
    kinematics = forward_kinematics(motion.qpos[frames], motion.character)
    thorax = motion.character.segment("thorax")
    turn = rotation_matrix(kinematics.xquat[:, thorax])
    return turn, kinematics.xpos[:, thorax] + turn @ limb_lengths(motion.character).shoulder[SIDES.index(side)]
