"""Where standing feet belong: on the floor and still, rolling over heel and toe; and how the swing leads there.

A standing foot keeps one foothold: the place and heading of its flat sole that fits the whole stance best. While it
tilts, its lowest points stay on their places in that flat foothold, so heel strike and toe-off roll without sliding. A
foot that turns on the spot (the standing foot of a kick) keeps the place of its ball instead.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from simprep.humanoid import Body, humanoid_model
from simprep.motion.contacts import stances
from simprep.motion.kinematics import foot_geom_ids


@dataclass(frozen=True)
class FootholdSettings:
    """Thresholds of the placing of feet.

    Attributes:
        flat_below: a sole tilted less than this is set flat [rad].
        tilted_above: one tilted more than this keeps its tilt [rad]; between, a smooth passage.
        turning: a stance whose heading ranges over more than this turns on the ball [rad].
        softness: points within about this height of the lowest share its hold [m].
        ease: longest time over which a correction fades in a swing [s].
    """

    flat_below: float = 0.05
    tilted_above: float = 0.2
    turning: float = 0.3
    softness: float = 0.006
    ease: float = 0.4


@dataclass(frozen=True)
class FootPoses:
    """Poses of both feet.

    Attributes:
        position: (T, 2, 3) ankles [m].
        rotation: (T, 2, 3, 3) orientations of the feet.
    """

    position: NDArray[np.float64]
    rotation: NDArray[np.float64]


def sole_geometry(body: Body) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Centres (2, 4, 3) in the foot's frame and radii (2, 4) of the foot spheres [m]."""
    model = humanoid_model(body)
    ids = foot_geom_ids(body)
    return np.array(model.geom_pos[ids]), np.array(model.geom_size[ids, 0])


def sole_points(feet: FootPoses, body: Body) -> NDArray[np.float64]:
    """Lowest points of the foot spheres, (T, 2, 4, 3) [m]."""
    centres, radii = sole_geometry(body)
    points = feet.position[:, :, None] + np.einsum("tsij,spj->tspi", feet.rotation, centres)
    points[..., 2] -= radii
    return points


def place_feet(
    feet: FootPoses, contacts: NDArray[np.bool_], fps: float, body: Body, settings: FootholdSettings | None = None
) -> FootPoses:
    """Feet that stand on the floor z = 0 without sliding wherever `contacts` says so, and pass smoothly in between.

    Args:
        feet: poses as they are, the floor near z = 0.
        contacts: (T, 2) standing feet.
        fps: frames per second [1/s].
        body: the humanoid.
        settings: thresholds; None for the defaults.
    """
    settings = settings or FootholdSettings()
    centres, radii = sole_geometry(body)
    position, rotation = feet.position.copy(), feet.rotation.copy()
    points = sole_points(feet, body)
    for side in range(2):
        runs = stances(contacts[:, side])
        for first, after in runs:
            part = slice(first, after)
            position[part, side], rotation[part, side] = _stance(
                points[part, side], feet.rotation[part, side], centres[side], radii[side], settings
            )
        moved = position[:, side] - feet.position[:, side]
        turn = rotation[:, side] @ np.swapaxes(feet.rotation[:, side], -1, -2)
        turned = Rotation.from_matrix(turn).as_rotvec()
        longest = max(2, round(settings.ease * fps))
        for offset in (moved, turned):
            _ease(offset, runs, longest)
        position[:, side] = feet.position[:, side] + moved
        rotation[:, side] = Rotation.from_rotvec(turned).as_matrix() @ feet.rotation[:, side]
    # a swinging foot passes over the floor
    low = sole_points(FootPoses(position, rotation), body)[..., 2].min(axis=-1)
    position[..., 2] += np.maximum(0.0, -low)
    return FootPoses(position, rotation)


def _stance(
    points: NDArray[np.float64],
    rotation: NDArray[np.float64],
    centres: NDArray[np.float64],
    radii: NDArray[np.float64],
    settings: FootholdSettings,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions (n, 3) and orientations (n, 3, 3) of one standing foot from its sole points (n, 4, 3)."""
    heading, pitch, roll = np.moveaxis(Rotation.from_matrix(rotation).as_euler("ZYX"), -1, 0)
    heading = np.unwrap(heading)
    weight = np.exp(-(points[..., 2] - points[..., 2].min(axis=-1, keepdims=True)) / settings.softness)  # (n, 4)
    flatness = weight.sum(axis=1)
    turning = bool(np.ptp(heading) > settings.turning)
    if not turning:
        heading = np.full(len(heading), np.average(heading, weights=flatness**2))
    tilt = np.stack([heading, _flatten(pitch, settings), _flatten(roll, settings)], axis=-1)
    new = Rotation.from_euler("ZYX", tilt).as_matrix()
    if turning:
        ball = centres[1:3].mean(axis=0)
        held = points[:, 1:3, :2].mean(axis=1)  # (n, 2)
        place = np.median(held, axis=0)
        plan = place - (new @ ball)[:, :2]
    else:
        level = Rotation.from_euler("Z", heading[0]).as_matrix()
        local = (centres @ level.T)[:, :2]  # sole points of the flat foot about its ankle
        place = np.average((points[..., :2] - local).reshape(-1, 2), axis=0, weights=weight.ravel())
        anchors = place + local
        reach = np.einsum("nij,pj->npi", new, centres)
        height = reach[..., 2] - radii
        hold = np.exp(-(height - height.min(axis=1, keepdims=True)) / settings.softness)
        hold /= hold.sum(axis=1, keepdims=True)
        plan = np.einsum("np,npi->ni", hold, anchors - reach[..., :2])
    lowest = (np.einsum("nij,pj->npi", new, centres)[..., 2] - radii).min(axis=1)
    return np.concatenate([plan, -lowest[:, None]], axis=1), new


def _flatten(angle: NDArray[np.float64], settings: FootholdSettings) -> NDArray[np.float64]:
    u = np.clip((np.abs(angle) - settings.flat_below) / (settings.tilted_above - settings.flat_below), 0, 1)
    return np.asarray(angle * u * u * (3 - 2 * u))


def _ease(offset: NDArray[np.float64], runs: list[tuple[int, int]], longest: int) -> None:
    """Fill the frames outside of the stances, in place: cubic passages that keep value and slope at the stances."""
    n = len(offset)
    if not runs:
        return
    limits = [(0, runs[0][0])] + [(a[1], b[0]) for a, b in zip(runs, runs[1:])] + [(runs[-1][1], n)]
    for first, after in limits:
        gap = after - first
        if gap <= 0:
            continue
        value = np.zeros((2, offset.shape[1]))
        slope = np.zeros((2, offset.shape[1]))
        if first > 0:
            value[0] = offset[first - 1]
            slope[0] = offset[first - 1] - offset[max(first - 2, 0)]
        if after < n:
            value[1] = offset[after]
            slope[1] = offset[min(after + 1, n - 1)] - offset[after]
        inner = first > 0 and after < n
        at = np.arange(1, gap + 1)
        if inner and gap + 1 <= 2 * longest:
            offset[first:after] = _hermite(at, gap + 1, value[0], value[1], slope[0], slope[1])
            continue
        # a long flight, or one that begins or ends with the clip: each correction fades by itself
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
    at: NDArray[np.intp],
    span: int,
    begin: NDArray[np.float64],
    end: NDArray[np.float64],
    slope_begin: NDArray[np.float64],
    slope_end: NDArray[np.float64],
) -> NDArray[np.float64]:
    u = (at / span)[:, None]
    return np.asarray(
        (2 * u**3 - 3 * u**2 + 1) * begin
        + (u**3 - 2 * u**2 + u) * span * slope_begin
        + (3 * u**2 - 2 * u**3) * end
        + (u**3 - u**2) * span * slope_end
    )
