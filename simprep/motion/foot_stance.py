"""One stance of one foot: its foothold, and the foot's pose through it, rolling over heel and toe."""

from dataclasses import dataclass, replace

import numpy as np

from simprep.arrays import FloatArray
from simprep.character import SIDES, Character
from simprep.motion.rotations import axis_rotation
from simprep.motion.targets import UPRIGHT, unit

LIMIT_MARGIN = 0.02
"""Standing ankles stay this far from their limits [rad]."""


@dataclass(frozen=True)
class FootholdSettings:
    """Thresholds of the placing of feet.

    Attributes:
        flattening: tilts of this size are halved, much smaller ones vanish, much larger ones stay [rad].
        flat_within: tilt up to which a sole tells where the foothold is [rad].
        turning: a stance turns if its heading varies by more than this [rad].
        sliding: a stance slides if its place varies by more than this [m]. Both are divided into still parts.
        still_turn: heading rate below which a part is still [rad/s].
        still_speed: speed of the place below which a part is still [m/s].
        shortest: shortest still part [s].
        dorsiflexion: largest angle of a standing ankle; beyond it the heel rises [rad].
        inversion: the same to either side; beyond it the sole tilts [rad].
        softness: points within about this height of the lowest one bear load with it [m].
        upright: a leg stands if its shank rises by at least this share of its length.
        resting: a foot this high does not stand, whatever its speed [m].
        heel: largest change of the pitch of a rolling foot [rad].
        along: weight of an ankle's error along the leg over one across it.
        own_pitch: price of the change of pitch [m/rad].
        own_heading: offset of the knee from the leg's line at which it counts as much as the foot's heading [m].
        torsion: largest turn of a foothold towards the knee [rad].
        grip: a foot lets go if its ankle would be farther than this from the leg's [m].
        slip: longest time by which a foot lets go, or takes hold, beside its contact [s].
        briefest: a foot that would then hold for less than this does not stand [s].
        tip: largest turn that brings the sole of a swinging foot out of the floor [rad].
        straighten: setting a sliding foot down straightens the knee by at most this [rad].
        ease: longest time over which a correction fades in a swing [s].
        recent: time at the stance over which the correction's slope is taken [s].
    """

    flattening: float = 0.06
    flat_within: float = 0.2
    turning: float = 0.3
    sliding: float = 0.12
    still_turn: float = 0.8
    still_speed: float = 0.2
    shortest: float = 0.1
    dorsiflexion: float = 0.58
    inversion: float = 0.5
    softness: float = 0.006
    upright: float = UPRIGHT
    resting: float = 0.012
    heel: float = 0.4
    along: float = 3.0
    own_pitch: float = 0.05
    own_heading: float = 0.03
    torsion: float = 0.7
    grip: float = 0.025
    slip: float = 0.2
    briefest: float = 0.08
    straighten: float = 0.1
    tip: float = 0.6
    ease: float = 0.14
    recent: float = 0.1

    @classmethod
    def of_character(cls, character: Character) -> "FootholdSettings":
        """Thresholds for a body whose ankles may bend less."""
        return replace(
            cls(),
            dorsiflexion=min(
                cls.dorsiflexion, *(_ankle_range(character, f"{side}_ankle_dorsiflexion", 1)[0] for side in SIDES)
            ),
            inversion=min(
                cls.inversion, *(min(_ankle_range(character, f"{side}_ankle_inversion", 0)) for side in SIDES)
            ),
        )


def _ankle_range(character: Character, movement: str, axis: int) -> tuple[float, float]:
    """How far an ankle turns, negatively and positively about a coordinate axis, short of its limits [rad]; 0 without a joint."""
    index = character.anatomical(movement)
    if index is None:
        return 0.0, 0.0
    low, high = (character.limits[index] - character.model.qpos0[7 + index]).tolist()
    away = max(0.0, -low - LIMIT_MARGIN), max(0.0, high - LIMIT_MARGIN)
    return away if character.reference_axes[index, axis] > 0 else away[::-1]


class Stance:
    """One stance of one foot: sole points (n, 4, 3), and what follows from them."""

    def __init__(
        self,
        points: FloatArray,
        rotation: FloatArray,
        centres: FloatArray,
        radii: FloatArray,
        ankle: FloatArray,
        leg: FloatArray,
        fold: FloatArray,
        settings: FootholdSettings,
    ) -> None:
        self.points, self.centres, self.radii, self.settings = points, centres, radii, settings
        self.ankle, self.leg, self.fold = ankle, leg, fold
        heading = np.arctan2(-rotation[:, 0, 1], rotation[:, 1, 1])  # of the sideways axis, which a steep foot has too
        self.pitch = np.arcsin(np.clip(-rotation[:, 2, 0], -1, 1))
        self.heading = np.unwrap(heading)
        height = points[..., 2] - points[..., 2].min(axis=-1, keepdims=True)
        self.weight = np.exp(-height / settings.softness)  # (n, 4) relative load
        level = axis_rotation("z", self.heading)
        local = np.einsum("nij,pj->npi", level, centres)[..., :2]
        share = self.weight / self.weight.sum(axis=1, keepdims=True)
        self.place = np.einsum("np,npi->ni", share, points[..., :2] - local)  # ankle of the flat foot, in plan
        self.turns = bool(np.ptp(self.heading) > settings.turning)
        # feet of different length roll over different toes, so the flat frames tell the place
        self.flatness = np.exp(-((self.pitch / settings.flat_within) ** 2)) + 1e-3
        flat = self.flatness > 0.5 * self.flatness.max()
        self.slides = bool(np.ptp(self.place[flat], axis=0).max() > settings.sliding)


def knee_offset(hip: FloatArray, knee: FloatArray, ankle: FloatArray) -> FloatArray:
    """Direction (n, 2), in plan, of a folded leg's foot flat on the floor; its length is the knee's offset [m].

    The ankle bends in the plane of the leg, so a flat foot points along the line in which that plane meets the floor.
    The offset is the knee's distance from the line from hip to ankle.

    Args:
        hip: (n, 3) [m].
        knee: (n, 3) [m].
        ankle: (n, 3) [m].
    """
    normal = np.cross(hip - ankle, knee - ankle)
    offset = np.linalg.norm(normal, axis=-1) / np.maximum(np.linalg.norm(hip - ankle, axis=-1), 1e-9)
    return np.asarray(unit(np.stack([normal[:, 1], -normal[:, 0]], axis=-1)) * offset[:, None])


def _towards_knee(heading: float, fold: FloatArray, settings: FootholdSettings) -> float:
    """Turn of a foothold towards the plane of the knee [rad], because our shank, unlike people's, has no torsion.

    It is a least-squares compromise between the headings of foot and knee; the knee counts by its offset `fold`.
    """
    out = np.linalg.norm(fold, axis=-1)
    off = (np.arctan2(fold[:, 1], fold[:, 0]) - heading + np.pi) % (2 * np.pi) - np.pi
    weight = np.where(np.abs(off) < np.pi / 2, out**2, 0.0)
    turn = float((weight * off).sum() / (weight.sum() + len(fold) * settings.own_heading**2))
    return float(np.clip(turn, -settings.torsion, settings.torsion))


def hold(stance: Stance, part: slice, shank: FloatArray, turning: bool) -> tuple[FloatArray, FloatArray]:
    """Positions (n, 3) and orientations (n, 3, 3) of the foot through one still part of a stance."""
    settings, centres, radii = stance.settings, stance.centres, stance.radii
    weight, points = stance.weight[part], stance.points[part]
    heading = stance.heading[part]
    if not turning:
        mean = float(np.average(heading, weights=stance.flatness[part]))
        heading = np.full(len(heading), mean + _towards_knee(mean, stance.fold[part], settings))
    pitch = stance.pitch[part]
    pitch = pitch**3 / (pitch**2 + settings.flattening**2)
    if not turning:
        anchors = _anchors(points, heading[0], weight * stance.flatness[part, None], centres)
        pitch = _rolling_pitch(
            pitch, heading[0], anchors, stance.ankle[part], stance.leg[part], centres, radii, settings
        )
    roll = np.zeros_like(pitch)
    new = _oriented(heading, pitch, roll)
    # beyond the ankle's range the heel rises or the sole tilts sideways
    lean = np.einsum("nji,nj->ni", new, shank[part])
    pitch = pitch + np.maximum(0.0, np.arctan2(lean[:, 0], lean[:, 2]) - settings.dorsiflexion)
    aside = -np.arctan2(lean[:, 1], lean[:, 2])
    roll = aside - np.clip(aside, -settings.inversion, settings.inversion)
    new = _oriented(heading, pitch, roll)
    reach = np.einsum("nij,pj->npi", new, centres)
    height = reach[..., 2] - radii
    if turning:  # a whole short stance, such as a kick's, turns about its ball
        across = _ball(centres)
        ball = reach[:, across, :2].mean(axis=1)
        plan = np.median(points[:, across, :2].mean(axis=1), axis=0) - ball
    else:
        plan = _held_by(anchors - reach[..., :2], height, settings)
        # a foot of another length touches elsewhere, so the foothold goes where the leg has it on average
        plan += (stance.ankle[part, :2] - plan).mean(axis=0)
    return np.concatenate([plan, -height.min(axis=1)[:, None]], axis=1), new


def _ball(centres: FloatArray) -> list[int]:
    """The ball of a foot: its widest pair of points of (N, 3), the foremost of equally wide ones."""
    ahead = 1e-3 * centres[:, 0]
    return [int((centres[:, 1] + ahead).argmax()), int((-centres[:, 1] + ahead).argmax())]


def _oriented(heading: FloatArray, pitch: FloatArray, roll: FloatArray) -> FloatArray:
    """Orientations (n, 3, 3) of feet: heading, then pitch (toe down), then roll [rad]."""
    return axis_rotation("z", heading) @ axis_rotation("y", pitch) @ axis_rotation("x", roll)


def _anchors(points: FloatArray, heading: float, bearing: FloatArray, centres: FloatArray) -> FloatArray:
    """Places (4, 2) of the sole's points in the flat foothold that fits a stance best [m]."""
    local = (centres @ axis_rotation("z", heading).T)[:, :2]  # about the ankle of the flat foot
    return np.asarray(np.einsum("np,npi->i", bearing, points[..., :2] - local) / bearing.sum() + local)


def _held_by(offset: FloatArray, height: FloatArray, settings: FootholdSettings) -> FloatArray:
    """Mean of offsets (..., 4, 2) over the lowest points, heights (..., 4)."""
    load = np.exp(-(height - height.min(axis=-1, keepdims=True)) / settings.softness)
    return np.asarray(np.einsum("...p,...pi->...i", load / load.sum(axis=-1, keepdims=True), offset))


def _rolling_pitch(
    pitch: FloatArray,
    heading: float,
    anchors: FloatArray,
    ankle: FloatArray,
    leg: FloatArray,
    centres: FloatArray,
    radii: FloatArray,
    settings: FootholdSettings,
) -> FloatArray:
    """Pitch (n,) that brings a rolling foot's ankle nearest to the leg's; the source's foot may have another length.

    `pitch` (n,) is the source's, toe down [rad], `heading` the foothold's [rad], `anchors` (4, 2) the places of the
    sole's points [m]. The leg has the ankle at `ankle` (n, 3) [m] and the unit direction `leg` (n, 3) to the hip.
    `centres` (4, 3) and `radii` (4,) are the sole's spheres in the foot's frame [m].
    """
    rolling = np.clip((np.abs(pitch) - settings.flat_within / 2) / settings.flat_within, 0.0, 1.0)
    rolls = np.flatnonzero(rolling)
    change = np.linspace(-settings.heel, settings.heel, 13)
    tried = pitch[rolls, None] + change  # (n, 13)
    sine, cosine = np.sin(tried)[..., None], np.cos(tried)[..., None]
    ahead = cosine * centres[:, 0] + sine * centres[:, 2]
    height = cosine * centres[:, 2] - sine * centres[:, 0] - radii
    forward = np.array([np.cos(heading), np.sin(heading)])
    aside = np.array([-forward[1], forward[0]])
    reach = ahead[..., None] * forward + centres[:, 1, None] * aside
    place = _held_by(anchors - reach, height, settings)
    off = np.concatenate([place, -height.min(axis=-1)[..., None]], axis=-1) - ankle[rolls, None]  # (n, 13, 3)
    # an error along the leg bends the knee, one across it only turns the leg
    along = (off * leg[rolls, None]).sum(axis=-1)
    cost = (off**2).sum(axis=-1) + (settings.along**2 - 1) * along**2
    cost += (settings.own_pitch * change) ** 2
    best = np.clip(cost.argmin(axis=1), 1, len(change) - 2)
    rows = np.arange(len(rolls))
    before, at, after = (cost[rows, best + step] for step in (-1, 0, 1))
    vertex = 0.5 * (before - after) / np.maximum(before - 2 * at + after, 1e-12)
    found = change[best] + np.clip(vertex, -1.0, 1.0) * (change[1] - change[0])
    out = pitch.copy()
    out[rolls] += (rolling**2 * (3 - 2 * rolling))[rolls] * found
    return out
