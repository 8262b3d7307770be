"""Fighting stance: standing in guard with a light bounce, and step-drag footwork in four directions, all cyclic.

Stance after Boxing Scotland: feet a little wider than the shoulders, rear heel up, knees slightly bent, weight even. In
step-drag footwork the foot nearer to the direction steps first and the other follows by the same length.
"""

from dataclasses import dataclass

import numpy as np

from simprep.arrays import FloatArray
from simprep.character import SIDES
from simprep.library.entry import FPS, Entry, mirrored
from simprep.library.parts.feet import FootPath, Stance, ankle_height, both_feet
from simprep.library.parts.limbs import SIGNS, arm_angles, limb_lengths
from simprep.library.parts.movement import GUARD_LEAD, GUARD_REAR, support_point
from simprep.library.parts.posture import Pose, hinge_angles, set_hinges, trunk_rotation
from simprep.library.parts.whole_body import Plan, solve_whole_body
from simprep.motion.curves import constant, key_curve
from simprep.motion.motion import Motion

FRONT, REAR = (0.18, 0.11, 8.0), (-0.18, -0.12, 32.0)
"""Left and right foot: x, y [m], toes outward [deg]."""
REAR_HEEL_DEG = -3.0
"""Pitch of the rear foot: its ball carries [deg]."""
FRONT_MID_M, BALL_M = 0.06, 0.13
"""Centre of pressure before the ankle, front and rear foot [m]."""
COM_M = 0.948
YAW_DEG, PITCH_DEG = -22.0, 5.0
TRUNK: Pose = {
    "lumbar_flexion": 5, "thorax_flexion": 8, "lumbar_rotation": -4, "thorax_rotation": -6, "neck_rotation": 18,
    "head_rotation": 13, "neck_flexion": -6,
}  # fmt: skip


@dataclass(frozen=True)
class Guard:
    """Standing in guard, left foot in front.

    Attributes:
        name: of the motion.
        frames: of the cycle; one breath.
        bounces: of the body per cycle.
        bounce: half the vertical excursion of the COM [m].
        sway: half the shift of the pressure between the feet, as a share of their distance.
    """

    name: str
    frames: int = 120
    bounces: int = 3
    bounce: float = 0.007
    sway: float = 0.05


@dataclass(frozen=True)
class Footwork:
    """One step-drag cycle, left foot in front.

    Attributes:
        name: of the motion.
        step: displacement per cycle: forward, to the left [m].
        frames: of the cycle.
        first, second: shares of the cycle at which the first and the second foot lift and land.
        clearance: height of the soles in the middle of a step [m].
        bounce: half the vertical excursion of the COM [m].
    """

    name: str
    step: tuple[float, float]
    frames: int = 54
    first: tuple[float, float] = (0.10, 0.37)
    second: tuple[float, float] = (0.55, 0.82)
    clearance: float = 0.035
    bounce: float = 0.006

    def leading(self) -> int:
        """Foot that steps first: 0 left (and front), 1 right (and rear)."""
        forward, left = self.step
        return 0 if forward + left > 0 else 1


def stand_in_guard(guard: Guard) -> Motion:
    """The cyclic motion of standing in guard."""
    phase = 2 * np.pi * np.arange(guard.frames) / guard.frames
    period = guard.frames / FPS
    stances = [Stance(0.0, period, x, y, np.radians(toes)) for x, y, toes in (FRONT, REAR)]
    front, rear = support_point("left", stances[0], FRONT_MID_M), support_point("right", stances[1], BALL_M)
    share = 0.5 + guard.sway * np.sin(phase)
    bounce = np.cos(guard.bounces * phase)
    return _solve(
        guard.name,
        [(stance,) for stance in stances],
        phase,
        pressure=share[:, None] * front + (1 - share[:, None]) * rear,
        height=COM_M + guard.bounce * bounce,
        lift=bounce,
        shift=np.zeros(2),
    )


def step_drag(footwork: Footwork) -> Motion:
    """The cyclic motion of footwork in guard."""
    phase = 2 * np.pi * np.arange(footwork.frames) / footwork.frames
    period = footwork.frames / FPS
    step = np.array(footwork.step)
    leading = footwork.leading()
    paths, points = [], []
    via: list[list[tuple[float, int, float]]] = []
    for number, (place, forward) in enumerate(((FRONT, FRONT_MID_M), (REAR, BALL_M))):
        up, down = footwork.first if number == leading else footwork.second
        paths.append(
            tuple(
                Stance(
                    (n - 1 + down) * period, (n + up) * period, place[0] + n * step[0], place[1] + n * step[1],
                    np.radians(place[2]),
                )
                for n in range(-2, 4)
            )
        )  # fmt: skip
        points.append([support_point(SIDES[number], stance, forward) for stance in paths[-1]])
        middle = 0.5 * (up + down)
        via.append([((n + middle) * period, 2, ankle_height() + footwork.clearance) for n in range(-2, 3)])
    keys = []
    for cycle in range(6):
        start = (cycle - 2) * period
        # each foot carries alone a little longer than the other is in the air
        for edge, foot, at in (
            (footwork.first[0] - 0.02, 1 - leading, cycle),
            (footwork.first[1] + 0.02, 1 - leading, cycle),
            (footwork.second[0] - 0.02, leading, cycle + 1),
            (footwork.second[1] + 0.02, leading, cycle + 1),
        ):
            if at < len(points[foot]):
                keys.append((start + edge * period, *points[foot][at]))
    table = np.array(keys)
    pressure = key_curve(list(table[:, 0]), table[:, 1:])(np.arange(footwork.frames) / FPS)
    bounce = -np.cos(2 * phase - 2 * np.pi * sum(footwork.first))
    return _solve(
        footwork.name, paths, phase, pressure=pressure, height=COM_M + footwork.bounce * bounce, lift=bounce,
        shift=step, via=via,
    )  # fmt: skip


def _solve(
    name: str,
    stances: list[tuple[Stance, ...]],
    phase: FloatArray,
    pressure: FloatArray,
    height: FloatArray,
    lift: FloatArray,
    shift: FloatArray,
    via: list[list[tuple[float, int, float]]] | None = None,
) -> Motion:
    """Whole-body motion in guard; `pressure` is the planned ZMP, `lift` the bounce from -1 to 1."""
    times = np.arange(len(phase)) / FPS
    via = via or [[], []]
    feet = [
        FootPath(side, stances[number], pitch=constant(np.radians(REAR_HEEL_DEG) * number), via=tuple(via[number]))
        for number, side in enumerate(SIDES)
    ]
    hinges = np.tile(hinge_angles(TRUNK), (len(times), 1))
    breath = np.radians(0.8) * np.sin(phase)
    set_hinges(hinges, {"thorax_flexion": np.radians(TRUNK["thorax_flexion"]) - breath})
    for number, (side, (fist, elbow, pronation)) in enumerate(zip(SIDES, (GUARD_LEAD, GUARD_REAR))):
        outward = np.array([1.0, SIGNS[side], 1.0])
        place = np.array(fist) * outward + limb_lengths().shoulder[number]
        fists = place + np.outer(np.roll(lift, len(lift) // 12), [0.002, 0.0, 0.006])
        angles = arm_angles(side, fists, np.tile(np.array(elbow) * outward, (len(times), 1)))
        names = ("shoulder_flexion", "shoulder_abduction", "shoulder_rotation", "elbow_flexion")
        set_hinges(hinges, {f"{side}_{joint}": angles[:, k] for k, joint in enumerate(names)})
        set_hinges(hinges, {f"{side}_forearm_pronation": np.radians(pronation)})
    still = np.zeros(len(times))
    plan = Plan(
        FPS,
        *both_feet(feet, times),
        zmp=pressure,
        com_height=height,
        root_rotation=trunk_rotation(still + np.radians(YAW_DEG), still + np.radians(PITCH_DEG), still),
        hinges=hinges,
        shift=shift,
    )
    qpos = solve_whole_body(plan)
    qpos[:, :2] -= qpos[0, :2]
    source = f"simprep library: {name}"
    return Motion(qpos, FPS, plan.contacts, name=name, source=source, loop=True, character=plan.character)


GUARD = Guard("guard_left_lead")
STEPS = {"forward": (0.24, 0.0), "backward": (-0.22, 0.0), "left": (0.0, 0.20), "right": (0.0, -0.20)}
"""Displacement per cycle: forward, to the left [m]."""


def _step_entry(work: Footwork, direction: str) -> Entry:
    speed = float(np.hypot(*work.step)) * FPS / work.frames
    return Entry(
        work.name,
        "guard",
        f"steps {direction} in guard, left foot in front",
        lambda: step_drag(work),
        {"lead": "left", "direction": direction, "speed_m_s": round(speed, 2)},
    )


def _mirrored(entry: Entry) -> Entry:
    """The same with the right foot in front; a step to the left becomes one to the right."""
    sides = {"left": "right", "right": "left"}
    direction = str(entry.parameters.get("direction", ""))
    direction = sides.get(direction, direction)
    name = "_".join(filter(None, ("guard_right_lead", direction)))
    does = f"steps {direction} in guard" if direction else "stands in guard"
    return mirrored(entry, name, f"{does}, right foot in front")


_LEFT_LEAD = (
    Entry(GUARD.name, "guard", "stands in guard, left foot in front", lambda: stand_in_guard(GUARD), {"lead": "left"}),
    *(_step_entry(Footwork(f"{GUARD.name}_{direction}", step), direction) for direction, step in STEPS.items()),
)

ENTRIES = (*_LEFT_LEAD, *map(_mirrored, _LEFT_LEAD))
