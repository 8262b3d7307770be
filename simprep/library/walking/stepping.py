"""Motions made of single flat steps from standing: side-steps, turns on the spot, a step forward or back.

Pressure, pelvis and arms follow from the steps. The pressure rests under one foot while the other is in the air; the
COM follows by the cart-table model. Durations and lengths are own choices of unhurried movement: 0.3 to 0.45 s in the
air.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from simprep.arrays import FloatArray
from simprep.character import SIDES
from simprep.library.entry import FPS
from simprep.library.parts.balance import later_period
from simprep.library.parts.feet import FootPath, Stance, both_feet, lowest_point
from simprep.library.parts.limbs import SIGNS
from simprep.library.parts.movement import between, support_point
from simprep.library.parts.posture import RELAXED, hinge_angles, set_hinges, trunk_rotation
from simprep.library.parts.whole_body import Plan, solve_whole_body
from simprep.library.stand import CENTRE_M, FEET_APART_M, STAND_HEIGHT_M, TOE_OUT
from simprep.motion.curves import Curve, key_curve
from simprep.motion.motion import Motion
from simprep.motion.rotations import axis_rotation


@dataclass(frozen=True)
class Step:
    """One foot goes somewhere else.

    Attributes:
        side: `left` or `right`.
        lift, land: when the foot leaves the floor and when it is down again [s].
        x, y: ankle afterwards, world [m].
        heading: direction of the body for this foot's new stance [rad].
        land_pitch_deg: pitch of the foot when it lands, toe up positive [deg].
    """

    side: str
    lift: float
    land: float
    x: float
    y: float
    heading: float = 0.0
    land_pitch_deg: float = 0.0


@dataclass(frozen=True)
class SteppingStyle:
    """How the steps of a sequence look.

    Attributes:
        clearance: of the foot's lowest point above the floor midway [m].
        heel_rise_s: time before lift at which the foot begins to roll [s].
        lift_pitch_deg: pitch of the foot at lift, toe up positive [deg].
        forward: pressure before the ankle of the foot that stays, at lift and at landing [m].
        com_height: while stepping [m].
        lead_deg: turn of the head ahead of the body [deg].
        arm_swing_deg: half the arc of the upper arms, against the feet [deg].
        lean_deg: forward lean of the trunk while stepping [deg].
    """

    clearance: float = 0.045
    heel_rise_s: float = 0.12
    lift_pitch_deg: float = -20.0
    forward: tuple[float, float] = (CENTRE_M, CENTRE_M)
    com_height: float = 0.975
    lead_deg: float = 0.0
    arm_swing_deg: float = 4.0
    lean_deg: float = 1.5


def standing(side: str) -> Stance:
    """Where the `left` or `right` foot stands at first, the body at the origin facing x."""
    return Stance(-100.0, 100.0, 0.0, SIGNS[side] * FEET_APART_M / 2, TOE_OUT)


def step_sequence(name: str, steps: Sequence[Step], duration: float, style: SteppingStyle) -> Motion:
    """A motion of steps, in order of time, from standing to standing; `duration` in seconds."""
    times = np.arange(round(duration * FPS) + 1) / FPS
    begin, end = steps[0].lift - 0.4, steps[-1].land + 0.4
    share = key_curve([begin, begin + 0.35, end - 0.35, end], [0.0, 1.0, 1.0, 0.0])(times)
    zmp = key_curve(*_pressure(steps, style, begin, end))(times)
    plan = _plan(times, steps, zmp, share, style)
    source = f"simprep library: {name}"
    return Motion(solve_whole_body(plan), FPS, plan.contacts, name=name, source=source, character=plan.character)


def step_cycle(
    name: str, steps: Sequence[Step], frames: int, shift: tuple[float, float], style: SteppingStyle
) -> Motion:
    """A cyclic motion of steps that repeat.

    Args:
        name: of the motion.
        steps: of one cycle, with times from 0 to the period; the foot of each must land within it.
        frames: of the cycle, at 60 per second.
        shift: travel per cycle [m].
        style: of the steps.
    """
    times = np.arange(frames) / FPS
    period, travel = frames / FPS, np.array(shift)
    long = []
    for number in range(-2, 3):
        for step in steps:
            x, y = later_period(np.array([step.x, step.y]), number, travel)
            long.append(
                replace(
                    step, lift=step.lift + number * period, land=step.land + number * period, x=float(x), y=float(y)
                )
            )
    zmp = key_curve(*_pressure(long, style))(times)
    plan = replace(_plan(times, long, zmp, np.ones(frames), style), shift=travel)
    qpos = solve_whole_body(plan)
    qpos[:, :2] -= qpos[0, :2]
    touch = {f"{step.side}_touch_down": round(step.land * FPS) for step in steps}
    source = f"simprep library: {name}"
    return Motion(qpos, FPS, plan.contacts, touch, name, source, loop=True, character=plan.character)


def _plan(times: FloatArray, steps: Sequence[Step], zmp: FloatArray, share: FloatArray, style: SteppingStyle) -> Plan:
    heading = _heading(steps)(times)
    ahead = key_curve([steps[0].lift - 0.25, steps[0].lift, steps[-1].lift - 0.1, steps[-1].land], [0.0, 1.0, 1.0, 0.0])
    hinges = np.tile(hinge_angles(RELAXED), (len(times), 1))
    lean = np.radians(style.lean_deg) * share
    look = np.radians(style.lead_deg) * ahead(times)
    set_hinges(hinges, {"neck_rotation": 0.6 * look, "head_rotation": 0.4 * look, "neck_flexion": -lean})
    swing = _arm_swing(steps, times) * np.radians(style.arm_swing_deg)
    for side in SIDES:
        hanging = np.radians(RELAXED["arms_shoulder_flexion"])
        set_hinges(hinges, {f"{side}_shoulder_flexion": hanging - SIGNS[side] * swing})
    return Plan(
        FPS,
        *both_feet([_foot(side, steps, style) for side in SIDES], times),
        zmp=zmp,
        com_height=STAND_HEIGHT_M + (style.com_height - STAND_HEIGHT_M) * share,
        root_rotation=trunk_rotation(heading, lean, np.zeros(len(times))),
        hinges=hinges,
    )


def _stances(side: str, steps: Sequence[Step]) -> list[Stance]:
    """Stances of a foot; before its first step it is where it would have come from."""
    mine = [step for step in steps if step.side == side]
    out = [replace(standing(side), end=mine[0].lift if mine else 100.0)]
    for number, step in enumerate(mine):
        after = mine[number + 1].lift if number + 1 < len(mine) else 100.0
        out.append(Stance(step.land, after, step.x, step.y, TOE_OUT + SIGNS[side] * step.heading))
    return out


def _foot(side: str, steps: Sequence[Step], style: SteppingStyle) -> FootPath:
    keys = [(-200.0, 0.0)]
    mine = [step for step in steps if step.side == side]
    for step in mine:
        up, down = style.lift_pitch_deg, step.land_pitch_deg
        keys += [(step.lift - style.heel_rise_s, 0.0), (step.lift, up), (step.lift + 0.08, 0.9 * up)]
        keys += [(step.land - 0.06, down), (step.land + 0.10, 0.0)] if down else [(step.land - 0.05, 0.0)]
    times, degrees = np.array(keys).T
    pitch = key_curve(list(times), np.radians(degrees))
    middle = np.array([(step.lift + step.land) / 2 for step in mine])
    lowest = lowest_point(side, axis_rotation("y", -pitch(middle)))
    via = tuple((float(time), 2, style.clearance - float(low)) for time, low in zip(middle, lowest))
    return FootPath(side, tuple(_stances(side, steps)), pitch=pitch, via=via)


def _pressure(
    steps: Sequence[Step], style: SteppingStyle, begin: float | None = None, end: float | None = None
) -> tuple[list[float], FloatArray]:
    """Pressure keys: times [s] and (K, 2) points [m]; between the feet at `begin` and `end`, where given."""
    stances = {side: _stances(side, steps) for side in SIDES}

    def point(side: str, time: float, forward: float) -> FloatArray:
        current = [stance for stance in stances[side] if stance.start <= time + 1e-9][-1]
        return support_point(side, current, forward)

    def middle(time: float) -> tuple[float, float]:
        return between((point("left", time, CENTRE_M), point("right", time, CENTRE_M)), 0.5)

    keys: list[tuple[float, float, float]] = []
    if begin is not None:
        keys += [(begin - 0.2, *middle(begin)), (begin, *middle(begin))]
    for step in steps:
        stays = SIDES[1 - SIDES.index(step.side)]
        for time, forward in ((step.lift - 0.02, style.forward[0]), (step.land + 0.02, style.forward[1])):
            x, y = point(stays, step.lift, forward)
            keys.append((time, float(x), float(y)))
    if end is not None:
        keys += [(end, *middle(end)), (end + 0.2, *middle(end))]
    table = np.array(keys)
    return list(table[:, 0]), table[:, 1:]


def _heading(steps: Sequence[Step]) -> Curve:
    """Heading of the pelvis over time: the mean of both feet [rad]."""
    current = {side: 0.0 for side in SIDES}
    keys = [(steps[0].lift - 0.15, 0.0)]
    for step in steps:
        current[step.side] = step.heading
        keys.append((step.land, sum(current.values()) / 2))
    times, angles = np.array(keys).T
    return key_curve(list(times), angles)


def _arm_swing(steps: Sequence[Step], times: FloatArray) -> FloatArray:
    """1 while the left foot swings through, -1 while the right does, smooth in between."""
    keys = [(steps[0].lift - 0.2, 0.0)]
    keys += [((step.lift + 2 * step.land) / 3, SIGNS[step.side]) for step in steps]
    keys += [(steps[-1].land + 0.4, 0.0)]
    at, values = np.array(keys).T
    return key_curve(list(at), values)(times)
