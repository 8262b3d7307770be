"""Crawling on hands and knees: bend down, walk out on the hands, kneel, diagonal crawl, and the same way back up.

Fists, knees and toes bear the load; `Motion.contacts` holds the feet only. Limbs move in diagonal pairs, as in adults
(Patrick et al. 2009, J Neurophysiol 101:603): cycle 1.0 to 1.6 s, stride 0.5 to 0.7 m, stance 60 to 75 %. The length of
the thighs sets pelvis height and roll. The way up is the way down with time reversed. The movement is slow, so
positions are planned, and the COM is kept over the feet only until the hands are down.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from simprep.arrays import FloatArray
from simprep.character import SIDES
from simprep.humanoid_model import humanoid
from simprep.library.entry import FPS, Entry
from simprep.library.parts.feet import FootPath, Stance, both_feet
from simprep.library.parts.limbs import SIGNS, arm_angles, limb_lengths
from simprep.library.parts.movement import degrees_curve
from simprep.library.parts.posture import RELAXED, Pose, key_poses
from simprep.library.parts.whole_body import check_limits
from simprep.library.stand import CENTRE_M
from simprep.motion.curves import key_curve, minimum_jerk
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.limb_ik import legs, solve_leg
from simprep.motion.motion import Motion
from simprep.motion.rotations import axis_rotation

READY_S, TARGET_S = 0.70, 0.90
HANDS_S, OUT_S, KNEES_S, CRAWL_S = 1.90, 2.05, 3.45, 3.65
"""Hands on the floor, first hand step, knees on the floor, first crawl step."""
KNEE_M = 0.056
"""Height of the knee when it rests on the floor: the radius of the shank and a little."""
FIST_M = 0.025
"""Height of the middle of a fist on the floor."""
TOE_PITCH_DEG = -115.0
"""Pitch of the feet while kneeling: the toes on the floor behind the ankles."""
BESIDE_M = 0.09
HAND_BESIDE_M = 0.19
"""Knees and hands beside the middle."""
HAND_SWING_S = 0.42
"""A hand in the air on the way out."""
UNDER_M = 1.20
"""Where both hands are before the first crawl step, under the shoulders [m]."""
LEVEL: Pose = {"lumbar_flexion": 2, "thorax_flexion": 4, "neck_flexion": -40, "head_flexion": -12}
"""Trunk and head on hands and knees [deg]."""
KNEELING_PITCH_DEG = 70.0
"""Pitch of the pelvis on hands and knees."""


@dataclass(frozen=True)
class HandsAndKneesStyle:
    """Parameters of a crawl on hands and knees.

    Attributes:
        half_steps: number of diagonal pairs that move, the first and the last by half a step.
        half_step_s: from one pair's start to the next one's [s].
        swing_s: time of a pair in the air [s].
        stride: length of a full step [m].
        lift, hand_lift: of knees and toes, and of the hands, in a step [m].
    """

    half_steps: int = 6
    half_step_s: float = 0.68
    swing_s: float = 0.48
    stride: float = 0.50
    lift: float = 0.017
    hand_lift: float = 0.06

    @property
    def distance(self) -> float:
        """How far the crawl goes [m]."""
        return self.stride / 2 * (self.half_steps - 1)


def crawl_hands_knees(style: HandsAndKneesStyle | None = None) -> Motion:
    """A crawl on hands and knees along x, from standing to standing.

    Raises:
        MotionError: a pose leaves the joint limits by more than 0.5 deg.
    """
    style = style or HandsAndKneesStyle()
    last = CRAWL_S + style.half_steps * style.half_step_s
    end = last + CRAWL_S - 0.2
    times = np.arange(round(end * FPS) + 1) / FPS
    own = np.minimum(times, end - times)  # the way up is the way down backwards
    later = times > end / 2
    feet = [_foot(side, style, end) for side in SIDES]
    ankle, rotation, contacts = both_feet(feet, times)
    character = humanoid()
    qpos = np.zeros((len(times), character.nq))
    qpos[:, 7:] = key_poses(_trunk(), own)
    pitch = degrees_curve(
        (0.1, 0), (READY_S, 14), (TARGET_S, 14), (HANDS_S, 54), (2.45, 58), (KNEES_S, KNEELING_PITCH_DEG)
    )(own)
    kneeling = minimum_jerk((own - KNEES_S + 0.35) / 0.35)
    hips, roll = _on_knees(ankle, style, times)
    root = axis_rotation("x", kneeling * roll) @ axis_rotation("y", pitch)
    qpos[:, 3:7] = Rotation.from_matrix(root).as_quat(scalar_first=True)
    for name in ("lumbar_rotation", "thorax_rotation"):  # the chest stays level
        qpos[:, 7 + character.joint(name)] -= 0.4 * kneeling * roll
    middle = limb_lengths().hip.mean(axis=0)
    table = np.array(_PELVIS)
    free = key_curve(list(table[:, 0]), table[:, 1:])(own)
    free[:, 0] += np.where(later, style.distance, 0.0)
    path = np.column_stack([free[:, 0], np.zeros(len(times)), free[:, 1]])
    path += kneeling[:, None] * (hips - path)
    qpos[:, :3] = path - np.einsum("tij,j->ti", root, middle)
    fists = np.stack([_hands(side, style, own, times) for side in SIDES], axis=1)
    on_floor = minimum_jerk((own - TARGET_S - 0.1) / (HANDS_S - TARGET_S - 0.1))[:, None]
    ends = LimbEnds(root, ankle, rotation, fists, on_floor)
    place_limbs(qpos, ends)
    over = key_curve([0.1, TARGET_S, HANDS_S], [CENTRE_M, CENTRE_M + 0.02, 0.16])(own)
    over += np.where(later, style.distance, 0.0)
    _keep_over_feet(qpos, ends, over, 1 - minimum_jerk((own - HANDS_S + 0.2) / 0.8))
    check_limits(qpos, character)
    events = {"target": TARGET_S, "low": KNEES_S, "rise": end - KNEES_S}
    return Motion(
        qpos=qpos,
        fps=FPS,
        contacts=contacts,
        events={name: round(time * FPS) for name, time in events.items()},
        name="crawl_hands_knees",
        source="simprep library: crawl_hands_knees",
        character=character,
    )


_PELVIS = (
    (0.1, 0.0, 0.915), (READY_S, -0.02, 0.885), (TARGET_S, -0.02, 0.885), (HANDS_S, -0.13, 0.665), (2.45, 0.04, 0.645),
    (2.95, 0.38, 0.59), (KNEES_S, 0.74, 0.478),
)  # fmt: skip
"""Middle between the hips until kneeling: (time [s], x, z [m]); x until the hands are down is corrected for the COM."""


def _trunk() -> list[tuple[float, Pose]]:
    arms = {name: float(value) for name, value in RELAXED.items()}
    ready = arms | {"lumbar_flexion": 12, "thorax_flexion": 10, "neck_flexion": -20}
    down = arms | {"lumbar_flexion": 48, "thorax_flexion": 35, "neck_flexion": -42, "head_flexion": -14}
    level = {**arms, **LEVEL}
    return [(0.1, arms), (READY_S, ready), (TARGET_S, ready), (HANDS_S, down), (2.5, down), (KNEES_S, level)]


def _half_steps(style: HandsAndKneesStyle) -> list[tuple[float, str, float]]:
    """(start [s], side of the knee, place of that knee afterwards [m]); the other side's hand moves with it."""
    return [
        (
            CRAWL_S + number * style.half_step_s,
            ("left", "right")[number % 2],
            style.stride / 2 * min(number + 1, style.half_steps - 1),
        )
        for number in range(style.half_steps)
    ]


def _foot(side: str, style: HandsAndKneesStyle, end: float) -> FootPath:
    stances, start, place, via = [], 0.0, 0.0, []
    kneeling = KNEES_S - 0.1
    down = [(HANDS_S + 0.12, 0.0), (2.5, -32.0), (2.95, -75.0), (kneeling, TOE_PITCH_DEG)]
    up = [(end - time, degrees) for time, degrees in reversed(down)]
    pitch = degrees_curve(*down, *up)
    toes_down = FootPath(side, (Stance(0.0, end, 0.0, SIGNS[side] * BESIDE_M, 0.0),), pitch=pitch)
    rest = float(toes_down.at(np.array([CRAWL_S]))[0][0, 2])
    for time, moving, ahead in _half_steps(style):
        if moving == side:
            stances.append(Stance(start, time, place, SIGNS[side] * BESIDE_M, 0.0))
            start, place = time + style.swing_s, ahead
            via.append((time + style.swing_s / 2, 2, rest + style.lift))
    stances.append(Stance(start, end, place, SIGNS[side] * BESIDE_M, 0.0))
    return FootPath(side, tuple(stances), pitch=pitch, via=tuple(via))


def _on_knees(ankle: FloatArray, style: HandsAndKneesStyle, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Middle between the hips (T, 3) and roll (T,) that the thighs allow with both knees on the floor."""
    lengths = limb_lengths()
    kneels = np.argmin(np.abs(times - CRAWL_S))
    rise = ankle[kneels, 0, 2] - KNEE_M  # of the shank from knee to ankle
    knee = ankle + np.array([np.sqrt(lengths.shank**2 - rise**2), 0.0, -rise])
    steps = _half_steps(style)
    keys = [(CRAWL_S, 0.0)]
    for number, (time, _, ahead) in enumerate(steps):
        before = steps[number - 1][2] if number else 0.0
        keys.append((time + style.half_step_s, (ahead + before) / 2 if number < len(steps) - 1 else ahead))
    at, forward = np.array(keys).T
    hip_x = key_curve(list(at), knee[kneels, 0, 0] + forward)(times)
    height = knee[:, :, 2] + np.sqrt(np.maximum(lengths.thigh**2 - (hip_x[:, None] - knee[:, :, 0]) ** 2, 0.15**2))
    roll = np.arcsin(np.clip((height[:, 0] - height[:, 1]) / np.ptp(lengths.hip[:, 1]), -0.4, 0.4))
    return np.column_stack([hip_x, np.zeros(len(times)), height.mean(axis=1)]), roll


def _hands(side: str, style: HandsAndKneesStyle, own: FloatArray, times: FloatArray) -> FloatArray:
    """Middle of a fist on or over the floor (T, 3), world [m]."""
    first, under = 0.48, UNDER_M
    walk = {"right": ((OUT_S, 0.72), (2.85, under)), "left": ((2.45, 0.96), (3.27, under))}[side]
    x, z, place = np.full(len(times), first), np.full(len(times), FIST_M), first

    def move(clock: FloatArray, time: float, span: float, by: float) -> None:
        step = minimum_jerk((clock - time) / span)
        x[:] += by * step
        z[:] += style.hand_lift * 4 * step * (1 - step)

    for time, to in walk:
        move(own, time, HAND_SWING_S, to - place)
        place = to
    place = 0.0
    for time, knee, ahead in _half_steps(style):
        if knee != side:
            move(times, time, style.swing_s, ahead - place)
            place = ahead
    return np.column_stack([x, np.full(len(times), SIGNS[side] * HAND_BESIDE_M), z])


@dataclass(frozen=True)
class LimbEnds:
    """Where the limbs of a body near the floor end: pelvis (T, 3, 3), ankles, fists (T, 2, 3), feet (T, 2, 3, 3), arms on the floor (T, 1)."""

    root: FloatArray
    ankle: FloatArray
    foot: FloatArray
    fist: FloatArray
    on_floor: FloatArray


def place_limbs(qpos: FloatArray, ends: LimbEnds) -> None:
    """Legs to the feet, arms from hanging to the floor, in place."""
    character = humanoid()
    kinematics, chest = forward_kinematics(qpos, character), character.segment("thorax")
    thorax = kinematics.xpos[:, chest]
    turned = Rotation.from_quat(kinematics.xquat[:, chest], scalar_first=True)
    for number, (side, leg) in enumerate(zip(SIDES, legs(character))):
        qpos[:, 7 + leg.hinges] = solve_leg(leg, qpos[:, :3], ends.root, ends.ankle[:, number], ends.foot[:, number])
        fist = turned.inv().apply(ends.fist[:, number] - thorax)
        pole = np.tile([0.2, 0.4 * SIGNS[side], -1.0], (len(qpos), 1))
        reach = np.unwrap(arm_angles(side, fist, pole), axis=0)
        names = ("shoulder_flexion", "shoulder_abduction", "shoulder_rotation", "elbow_flexion")
        arm = 7 + character.joint_indices([f"{side}_{name}" for name in names])
        hanging = np.radians([RELAXED[f"arms_{name}"] for name in names])
        qpos[:, arm] = (1 - ends.on_floor) * hanging + ends.on_floor * reach


def _keep_over_feet(qpos: FloatArray, ends: LimbEnds, over: FloatArray, weight: FloatArray) -> None:
    """Move the pelvis, in place, until the COM is over a point (x, share) while only the feet bear load."""
    planned = qpos[:, 0].copy()
    for _ in range(12):
        error = over - forward_kinematics(qpos, humanoid()).com[:, 0]
        qpos[:, 0] += np.where(weight > 0, error, 0.0)
        place_limbs(qpos, ends)
    qpos[:, 0] = planned + weight * (qpos[:, 0] - planned)
    place_limbs(qpos, ends)


STYLE = HandsAndKneesStyle()
ENTRIES = (
    Entry(
        "crawl_hands_knees",
        "crawl",
        "gets down, crawls on hands and knees, gets up",
        crawl_hands_knees,
        {"distance_m": STYLE.distance, "cycle_s": 2 * STYLE.half_step_s, "stride_m": STYLE.stride},
    ),
)
