"""Where standing feet belong: on the floor and still, rolling over heel and toe.

A standing foot keeps one foothold: the place and heading of its flat sole that fits the whole stance best. While it
tilts, its lowest points keep their places in that foothold, so it rolls without sliding. A foot that turns on the spot
(the standing foot of a kick) keeps the place of its ball.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.ndimage import gaussian_filter1d

from simprep.arrays import BoolArray, FloatArray
from simprep.character import Character
from simprep.motion.contacts import stances
from simprep.motion.foot_stance import FootholdSettings, Stance, hold, knee_offset
from simprep.motion.targets import unit


@dataclass(frozen=True)
class FootPoses:
    """Poses of both feet.

    Attributes:
        position: (T, 2, 3) ankles [m].
        rotation: (T, 2, 3, 3) orientations of the feet.
    """

    position: FloatArray
    rotation: FloatArray


def sole_geometry(character: Character) -> tuple[FloatArray, FloatArray]:
    """Centres (2, 4, 3) in the foot's frame and radii (2, 4) of the foot spheres [m]."""
    model = character.model
    ids = character.sole_geoms
    feet = np.array(character.feet) + 1
    radii = np.array(model.geom_size[ids, 0])
    if (model.geom_bodyid[ids] == feet[:, None]).all():
        return np.array(model.geom_pos[ids]), radii
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    away = data.geom_xpos[ids] - data.xpos[feet][:, None]
    return away @ data.xmat[feet].reshape(2, 3, 3), radii


def sole_points(feet: FootPoses, character: Character) -> FloatArray:
    """Lowest points of the foot spheres, (T, 2, 4, 3) [m]."""
    centres, radii = sole_geometry(character)
    points = feet.position[:, :, None] + centres @ np.swapaxes(feet.rotation, -1, -2)
    points[..., 2] -= radii
    return np.asarray(points)


@dataclass(frozen=True)
class Held:
    """Feet while they stand.

    Attributes:
        feet: poses; held in the frames of `spans`, as they were elsewhere.
        bearing: (T, 2) feet on the floor, without those that let go early.
        contacts: (T, 2) the same without a foot that slides to another place while the other one bears load.
        spans: of each foot, the (first frame, frame after the last) in which it is held.
    """

    feet: FootPoses
    bearing: BoolArray
    contacts: BoolArray
    spans: tuple[list[tuple[int, int]], list[tuple[int, int]]]


def hold_feet(
    feet: FootPoses,
    hips: FloatArray,
    knees: FloatArray,
    contacts: BoolArray,
    fps: float,
    character: Character,
    settings: FootholdSettings,
) -> Held:
    """Standing feet on the floor z = 0, without sliding.

    Args:
        feet: poses as they are, the floor near z = 0.
        hips: (T, 2, 3) [m].
        knees: (T, 2, 3) [m]; they tell how far ankles bend and which way legs fold.
        contacts: (T, 2) standing feet.
        fps: frames per second [1/s].
        character: the body.
        settings: thresholds.
    """
    centres, radii = sole_geometry(character)
    bearing = contacts.copy()
    position, rotation = feet.position.copy(), feet.rotation.copy()
    points = sole_points(feet, character)
    slides: list[tuple[int, int, int]] = []
    spans: tuple[list[tuple[int, int]], list[tuple[int, int]]] = ([], [])
    for side, held in enumerate(spans):
        shank = knees[:, side] - feet.position[:, side]
        for first, after in stances(contacts[:, side]):
            part = slice(first, after)
            if np.median(shank[part, 2] / np.linalg.norm(shank[part], axis=1)) < settings.upright:
                held.append((first, after))  # kneeling or lying, it touches the floor but is no foothold
                continue
            ankle, hip = feet.position[part, side], hips[part, side]
            stance = Stance(
                points[part, side], feet.rotation[part, side], centres[side], radii[side],
                ankle, unit(hip - ankle), knee_offset(hip, knees[part, side], ankle), settings,
            )  # fmt: skip
            earlier = len(held)
            for begin, end in _still_parts(stance, fps, settings):
                whole = (begin, end) == (0, after - first)
                place, turn = hold(stance, slice(begin, end), shank[part], turning=whole and stance.turns)
                early, late = _grip(place - ankle[begin:end], fps, settings)
                span = slice(first + begin + early, first + begin + late)
                if late - early < min(end - begin, settings.briefest * fps):
                    bearing[first + begin : first + end, side] = False  # the leg's ankle is too far away
                    continue
                bearing[first + begin : span.start, side] = bearing[span.stop : first + end, side] = False
                position[span, side], rotation[span, side] = place[early:late], turn[early:late]
                held.append((span.start, span.stop))
            slides += [(side, *slide) for slide in _slides(held[earlier:], (first, after), points[:, side], settings)]
    contacts = bearing.copy()
    for side, first, after in slides:
        contacts[first:after, side] &= ~bearing[first:after, 1 - side]
    return Held(FootPoses(position, rotation), bearing, contacts, spans)


def _still_parts(stance: Stance, fps: float, settings: FootholdSettings) -> list[tuple[int, int]]:
    """Parts of a stance with one foothold each: the whole, unless the foot turns or slides."""
    n = len(stance.heading)
    if not (stance.turns or stance.slides) or n < 3:
        return [(0, n)]
    sigma = 0.03 * fps
    heading = gaussian_filter1d(stance.heading, sigma, mode="nearest")
    place = gaussian_filter1d(stance.place, sigma, axis=0, mode="nearest")
    still = (np.abs(np.gradient(heading, 1 / fps)) < settings.still_turn) & (
        np.linalg.norm(np.gradient(place, 1 / fps, axis=0), axis=-1) < settings.still_speed
    )
    out = []
    for first, after in stances(still):
        # slow creeping adds up: cut where the foot has left its place
        begin = first
        while begin < after:
            left = (np.linalg.norm(place[begin + 1 : after] - place[begin], axis=-1) > settings.sliding / 2) | (
                np.abs(heading[begin + 1 : after] - heading[begin]) > settings.turning / 2
            )
            end = begin + 1 + int(left.argmax()) if left.any() else after
            if end - begin >= settings.shortest * fps:
                out.append((begin, end))
            if end == after:
                break
            begin = min(end + max(2, round(0.07 * fps)), after - 1)
    return out if out else [(0, n)]


def _slides(
    held: list[tuple[int, int]], run: tuple[int, int], points: FloatArray, settings: FootholdSettings
) -> list[tuple[int, int]]:
    """Parts of a stance between its holds in which every sole point travels."""
    edges = [run[0], *(edge for hold in held for edge in hold), run[1]]
    out = []
    for a, b in zip(edges[::2], edges[1::2]):
        begin, end = max(a - 1, run[0]), min(b, run[1] - 1)
        if b > a and np.linalg.norm(points[end, :, :2] - points[begin, :, :2], axis=-1).min() > settings.sliding / 2:
            out.append((a, b))
    return out


def _grip(off: FloatArray, fps: float, settings: FootholdSettings) -> tuple[int, int]:
    """First frame, and frame after the last, of a hold without ends where its ankle is `off` (n, 3) from the leg's [m].

    Such ends occur at push-off: people's toes bend, ours do not.
    """
    far = np.linalg.norm(off, axis=-1) > settings.grip
    longest = min(round(settings.slip * fps), len(off) // 3)
    early = next((frame for frame in range(longest) if not far[frame]), longest)
    late = next((frame for frame in range(longest) if not far[len(off) - 1 - frame]), longest)
    return early, len(off) - late
