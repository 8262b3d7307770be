"""Ground contact of imported motions: find the floor, place and hold standing feet, then solve the whole pose."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from simprep.arrays import BoolArray, FloatArray, IndexArray
from simprep.character import ROLES, Character
from simprep.humanoid_model import GRAVITY
from simprep.motion.contacts import contacts_of_points, stances, without_brief
from simprep.motion.foot_passage import place_feet
from simprep.motion.footholds import FootPoses, sole_points
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.retarget import RetargetSettings, Solution, solve
from simprep.motion.robot_ik import at_full_speed, solve_robot
from simprep.motion.self_contact import own_overlap
from simprep.motion.set_down import set_down
from simprep.motion.targets import ORIENTED, UPRIGHT, Targets, unit

ANKLES = (ROLES.index("left_foot"), ROLES.index("right_foot"))
HIPS = (ROLES.index("left_thigh"), ROLES.index("right_thigh"))
KNEES = (ROLES.index("left_shank"), ROLES.index("right_shank"))
ARMS_AND_KNEES = tuple(
    ROLES.index(name) for name in ROLES if name.endswith(("hand", "forearm", "shank")) or name in ("pelvis", "head")
)
LIMB_RADIUS = 0.045
"""Radius of the limbs where they touch the floor, for finding it [m]."""
UNEVEN = 0.08
"""Footholds whose heights vary by more than this are not on one level floor [m]."""
STRETCH = 0.9998
"""A standing leg is at most this share of its length long."""
HIGHER = 0.012
"""A foot this much higher than a standing one does not stand [m]."""
BRIEFEST_S = 0.06
"""Shorter stances are removed [s]."""
ROUNDS = 2
"""How often the body follows its feet, and then the footholds the body."""
FOLLOW_S = 0.03
"""Width of the Gaussian that smooths the body's shift [s]."""
STRAY_S = 0.5
"""The body follows its feet for about this long, then returns to the source's path [s]."""
KEPT_STRAY_S = 0.1
"""The same for several people, who must keep the distances between them [s]."""
PREROLL_S = 0.25
TOUCHING = 0.005
"""A foot this high touches the floor [m]."""
OVERLAPPING = 0.005
"""A body that is deeper in itself is worth a word [m]."""
HOVERING = 0.01
"""Setting the body down by more than this gives a warning [m]."""


@dataclass(frozen=True)
class Placed:
    """A retargeted clip on the floor z = 0.

    Attributes:
        qpos: (T, nq) poses.
        contacts: (T, 2) feet that stand.
        unsettled: (T,) frames whose inverse kinematics did not settle.
        warnings: what was changed.
    """

    qpos: FloatArray
    contacts: BoolArray
    unsettled: BoolArray
    warnings: tuple[str, ...] = ()


def place_on_floor(targets: Targets, character: Character, settings: RetargetSettings | None = None) -> Placed:
    """Find the floor, place the feet and solve the clip.

    A loop is solved as the middle one of three cycles, so that its ends fit. Feet are placed at the frame rate of the
    targets, poses are solved at that of the result.

    Args:
        targets: the source with our bone lengths, anywhere over its own floor.
        character: the body.
        settings: of the inverse kinematics.
    """
    step = targets.step
    whole = targets if step is None else _three_cycles(targets, step)
    levelled, warnings = level_floor(whole, character)
    feet = FootPoses(levelled.positions[:, ANKLES], levelled.orientations[:, 3:5])
    soles = sole_points(feet, character)
    touching = contacts_of_points(soles, targets.fps)
    lowest = soles[..., 2].min(axis=-1)
    touching &= ~((lowest - lowest[:, ::-1] > HIGHER) & touching[:, ::-1])
    touching = without_brief(touching, BRIEFEST_S * targets.fps)
    whole = levelled
    for turn in range(ROUNDS + 1):
        feet = FootPoses(whole.positions[:, ANKLES], levelled.orientations[:, 3:5])
        placed, contacts = place_feet(
            feet, whole.positions[:, HIPS], whole.positions[:, KNEES], touching, targets.fps, character
        )
        if turn == ROUNDS:
            break
        shift = _smooth_mean(placed.position - feet.position, contacts, FOLLOW_S * targets.fps)
        whole = replace(whole, positions=whole.positions + shift[:, None])
        whole.positions[...] -= _strayed(whole, levelled)[:, None]
    whole = _follow(whole, levelled, placed, contacts, character).output()
    contacts = contacts[:: targets.stride]
    n = len(contacts) // 3
    shank = whole.positions[:, KNEES] - whole.positions[:, ANKLES]
    standing = contacts & (shank[..., 2] > UPRIGHT * np.linalg.norm(shank, axis=-1))  # kneeling, a foot only lies there
    if step is not None:
        before = min(n, round(PREROLL_S * whole.fps))
        keep = slice(n - before, 2 * n)
        part = replace(whole, positions=whole.positions[keep], orientations=whole.orientations[keep])
        solution = _solved(part, standing[keep], character, settings)
        qpos, unsettled = solution.qpos[before:], solution.unsettled[before:]
        contacts, standing = contacts[n : 2 * n], standing[n : 2 * n]
        qpos[:, :3] -= step
    else:
        solution = _solved(whole, standing, character, settings)
        qpos, unsettled = solution.qpos, solution.unsettled
    if character.origin:  # a robot; a person's arms may brush the trunk
        deep = own_overlap(qpos, character)
        if deep.max(initial=0.0) > OVERLAPPING:
            warnings.append(f"the body is up to {1e3 * deep.max():.0f} mm in itself (frame {int(deep.argmax())})")
        slowed = at_full_speed(qpos, whole.fps, character)
        if slowed:
            warnings.append(f"faster than the body's joints can turn, so slowed: {', '.join(slowed)}")
    lowered = set_down(qpos, whole.fps, character, step is not None)
    if lowered.max(initial=0.0) > HOVERING:
        warnings.append(f"the body hovered over the floor by up to {lowered.max():.2f} m without falling: set down")
    qpos[:, 2] -= lowered
    # a kneeling or lying foot supports where it touches
    shown = forward_kinematics(qpos, character).foot_points[..., 2].min(axis=-1)
    contacts &= standing | (shown < TOUCHING)
    return Placed(qpos, contacts, unsettled, tuple(warnings))


def _solved(targets: Targets, standing: BoolArray, character: Character, settings: RetargetSettings | None) -> Solution:
    """Poses on the targets: of a robot within all its limits, of other bodies within their ranges and over the floor."""
    return (solve_robot if character.origin else solve)(targets, standing, character, settings)


def _three_cycles(targets: Targets, step: FloatArray) -> Targets:
    positions = np.concatenate([targets.positions + cycle * step for cycle in range(3)])
    return replace(targets, positions=positions, orientations=np.tile(targets.orientations, (3, 1, 1, 1)))


def level_floor(targets: Targets, character: Character) -> tuple[Targets, list[str]]:
    """Targets shifted so that the floor is at z = 0 and level, and warnings.

    The floor is the median height of the lower foot's sole while it hardly moves. Where knees, hands or the trunk come
    lower (crawling), they tell the floor.

    Args:
        targets: the source with our bone lengths.
        character: the body.
    """
    feet = FootPoses(targets.positions[:, ANKLES], targets.orientations[:, 3:5])
    points = sole_points(feet, character)
    lowest = points[..., 2].min(axis=-1)  # (T, 2)
    lower = lowest.min(axis=1)
    n, fps = len(lower), targets.fps
    # without the vertical speed: uneven ground, or a lost hip height, would hide contacts
    still = _slowest_point(points[..., :2], fps) < 0.4
    footing = still & (lowest < lower[:, None] + 0.03)
    footing = without_brief(footing, 0.08 * fps)
    known = np.flatnonzero(footing.any(axis=1))
    limbs = targets.positions[:, ARMS_AND_KNEES, 2].min(axis=1) - LIMB_RADIUS
    warnings = []
    level = np.full(n, float(np.median(lower[known])) if len(known) else float(np.percentile(lower, 10)))
    crawling = float(np.percentile(limbs, 20))
    flat_hips = n > 0.5 * fps and np.ptp(targets.positions[:, 0, 2]) < 0.003 and np.ptp(lower) > 0.01
    if crawling < level[0] - 0.01:
        level[:] = crawling
    elif flat_hips:
        level = _follow_feet(lower, known, fps) - _flight_arcs(footing, fps)
        warnings.append(
            "the hips stay at one height throughout the file, so their vertical movement is lost: restored from the "
            "standing foot (and gravity in flight)"
        )
    elif len(known) > 2 and np.ptp(np.percentile(lower[known], [5, 95])) > UNEVEN:
        level = _follow_feet(lower, known, fps)
        warnings.append(f"the ground is uneven (by {np.ptp(np.percentile(lower[known], [5, 95])):.2f} m): levelled")
    positions = targets.positions.copy()
    positions[..., 2] -= level[:, None]
    return replace(targets, positions=positions), warnings


def _follow_feet(lower: FloatArray, known: IndexArray, fps: float) -> FloatArray:
    """Height of the ground under the standing foot (T,), interpolated in flight [m]."""
    if not len(known):
        return np.full(len(lower), float(lower.min()))
    level = np.interp(np.arange(len(lower)), known, lower[known])
    return np.asarray(gaussian_filter1d(level, 0.03 * fps, mode="nearest"))


def _flight_arcs(footing: BoolArray, fps: float) -> FloatArray:
    """Rise of the body (T,) in free flight between two stances: g t (T - t) / 2 [m]."""
    out = np.zeros(len(footing))
    for first, after in stances(np.asarray(~footing.any(axis=1))):
        if first > 0 and after < len(out):
            t = np.arange(1, after - first + 1) / fps
            out[first:after] = 0.5 * GRAVITY * t * ((after - first + 1) / fps - t)
    return np.asarray(gaussian_filter1d(out, 0.015 * fps, mode="nearest"))


def _slowest_point(points: FloatArray, fps: float) -> FloatArray:
    """Speed of each foot's slowest sole point (T, 2) [m/s]."""
    if len(points) < 2:
        return np.zeros(points.shape[:2])
    smooth = gaussian_filter1d(points, 0.015 * fps, axis=0, mode="nearest")
    return np.asarray(np.linalg.norm(np.gradient(smooth, 1 / fps, axis=0), axis=-1).min(axis=-1))


def _strayed(targets: Targets, source: Targets) -> FloatArray:
    """Deviation of a body from the source's path over the floor (T, 3), short deviations left out [m]."""
    way = targets.positions[:, 0] - source.positions[:, 0]
    stray_s = KEPT_STRAY_S if targets.travel_kept else STRAY_S
    return np.asarray(gaussian_filter1d(way, stray_s * targets.fps, axis=0, mode="nearest") * [1.0, 1.0, 0.0])


def _follow(targets: Targets, source: Targets, feet: FootPoses, contacts: BoolArray, character: Character) -> Targets:
    """Shift the body by the smoothed mean shift of its standing feet; knees stay in their planes."""
    fps = targets.fps
    thigh, shank = (float(np.linalg.norm(character.rest_offset(f"left_{part}"))) for part in ("shank", "foot"))
    moved = feet.position - targets.positions[:, ANKLES]
    shift = _smooth_mean(moved, contacts, 0.12 * fps)
    moved_on = replace(targets, positions=targets.positions + shift[:, None])
    positions = moved_on.positions - _strayed(moved_on, source)[:, None]
    positions[:, ANKLES] = feet.position
    # the body sinks to a standing foot that is out of reach
    away = positions[:, HIPS] - positions[:, ANKLES]
    plan = np.minimum(np.linalg.norm(away[..., :2], axis=-1), 0.99 * (thigh + shank))
    reach = np.sqrt((STRETCH * (thigh + shank)) ** 2 - plan**2)
    sink = np.maximum(0.0, np.where(contacts, away[..., 2] - reach, 0.0)).max(axis=1)
    width = max(1, round(0.1 * fps))
    sink = gaussian_filter1d(maximum_filter1d(sink, 2 * width + 1), 0.5 * width, mode="nearest")
    others = [number for number in range(len(ROLES)) if number not in ANKLES + KNEES]
    positions[:, others, 2] -= sink[:, None]
    for hip, ankle, knee in zip(HIPS, ANKLES, KNEES):
        positions[:, knee] = _knee(positions[:, hip], positions[:, ankle], positions[:, knee], thigh, shank)
    orientations = targets.orientations.copy()
    orientations[:, len(ORIENTED) - 2 :] = feet.rotation
    return replace(targets, positions=positions, orientations=orientations)


def _smooth_mean(moved: FloatArray, contacts: BoolArray, sigma: float) -> FloatArray:
    """Gaussian-weighted mean over time of the standing feet's shifts (T, 3); 0 if no foot ever stands."""
    if not contacts.any():
        return np.zeros((len(moved), 3))
    weight = contacts.astype(float)
    total = (moved * weight[..., None]).sum(axis=1)
    count = weight.sum(axis=1)
    known = np.flatnonzero(count)
    filled = np.stack(
        [np.interp(np.arange(len(moved)), known, total[known, i] / count[known]) for i in range(3)], axis=1
    )
    return np.asarray(gaussian_filter1d(filled, sigma, axis=0, mode="nearest"))


def _knee(hip: FloatArray, ankle: FloatArray, knee: FloatArray, thigh: float, shank: float) -> FloatArray:
    """Knee positions (T, 3) for given hips and ankles, on the side where the knees were."""
    line = ankle - hip
    distance = np.clip(np.linalg.norm(line, axis=-1, keepdims=True), 1e-6, thigh + shank)
    along = unit(line)
    side = knee - hip
    side = unit(side - along * (side * along).sum(axis=-1, keepdims=True))
    part = (distance**2 + thigh**2 - shank**2) / (2 * distance)
    off = np.sqrt(np.maximum(0.0, thigh**2 - part**2))
    return np.asarray(hip + along * part + side * off)
