"""From a drawn clip to poses: postures of the pieces, feet on their places, centre of mass with its force peaks.

Feet roll and pivot without slipping (`simprep.library.parts.feet`), the centre of mass follows the planned pressure
point by the cart-table model and the wanted heave, and legs follow by the whole-body solver of the built-in motions.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter1d, maximum_filter1d
from scipy.spatial.transform import Rotation

from simprep.arrays import BoolArray, FloatArray, IntArray
from simprep.duel.synthetic import pieces
from simprep.duel.synthetic.footwork import Stay, foot_path, pressure_point, stays_of
from simprep.duel.synthetic.heave import Heave, heave
from simprep.duel.synthetic.kinds import SIDES
from simprep.duel.synthetic.pieces import FIRST_HINGE, PITCH, PIVOT, Piece, guard_posture
from simprep.duel.synthetic.planned import FPS, Fighter, Planned
from simprep.humanoid_model import GRAVITY, humanoid
from simprep.library.parts.balance import com_from_zmp
from simprep.library.parts.limbs import leg_joints
from simprep.library.parts.posture import trunk_rotation
from simprep.library.parts.whole_body import JointSwing, Plan, follow_com
from simprep.motion.curves import key_curve, minimum_jerk
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.rotations import continuous_quat

GUARD_M = 0.93
"""Height of the centre of mass in guard, at the cuts [m]."""
DEEPEST_M = 0.09
"""The body bobs no deeper than this within an action [m]."""
SETTLE_S, SMOOTH_S = 0.26, 0.016
"""Differences of posture between actions fade over this time; Gaussian over all postures [s]."""
TOES_DOWN = np.radians(38)
"""Pitch of the feet when a jump begins and ends [rad]."""
CROUCHING, CROUCH_M = 0.7, 0.13
"""Depth of the force minimum before the push of a jump, and after its landing, in body weights; the body bobs no deeper
than this then [m]."""
TOLERANCE_M, PASSES = 3e-4, 8
"""How exactly the centre of mass follows its path where the legs reach, and after how many passes it is left [m]."""
MISSED_M, BENT, DIP_M, YIELDS = 0.005, np.radians(2.0), 0.01, 6
"""A foot missed by more [m], a leg bent too far [rad] or a foot in the floor by more [m] yields, so often at most."""
DEEP_M, CLEAR_S = 0.05, 0.05
"""A swinging foot this deep in the floor [m] follows its path, which rises so long before and after [s]."""
SOLE_M = 0.16
"""Ankle to toes [m]."""
LEAN_S, LEAN_M = 0.10, 0.02
"""Over which time, and by how much at once, the body is held back towards a foot that is missed [s, m]."""
PIVOT_MOST = np.radians(15)
"""A foot pivots no farther than this at once [rad]."""
HEEL_HIGHEST = np.radians(60)
"""Pitch at which a foot stands on the tips of its toes [rad]."""


@dataclass(frozen=True)
class Performance:
    """One fighter's clip.

    Attributes:
        qpos: (T, nq) poses at 60 frames per second, without noise.
        contacts: (T, 2) supporting feet.
        variants: for every action the built-in motion it was made from, or its role.
        peaks: (N,) frame of every action's force peak.
        missed_m: (T,) how far the worse foot is from where it should be, where a leg is too short.
    """

    qpos: FloatArray
    contacts: BoolArray
    variants: tuple[str, ...]
    peaks: IntArray
    missed_m: FloatArray


def perform(fighter: Fighter, rng: np.random.Generator) -> Performance:
    """Poses of one fighter through a clip; `rng` draws defences, amplitudes and style."""
    actions = fighter.done
    cuts = np.array([action.start for action in actions] + [actions[-1].end], dtype=np.int64)
    total = int(cuts[-1])
    times = np.arange(total) / FPS
    chosen = _choose(actions, fighter.lead, rng)
    stays = stays_of(fighter, actions)
    channels, swing = _postures(fighter, actions, chosen, stays, total, rng)
    flights = np.array([0.0, *(action.flight for action in actions)])
    course = heave(cuts, _minima(actions, cuts), _heights(actions, chosen, rng), flights, FPS)
    heading = key_curve(list(cuts / FPS), [actions[0].heading, *(action.heading for action in actions)])(times)
    lean, raised = np.zeros((total, 2)), np.zeros((total, 2))
    plan, com = _plan(actions, fighter.lead, stays, channels, swing, heading, course, flights, cuts, raised)
    best = solved = _solve(plan, com)
    for _ in range(YIELDS):
        _, missed, excess, dip = solved
        if missed.max() < MISSED_M and np.abs(excess).max() < BENT and dip.max() < DIP_M:
            break
        lean += _yield(channels, missed, excess, plan, com)
        raised += _rise(swing, dip, plan.contacts)
        plan, com = _plan(actions, fighter.lead, stays, channels, swing, heading, course, flights, cuts, raised)
        com[:, :2] += gaussian_filter1d(lean, 0.5 * LEAN_S * FPS, axis=0)
        solved = _solve(plan, com)
        if solved[1].sum() + solved[3].sum() < best[1].sum() + best[3].sum():
            best = solved
    qpos, missed, _, _ = best
    names = tuple(name for name, _, _ in chosen)
    return Performance(qpos, plan.contacts, names, course.peaks, missed.max(axis=1))


def _yield(channels: FloatArray, missed: FloatArray, excess: FloatArray, plan: Plan, com: FloatArray) -> FloatArray:
    """What a body does whose leg is too short or too stiff; feet change in place, the lean (T, 2) is returned.

    The heel rises where the ankle would bend too far or the leg does not reach, the foot pivots where the hip would
    turn too far, and the body stays nearer to a foot that it misses.
    """
    leg = plan.character.groups["left_leg"]
    dorsiflexion, rotation = leg.index("left_ankle_dorsiflexion"), leg.index("left_hip_rotation")
    need = gaussian_filter1d(maximum_filter1d(missed, 9, axis=0), 2.0, axis=0)
    bent = gaussian_filter1d(maximum_filter1d(np.maximum(excess[..., dorsiflexion], 0), 13, axis=0), 3.0, axis=0)
    rise = np.arcsin(np.clip(1.2 * need / SOLE_M, 0, 0.7)) + bent
    pitch = channels[:, PITCH:PIVOT]
    channels[:, PITCH:PIVOT] = np.where(rise > 1e-4, np.maximum(pitch - rise, np.minimum(pitch, -HEEL_HIGHEST)), pitch)
    turned = np.clip(excess[..., rotation], -PIVOT_MOST, PIVOT_MOST)
    turn = maximum_filter1d(np.maximum(turned, 0), 25, axis=0) - maximum_filter1d(np.maximum(-turned, 0), 25, axis=0)
    channels[:, PIVOT:] += gaussian_filter1d(turn, 6.0, axis=0)
    towards = plan.foot_position[..., :2] - com[:, None, :2]
    towards /= np.maximum(np.linalg.norm(towards, axis=-1, keepdims=True), 0.05)
    wide = round(2 * LEAN_S * FPS)
    held = gaussian_filter1d(maximum_filter1d(np.minimum(missed, LEAN_M), 2 * wide + 1, axis=0), LEAN_S * FPS, axis=0)
    return np.asarray(np.sum(held[..., None] * towards, axis=1))


def _rise(swing: FloatArray, dip: FloatArray, contacts: BoolArray) -> FloatArray:
    """How far (T, 2) the paths of swinging feet that pass through the floor rise [m]; kicks change in place.

    A kicking leg leaves its own angles sooner for its foot's path, which stays above the floor.
    """
    wide = 2 * round(CLEAR_S * FPS) + 1
    deep = gaussian_filter1d(maximum_filter1d(dip, wide, axis=0), 0.5 * CLEAR_S * FPS, axis=0)
    swing *= 1 - minimum_jerk(np.clip(deep / DEEP_M, 0, 1))
    away = np.stack([distance_transform_edt(~contacts[:, side]) for side in range(2)], axis=1)
    return np.asarray(deep * minimum_jerk(np.clip((away - 1) / (CLEAR_S * FPS), 0, 1)))


def _plan(
    actions: list[Planned],
    lead: str,
    stays: list[list[Stay]],
    channels: FloatArray,
    swing: FloatArray,
    heading: FloatArray,
    course: Heave,
    flights: FloatArray,
    cuts: IntArray,
    raised: FloatArray,
) -> tuple[Plan, FloatArray]:
    """The plan of a clip, and the path of the centre of mass (T, 3)."""
    times = np.arange(len(channels)) / FPS
    poses = [foot_path(side, stays[side], channels, flights, cuts).at(times) for side in range(2)]
    position = np.stack([pose[0] for pose in poses], axis=1)
    position[..., 2] += raised
    rotation = np.stack([pose[1] for pose in poses], axis=1)
    contacts = np.stack([pose[2] for pose in poses], axis=1)
    zmp = pressure_point(actions, lead, position, rotation, contacts)
    character = humanoid()
    low, high = character.model.jnt_range[1:].T
    hinges = np.clip(channels[:, FIRST_HINGE:PITCH], low, high)
    plan = Plan(
        fps=FPS, foot_position=position, foot_rotation=rotation, contacts=contacts, zmp=zmp, com_height=course.height,
        root_rotation=trunk_rotation(heading + channels[:, 0], channels[:, 1], channels[:, 2]), hinges=hinges,
        joint_swing=JointSwing(hinges[:, leg_joints(character)], swing), character=character,
    )  # fmt: skip
    return plan, np.column_stack([com_from_zmp(zmp, course.height, FPS), course.height])


def _solve(plan: Plan, com: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Poses (T, nq) within the ranges of all joints, and what they fall short of.

    That is (T, 2) how far each supporting foot is from its place [m], (T, 2, 6) by how much the hinges of supporting
    legs would have to leave their ranges, signed [rad], and (T, 2) how deep each swinging foot is in the floor [m].
    """
    character = plan.character
    qpos = np.zeros((len(com), character.nq))
    quat = Rotation.from_matrix(plan.root_rotation).as_quat(scalar_first=True)
    qpos[:, 3:7] = continuous_quat(quat)
    qpos[:, 7:] = plan.hinges
    qpos[:, :3] = com - [0.0, 0.0, 0.06]
    follow_com(plan, qpos, com, TOLERANCE_M, PASSES)
    low, high = character.model.jnt_range[1:].T
    wanted = qpos[:, 7:].copy()
    qpos[:, 7:] = np.clip(wanted, low, high)
    kinematics = forward_kinematics(qpos, character)
    missed = np.linalg.norm(kinematics.xpos[:, character.feet] - plan.foot_position, axis=-1)
    excess = (wanted - qpos[:, 7:])[:, leg_joints(character)]
    dip = np.maximum(-kinematics.foot_points[..., 2].min(axis=-1), 0.0)
    return (
        qpos,
        np.where(plan.contacts, missed, 0.0),
        np.where(plan.contacts[..., None], excess, 0.0),
        np.where(plan.contacts, 0.0, dip),
    )


Choice = tuple[str, Piece | None, float]


def _choose(actions: list[Planned], lead: str, rng: np.random.Generator) -> list[Choice]:
    """(variant, piece, amplitude) of every action; a limb comes back as it went out."""
    out: list[Choice] = []
    under_way: dict[str, Choice] = {}
    for action in actions:
        kind = action.kind
        side = kind.partition("_")[0]
        amplitude = float(rng.uniform(0.9, 1.06))
        choice: Choice
        if kind == "neutral":
            choice = _neutral(action, lead, amplitude, rng)
        elif kind in ("jump_up", "jump_down"):
            choice = ("jump", None, amplitude)
        elif kind.endswith(("_bwd", "_down", "downup")):
            choice = under_way[side]
        else:
            hand = kind.rpartition("_")[2] if "_to_" in kind else side
            choice = (action.variant, pieces.piece(action.variant), amplitude)
            under_way[hand] = choice
        out.append(choice)
    return out


def _neutral(action: Planned, lead: str, amplitude: float, rng: np.random.Generator) -> Choice:
    role = action.role
    if role == "block":
        name = str(rng.choice(pieces.BLOCKS[action.react]))
    elif role == "dodge":
        name = str(rng.choice(pieces.DODGES[lead]))
    elif role == "feint":
        side = SIDES[int(rng.random() < 0.5)]
        name = pieces.PUNCHES[side, "lead" if side == lead else "rear"][0]
        return ("feint", pieces.piece(name), 0.28 * amplitude)
    elif role == "knee_feint":
        return ("feint", pieces.piece("sway_back"), 0.5 * amplitude)
    else:
        return (role, None, amplitude)
    return (name, pieces.piece(name), amplitude)


def _postures(
    fighter: Fighter,
    actions: list[Planned],
    chosen: list[Choice],
    feet: list[list[Stay]],
    total: int,
    rng: np.random.Generator,
) -> tuple[FloatArray, FloatArray]:
    """(T, channels) postures and (T, 2) share of the kicking leg's own angles."""
    guard = guard_posture(fighter.lead)
    channels, swing = np.tile(guard, (total, 1)), np.zeros((total, 2))
    jump, character = np.zeros_like(guard), humanoid()
    for limb in SIDES:
        jump[FIRST_HINGE + character.joint(f"{limb}_shoulder_flexion")] = 0.25
    for number, (action, (_, found, amplitude)) in enumerate(zip(actions, chosen)):
        part = slice(action.start, action.end)
        shares = np.arange(action.end - action.start) / (action.end - action.start)
        kind = action.kind
        side = SIDES.index(kind.partition("_")[0]) if kind.partition("_")[0] in SIDES else 0
        wave = 0.5 - 0.5 * np.cos(2 * np.pi * shares)
        if found is None:
            posture = guard + wave[:, None] * _idle(action, rng, jump)
        elif kind == "neutral":
            posture = pieces.there_and_back(found, shares, amplitude)
        elif kind.endswith("bwdfwd") or "_to_" in kind:
            before = chosen[number - 1]
            assert before[1] is not None
            posture = pieces.back_and_out(before[1], found, shares, before[2], amplitude)
        elif kind.endswith("fwdbwd"):
            posture = pieces.there_and_back(found, shares, amplitude)
        elif kind.endswith("downup"):
            posture = pieces.back_and_out(found, found, shares, amplitude, amplitude)
        elif kind.endswith("_up"):
            lift = next(step.lift for step in reversed(action.steps) if step.foot == side)
            # out of a jump the body turns into the kick when it has left the floor
            lift = 0.68 if "jump" in kind else min(lift, 0.6)
            posture = pieces.way_out(found, shares, amplitude, lift)
        elif kind.endswith("_down"):
            land = next((step.land for step in action.steps if step.foot == side), 0.6)
            posture = pieces.way_back(found, shares, amplitude, min(max(land, 0.4), 0.9))
        else:
            posture = (pieces.way_back if kind.endswith("bwd") else pieces.way_out)(found, shares, amplitude)
        channels[part] = posture
    for side, stays in enumerate(feet):
        for stay, following in pairwise(stays):
            if stay.kick:
                a, b = stay.end * FPS, following.start * FPS
                frames = np.arange(int(np.ceil(a)), min(int(b), total - 1) + 1)
                rise = minimum_jerk((frames - a) / (0.16 * FPS))
                fall = minimum_jerk((b - frames) / (0.18 * FPS))
                swing[frames, side] = rise * fall
            if stay.flies:  # the toes leave the floor last and reach it first
                frames = np.arange(total)
                rise = np.clip(1 - (stay.end * FPS - frames) / (0.13 * FPS), 0, 1) * (frames <= stay.end * FPS)
                fall = np.clip(1 - (frames - following.start * FPS) / (0.13 * FPS), 0, 1) * (
                    frames >= following.start * FPS
                )
                between = (frames > stay.end * FPS) & (frames < following.start * FPS)
                channels[:, PITCH + side] -= TOES_DOWN * minimum_jerk(np.maximum(np.maximum(rise, fall), between))
    _fade(channels, actions)
    offset = rng.normal(0, np.radians(2.5), len(guard))
    keys = np.array([0, *(action.end for action in actions)]) / FPS
    wander = key_curve(list(keys), rng.normal(0, np.radians(1.8), (len(keys), len(guard))))(np.arange(total) / FPS)
    legs = np.zeros(len(guard), dtype=bool)
    legs[FIRST_HINGE + leg_joints(character).ravel()] = True
    legs[PITCH:] = True
    channels[:, ~legs] += (offset + wander)[:, ~legs]
    return np.asarray(gaussian_filter1d(channels, SMOOTH_S * FPS, axis=0, mode="nearest")), swing


def _idle(action: Planned, rng: np.random.Generator, jump: FloatArray) -> FloatArray:
    """Posture in the middle of an action without a piece."""
    change, character = np.zeros_like(jump), humanoid()
    if action.kind.startswith("jump"):
        return jump
    size = 1.0
    trunk = {"lumbar_flexion": 2.0, "thorax_flexion": 2.5, "lumbar_bending": 2.0, "thorax_bending": 2.0}
    if action.role == "hit":
        change[0], change[1] = rng.normal(0, np.radians(9)), np.radians(-rng.uniform(4, 12))
        trunk = {
            "thorax_flexion": -9.0,
            "neck_flexion": -14.0,
            "lumbar_bending": rng.normal(0, 6),
            "neck_rotation": 8.0,
        }
        size = float(rng.uniform(0.7, 1.3))
    elif action.role == "retreat":
        change[1] = np.radians(-rng.uniform(1, 6))
    for name, degrees in trunk.items():
        draw = size if action.role == "hit" else float(rng.normal())
        change[FIRST_HINGE + character.joint(name)] += np.radians(degrees) * draw
    for side in SIDES:
        change[FIRST_HINGE + character.joint(f"{side}_shoulder_flexion")] += np.radians(rng.normal(0, 4))
        change[FIRST_HINGE + character.joint(f"{side}_elbow_flexion")] += np.radians(rng.normal(0, 5))
    return change


def _fade(channels: FloatArray, actions: list[Planned]) -> None:
    """Let differences between the end of an action and the beginning of the next fade, in place."""
    for action in actions[1:]:
        at = action.start
        jump = channels[at] - (2 * channels[at - 1] - channels[at - 2])
        length = min(round(SETTLE_S * FPS), round(0.7 * (action.end - at)))
        left = 1 - minimum_jerk((np.arange(length) + 1) / length)
        channels[at : at + length] -= left[:, None] * jump


def _minima(actions: list[Planned], cuts: IntArray) -> FloatArray:
    """(N + 1,) acceleration at the cuts [m/s^2]: long actions bob slowly, lest the knees bend too far."""
    length = np.diff(cuts) / FPS
    most = 2 * np.pi**2 * DEEPEST_M / length**2
    limit = np.minimum(np.append(most, np.inf), np.append(np.inf, most))
    wanted = GRAVITY * np.array([0.3, *(action.strength for action in actions)])
    minima = -np.minimum(wanted, limit)
    crouch = np.minimum(CROUCHING * GRAVITY, 2 * np.pi**2 * CROUCH_M / length**2)
    for number, action in enumerate(actions):
        if action.kind.endswith("jump_up"):
            minima[number] = -crouch[number]
        if action.kind.endswith("jump_down"):
            minima[number + 1] = -crouch[number]
    return np.asarray(minima)


def _heights(actions: list[Planned], chosen: list[Choice], rng: np.random.Generator) -> FloatArray:
    """(N + 1,) height of the centre of mass at the cuts [m]."""
    heights = [GUARD_M]
    for action, (_, found, _) in zip(actions, chosen):
        rise = float(rng.normal(0, 0.006))
        if found is not None and action.kind.endswith(("_up", "downup")):
            rise += 0.85 * found.rise_m
        heights.append(GUARD_M + rise)
    return np.array(heights)
