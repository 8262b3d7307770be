"""Support polygons: convex hulls of foot points on the floor, for all frames at once, degenerate cases included.

Every ordered pair of a frame's points is tested as a hull edge (all points to its left), which vectorises over frames.
Points closer than a micrometre count as one, and thinner hulls as a segment.
"""

import numpy as np

from simprep.arrays import BoolArray, FloatArray

_SAME_M = 1e-6


def support_points(foot_points: FloatArray, contacts: BoolArray) -> tuple[FloatArray, BoolArray]:
    """Points (T, 2 P, 2) on the floor that span the support polygon [m], left foot first, and which count (T, 2 P).

    As in the 2013 paper, every point of a supporting foot counts, even if it has rolled onto its toes.

    Args:
        foot_points: (T, 2, P, 3) points under the left and right foot, world [m].
        contacts: (T, 2) supporting feet.
    """
    frames, feet, count, _ = foot_points.shape
    mask = np.repeat(np.asarray(contacts, dtype=bool), count, axis=1)
    return foot_points[..., :2].reshape(frames, feet * count, 2), mask


def hull_edges(points: FloatArray, mask: BoolArray) -> BoolArray:
    """Edges (T, P, P) of every frame's convex hull: [t, i, j] is True if i to j is one.

    They run counter-clockwise and are as long as possible. Collinear points have the two opposite edges between the
    extremes, a single point has none.

    Args:
        points: (T, P, 2) on the floor [m].
        mask: (T, P) points that count.
    """
    points, mask = np.asarray(points, dtype=np.float64), np.asarray(mask, dtype=bool)
    edges = np.zeros((*mask.shape, mask.shape[1]), dtype=bool)
    for pattern in set(map(tuple, mask.tolist())):  # points that do not count cost most of the time
        frames, counted = np.flatnonzero((mask == pattern).all(axis=1)), np.flatnonzero(pattern)
        edges[np.ix_(frames, counted, counted)] = _edges_of_all(points[np.ix_(frames, counted)])
    return edges


def _edges_of_all(points: FloatArray) -> BoolArray:
    """`hull_edges` where every point counts."""
    difference = points[:, None, :, :] - points[:, :, None, :]  # (T, i, j, 2) from i to j
    length = np.linalg.norm(difference, axis=-1)
    mask = ~((length < _SAME_M) & np.tri(points.shape[1], k=-1, dtype=bool)).any(axis=2)  # the first of equal points
    usable = mask[:, :, None] & mask[:, None, :] & (length >= _SAME_M)
    # of point k as seen from edge i -> j: offset to the left, and position along it
    unit = difference / np.maximum(length, _SAME_M)[..., None]
    to_k = difference[:, :, None, :, :]  # (T, i, 1, k, 2)
    along = unit[:, :, :, None, 0] * to_k[..., 0] + unit[:, :, :, None, 1] * to_k[..., 1]
    left = unit[:, :, :, None, 0] * to_k[..., 1] - unit[:, :, :, None, 1] * to_k[..., 0]
    off_line = np.abs(left) >= _SAME_M
    between = (along > -_SAME_M) & (along < length[..., None] + _SAME_M)
    fits = np.where(off_line, left > 0, between) | ~mask[:, None, None, :]
    return np.asarray(usable & fits.all(axis=-1))


def support_centre(points: FloatArray, mask: BoolArray) -> FloatArray:
    """Centre of support (T, 2): area centroid of the polygon, midpoint of a segment, or the point; else NaN [m].

    Args:
        points: (T, P, 2) [m].
        mask: (T, P) points that count.
    """
    edges = hull_edges(points, mask)
    count = mask.sum(axis=1)
    origin = np.where(mask[..., None], points, 0.0).sum(axis=1) / np.maximum(count, 1)[:, None]
    local = np.where(mask[..., None], points - origin[:, None], 0.0)  # near the origin, so that nothing cancels
    cross = local[:, :, None, 0] * local[:, None, :, 1] - local[:, :, None, 1] * local[:, None, :, 0]
    cross = np.where(edges, cross, 0.0)
    doubled_area = cross.sum(axis=(1, 2))
    total = local[:, :, None, :] + local[:, None, :, :]
    moment = (cross[..., None] * total).sum(axis=(1, 2))
    edge_count = edges.sum(axis=(1, 2))
    middle = np.where(edges[..., None], total, 0.0).sum(axis=(1, 2)) / (2 * np.maximum(edge_count, 1))[:, None]
    is_area = edge_count >= 3
    area = np.where(is_area, doubled_area, 1.0)[:, None]
    centre = origin + np.where(is_area[:, None], moment / (3 * area), middle)
    return np.where((count > 0)[:, None], centre, np.nan)


def signed_distance(points: FloatArray, mask: BoolArray, query: FloatArray) -> FloatArray:
    """Distance (T,) of a floor point to the edge of the support polygon, positive inside, negative outside [m].

    A segment and a single point have no inside. NaN where no point counts or the query is NaN.

    Args:
        points: (T, P, 2) [m].
        mask: (T, P) points that count.
        query: (T, 2) [m].
    """
    edges = hull_edges(points, mask)
    distance = _onto_edges(points, edges, query)[1].min(axis=(1, 2))
    to_points = np.where(mask, np.linalg.norm(query[:, None] - points, axis=-1), np.inf).min(axis=1, initial=np.inf)
    distance = np.where(np.isfinite(distance), distance, to_points)  # a single point has no edges
    undefined = ~mask.any(axis=1) | ~np.isfinite(query).all(axis=1)
    return np.where(undefined, np.nan, np.where(_inside(points, edges, query), distance, -distance))


def nearest_point(points: FloatArray, mask: BoolArray, query: FloatArray) -> FloatArray:
    """The point (T, 2) of the support polygon that is nearest to a floor point: itself, if it is inside; NaN where no point counts [m].

    Args:
        points: (T, P, 2) [m].
        mask: (T, P) points that count.
        query: (T, 2) [m].
    """
    edges, rows = hull_edges(points, mask), np.arange(len(points))
    feet, distance = _onto_edges(points, edges, query)
    best = distance.reshape(len(points), -1).argmin(axis=1)
    on_edge = feet.reshape(len(points), -1, 2)[rows, best]
    alone = points[rows, mask.argmax(axis=1)]  # a single point has no edges
    has_edge, within = np.asarray(edges.any(axis=(1, 2))), _inside(points, edges, query)
    nearest = np.where(within[:, None], query, np.where(np.reshape(has_edge, (-1, 1)), on_edge, alone))
    counted = np.asarray(mask, dtype=bool).any(axis=1)
    return np.where(np.reshape(counted, (-1, 1)), nearest, np.nan)


def inside(points: FloatArray, mask: BoolArray, query: FloatArray) -> BoolArray:
    """Whether (T,) a floor point lies in the support polygon or on its edge; never in a segment or a single point.

    Args:
        points: (T, P, 2) [m].
        mask: (T, P) points that count.
        query: (T, 2) [m].
    """
    return _inside(points, hull_edges(points, mask), query)


def polygons(points: FloatArray, mask: BoolArray) -> list[FloatArray]:
    """Corners (k, 2) of every frame's support polygon, counter-clockwise; 2 of a segment, 1 of a point, else 0 [m].

    Args:
        points: (T, P, 2) [m].
        mask: (T, P) points that count.
    """
    points, mask = np.asarray(points, dtype=np.float64), np.asarray(mask, dtype=bool)
    edges = hull_edges(points, mask)
    is_corner = edges.any(axis=2)
    count = is_corner.sum(axis=1)
    first = np.where(count > 0, is_corner.argmax(axis=1), mask.argmax(axis=1))  # a single point has no edges
    following, rows = edges.argmax(axis=2), np.arange(len(points))
    order = np.empty(mask.shape, dtype=np.intp)
    corner = first
    for place in range(mask.shape[1]):
        order[:, place] = corner
        corner = following[rows, corner]
    corners = points[rows[:, None], order]
    count = np.maximum(count, mask.any(axis=1))
    return [some[:k] for some, k in zip(corners, count.tolist())]


def _onto_edges(points: FloatArray, edges: BoolArray, query: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nearest point (T, P, P, 2) of every edge to a floor point, and its distance (T, P, P), infinite where there is no edge."""
    start = points[:, :, None, :]
    edge = points[:, None, :, :] - start
    length = np.linalg.norm(edge, axis=-1)
    to_query = query[:, None, None, :] - start
    along = (edge * to_query).sum(axis=-1) / np.maximum(length, _SAME_M) ** 2
    foot = start + np.clip(along, 0.0, 1.0)[..., None] * edge
    return foot, np.where(edges, np.linalg.norm(query[:, None, None, :] - foot, axis=-1), np.inf)


def _inside(points: FloatArray, edges: BoolArray, query: FloatArray) -> BoolArray:
    edge = points[:, None, :, :] - points[:, :, None, :]
    to_query = query[:, None, None, :] - points[:, :, None, :]
    left = edge[..., 0] * to_query[..., 1] - edge[..., 1] * to_query[..., 0]
    return np.asarray(((left >= 0) | ~edges).all(axis=(1, 2)) & (edges.sum(axis=(1, 2)) >= 3))
