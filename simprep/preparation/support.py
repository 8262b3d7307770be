"""The support polygon on the floor, its centre (the paper's COS), and whether a point is inside."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def convex_hull(points: Array) -> Array:
    """Convex hull of points in the plane (Andrew's monotone chain; a handful of points, where a library call costs more).

    Args:
        points: (N, 2), N at least 1.

    Returns:
        (M, 2) corners, counter-clockwise; 1 or 2 rows where the points coincide or lie on a line.
    """
    ordered = sorted({(float(x), float(y)) for x, y in points})
    if len(ordered) <= 2:
        return np.array(ordered)
    halves = []
    for sequence in (ordered, ordered[::-1]):
        half: list[tuple[float, float]] = []
        for x, y in sequence:
            while len(half) >= 2:
                (ax, ay), (bx, by) = half[-2], half[-1]
                if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0:
                    break
                half.pop()
            half.append((x, y))
        halves.append(half[:-1])
    return np.array(halves[0] + halves[1])


def polygon_centre(hull: Array) -> Array:
    """Centre of area of a convex polygon; the mean of its corners where it has no area.

    Args:
        hull: (M, 2) corners in order.

    Returns:
        (2,).
    """
    if len(hull) < 3:
        return np.asarray(hull.mean(axis=0))
    x, y = hull[:, 0] - hull[0, 0], hull[:, 1] - hull[0, 1]
    xn, yn = np.roll(x, -1), np.roll(y, -1)
    cross = x * yn - xn * y
    area = cross.sum() / 2
    if abs(area) < 1e-10:
        return np.asarray(hull.mean(axis=0))
    return np.asarray(hull[0] + np.array([((x + xn) * cross).sum(), ((y + yn) * cross).sum()]) / (6 * area))


def inside(point: Array, hull: Array) -> bool:
    """Whether a point lies in a convex polygon (its edge included); never for a line or a point.

    Args:
        point: (2,).
        hull: (M, 2) corners, counter-clockwise.
    """
    if len(hull) < 3:
        return False
    edge = np.roll(hull, -1, axis=0) - hull
    to = point - hull
    return bool((edge[:, 0] * to[:, 1] - edge[:, 1] * to[:, 0] >= 0).all())


def support_polygons(foot_points: Array, contacts: NDArray[np.bool_]) -> list[Array | None]:
    """Support polygon of every frame: hull of the whole soles of the feet that support, as the paper has it.

    Args:
        foot_points: (T, 2, 4, 3) lowest points of the feet, world [m].
        contacts: (T, 2).

    Returns:
        T polygons (M, 2), or None where no foot supports.
    """
    return [
        convex_hull(points[mask].reshape(-1, 2)) if mask.any() else None
        for points, mask in zip(foot_points[..., :2], np.asarray(contacts, dtype=bool))
    ]


def support_centres(polygons: list[Array | None]) -> Array:
    """Centre of the support polygon over time (paper: COS).

    Args:
        polygons: T polygons or None.

    Returns:
        (T, 2) [m]; NaN where no foot supports.
    """
    return np.array([polygon_centre(hull) if hull is not None else np.full(2, np.nan) for hull in polygons])
