"""Feet of a whole clip: held while they stand, and moved smoothly from one foothold to the next."""

from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from simprep.arrays import BoolArray, FloatArray, IndexArray
from simprep.character import Character
from simprep.motion.foot_stance import FootholdSettings
from simprep.motion.footholds import FootPoses, Held, hold_feet, sole_geometry, sole_points
from simprep.motion.targets import unit


def place_feet(
    feet: FootPoses,
    hips: FloatArray,
    knees: FloatArray,
    contacts: BoolArray,
    fps: float,
    character: Character,
    settings: FootholdSettings | None = None,
) -> tuple[FootPoses, BoolArray]:
    """Feet that do not slide while `contacts` says that they stand on the floor z = 0, and move smoothly in between.

    Returns the poses, and the contacts without the frames in which a foot lets go or slides to another place.

    Args:
        feet: poses as they are, the floor near z = 0.
        hips: (T, 2, 3) [m].
        knees: (T, 2, 3) [m]; they tell how far ankles bend and which way legs fold.
        contacts: (T, 2) standing feet.
        fps: frames per second [1/s].
        character: the body.
        settings: thresholds; None for the body's own.
    """
    settings = settings or FootholdSettings.of_character(character)
    centres, radii = sole_geometry(character)
    held = hold_feet(feet, hips, knees, contacts, fps, character, settings)
    position, rotation = held.feet.position.copy(), held.feet.rotation.copy()
    longest, recent = max(2, round(settings.ease * fps)), max(1, round(settings.recent * fps))
    for side, spans in enumerate(held.spans):
        moved = position[:, side] - feet.position[:, side]
        _ease(moved, spans, longest, recent)
        position[:, side] = feet.position[:, side] + moved
        turn = rotation[:, side] @ np.swapaxes(feet.rotation[:, side], -1, -2)
        turned = Rotation.from_matrix(turn).as_rotvec()
        _ease(turned, spans, longest, recent)
        rotation[:, side] = Rotation.from_rotvec(turned).as_matrix() @ feet.rotation[:, side]
    contacts = held.contacts & ~_passing(FootPoses(position, rotation), held, fps, character, settings)
    # a swinging foot stays above the floor; a standing foot between two footholds turns on it
    low = sole_points(FootPoses(position, rotation), character)[..., 2].min(axis=-1)
    for side in range(2):
        sunk = np.flatnonzero((low[:, side] < 0) & ~contacts[:, side])
        if len(sunk):
            rotation[sunk, side] = _tip(
                rotation[sunk, side], position[sunk, side, 2], centres[side], radii[side], settings.tip
            )
    low = sole_points(FootPoses(position, rotation), character)[..., 2].min(axis=-1)
    contacts &= low < settings.resting
    lowered = np.where(held.bearing, np.minimum(low, settings.resting), np.minimum(0.0, low))
    position[..., 2] -= np.where(contacts, lowered, np.minimum(lowered, _spare(hips, knees, feet.position, settings)))
    return FootPoses(position, rotation), contacts


def _passing(feet: FootPoses, held: Held, fps: float, character: Character, settings: FootholdSettings) -> BoolArray:
    """(T, 2) feet that move over the floor without being held."""
    if len(feet.position) < 2:
        return np.zeros(held.contacts.shape, dtype=bool)
    points = sole_points(feet, character)
    speed = np.linalg.norm(np.gradient(points[..., :2], 1 / fps, axis=0), axis=-1)
    lowest = np.take_along_axis(speed, points[..., 2].argmin(axis=-1)[..., None], axis=-1)[..., 0]
    free = np.ones(held.contacts.shape, dtype=bool)
    for side, spans in enumerate(held.spans):
        for first, after in spans:
            free[first:after, side] = False
    return np.asarray(free & (lowest > settings.still_speed))


def _tip(rotation: FloatArray, ankle: FloatArray, centres: FloatArray, radii: FloatArray, largest: float) -> FloatArray:
    """Orientations (n, 3, 3) of feet in the floor, turned towards level just enough to bring the sole out.

    `ankle` (n,) are heights [m], `centres` (4, 3) and `radii` (4,) the sole's spheres in the foot's frame [m],
    `largest` is the largest turn [rad].
    """
    axis = unit(rotation[:, :, 1] * [1.0, 1.0, 0.0])  # defined for a foot that points straight down too
    arms = np.einsum("nij,pj->npi", rotation, centres)
    ahead = np.einsum("npi,ni->np", arms, np.cross(axis, [0.0, 0.0, 1.0]))
    towards_level = np.sign(rotation[:, 2, 0])  # a positive turn lowers what is ahead
    size = np.linspace(0.0, largest, 13)
    turned = (towards_level[:, None] * size)[..., None]  # (n, 13, 1)
    height = ankle[:, None] + (np.cos(turned) * arms[:, None, :, 2] - np.sin(turned) * ahead[:, None] - radii).min(
        axis=2
    )
    clear = height >= 0
    best = np.where(clear.any(axis=1), clear.argmax(axis=1), height.argmax(axis=1))
    # interpolate between the last size in the floor and the first above it
    rows, before = np.arange(len(ankle)), np.maximum(best - 1, 0)
    above, below = height[rows, best], height[rows, before]
    share = np.where((above > 0) & (below < 0), above / np.maximum(above - below, 1e-9), 0.0)
    angle = towards_level * (size[best] + share * (size[before] - size[best]))
    return np.asarray(Rotation.from_rotvec(angle[:, None] * axis).as_matrix() @ rotation)


def _spare(hip: FloatArray, knee: FloatArray, ankle: FloatArray, settings: FootholdSettings) -> FloatArray:
    """Length (T, 2) [m] that a leg can gain until its knee has straightened by `straighten`."""
    thigh, shank = np.linalg.norm(knee - hip, axis=-1), np.linalg.norm(ankle - knee, axis=-1)
    distance = np.linalg.norm(ankle - hip, axis=-1)
    cosine = (distance**2 - thigh**2 - shank**2) / np.maximum(2 * thigh * shank, 1e-9)
    bend = np.maximum(np.arccos(np.clip(cosine, -1, 1)) - settings.straighten, 0.0)
    longest = np.sqrt(thigh**2 + shank**2 + 2 * thigh * shank * np.cos(bend))
    return np.asarray(np.maximum(longest - distance, 0.0))


def _ease(offset: FloatArray, runs: list[tuple[int, int]], longest: int, recent: int) -> None:
    """Fill the frames between stances, in place, by cubics that keep value and half the slope of `offset` (T, 3).

    `runs` are the stances, `longest` the frames in which a correction fades. The slope is that of the last `recent`
    frames: the last moment's alone would swing far out.
    """
    n = len(offset)
    if not runs:
        return
    stops: list[tuple[int, int]] = [(0, 0), *runs, (n, n)]
    for (begin, first), (after, end) in pairwise(stops):
        gap = after - first
        if gap <= 0:
            continue
        value = np.zeros((2, offset.shape[1]))
        slope = np.zeros((2, offset.shape[1]))
        if first > 0:
            value[0] = offset[first - 1]
            steps = min(recent, first - 1 - begin)
            slope[0] = 0.5 * (value[0] - offset[first - 1 - steps]) / max(steps, 1)
        if after < n:
            value[1] = offset[after]
            steps = min(recent, end - 1 - after)
            slope[1] = 0.5 * (offset[after + steps] - value[1]) / max(steps, 1)
        inner = first > 0 and after < n
        at = np.arange(1, gap + 1)
        if inner and gap + 1 <= 2 * longest:
            offset[first:after] = _hermite(at, gap + 1, value[0], value[1], slope[0], slope[1])
            continue
        # a long flight, or one at an end of the clip: each correction fades by itself
        zero = np.zeros_like(value[0])
        span = min(longest, gap + 1) if not inner else longest
        out = np.zeros((gap, offset.shape[1]))
        if first > 0:
            near = at <= span
            out[near] += _hermite(at[near], span, value[0], zero, slope[0], zero)
        if after < n:
            back = gap + 1 - at
            near = back <= span
            out[near] += _hermite(back[near], span, value[1], zero, -slope[1], zero)
        offset[first:after] = out


def _hermite(
    at: IndexArray, span: int, begin: FloatArray, end: FloatArray, slope_begin: FloatArray, slope_end: FloatArray
) -> FloatArray:
    u = (at / span)[:, None]
    return np.asarray(
        (2 * u**3 - 3 * u**2 + 1) * begin
        + (u**3 - 2 * u**2 + u) * span * slope_begin
        + (3 * u**2 - 2 * u**3) * end
        + (u**3 - u**2) * span * slope_end
    )
