import numpy as np
import pytest
from scipy.spatial import ConvexHull

from simprep.motion.support import inside, nearest_point, polygons, signed_distance, support_centre, support_points

SQUARE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]])


def polygon(points, mask=None):
    points = np.asarray(points, dtype=float)
    return polygons(points[None], np.ones((1, len(points)), dtype=bool) if mask is None else mask[None])[0]


def one(points, query):
    mask = np.ones((1, len(points)), dtype=bool)
    points, query = np.asarray(points)[None], np.asarray(query, dtype=float)[None]
    distance = float(signed_distance(points, mask, query)[0])
    assert inside(points, mask, query)[0] == (distance >= 0 and len(polygon(points[0])) > 2)
    return distance


def test_square_with_inner_collinear_and_repeated_points():
    mask = np.ones((1, len(SQUARE)), dtype=bool)
    assert support_centre(SQUARE[None], mask)[0] == pytest.approx([1, 1])
    assert polygon(SQUARE) == pytest.approx(np.array([[0, 0], [2, 0], [2, 2], [0, 2]]))
    assert one(SQUARE, [1.0, 0.5]) == pytest.approx(0.5)  # inside, nearest edge below
    assert one(SQUARE, [1.0, -0.5]) == pytest.approx(-0.5)  # below an edge
    assert one(SQUARE, [5.0, 6.0]) == pytest.approx(-5.0)  # off a corner, 3-4-5
    assert one(SQUARE, [2.0, 1.0]) == pytest.approx(0.0)


def test_degenerate_support():
    segment = [[0.0, 0.0], [1.0, 1.0], [0.25, 0.25]]
    assert support_centre(np.array([segment]), np.ones((1, 3), dtype=bool))[0] == pytest.approx([0.5, 0.5])
    assert one(segment, [0.5, 0.5]) == pytest.approx(0.0)
    assert one(segment, [1.0, 0.0]) == pytest.approx(-np.sqrt(0.5))
    assert one([[1.0, 2.0]], [4.0, 6.0]) == pytest.approx(-5.0)
    assert support_centre(np.array([[[1.0, 2.0], [9.0, 9.0]]]), np.array([[True, False]]))[0] == pytest.approx([1, 2])
    nothing = np.zeros((1, 2), dtype=bool)
    assert np.isnan(signed_distance(np.zeros((1, 2, 2)), nothing, np.zeros((1, 2)))).all()
    assert np.isnan(support_centre(np.zeros((1, 2, 2)), nothing)).all()
    assert polygon(np.zeros((3, 2)), np.zeros(3, dtype=bool)).shape == (0, 2)
    assert not inside(np.zeros((1, 2, 2)), nothing, np.zeros((1, 2))).any()
    np.testing.assert_array_equal(polygon(segment), [[0, 0], [1, 1]])
    np.testing.assert_array_equal(polygon([[9, 9], [1, 2], [1, 2]], np.array([False, True, True])), [[1, 2]])


def test_agrees_with_qhull_on_random_points():
    rng = np.random.default_rng(1)
    points = rng.normal(size=(60, 8, 2)) * [0.2, 0.1] + rng.normal(size=(60, 1, 2)) * 5
    mask = rng.random((60, 8)) < 0.8
    mask[:, :3] = True
    query = points.mean(axis=1) + rng.normal(size=(60, 2)) * 0.15
    centre, distance, corners_of = (
        support_centre(points, mask),
        signed_distance(points, mask, query),
        polygons(points, mask),
    )
    np.testing.assert_array_equal(inside(points, mask, query), distance >= 0)
    for frame in range(60):
        hull = ConvexHull(points[frame][mask[frame]])
        corners = hull.points[hull.vertices]
        assert corners_of[frame] == pytest.approx(np.roll(corners, _shift(corners, points[frame]), 0))
        fan = np.stack([np.broadcast_to(corners[0], corners[1:-1].shape), corners[1:-1], corners[2:]], axis=1)
        a, b = fan[:, 1] - fan[:, 0], fan[:, 2] - fan[:, 0]
        area = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        assert centre[frame] == pytest.approx((area[:, None] * fan.mean(axis=1)).sum(0) / area.sum())
        to_lines = hull.equations @ [*query[frame], 1.0]  # qhull: negative inside
        if to_lines.max() <= 0:
            assert distance[frame] == pytest.approx(-to_lines.max())
        else:
            steps = np.linspace(0, 1, 2001)[:, None, None]
            border = (1 - steps) * corners + steps * np.roll(corners, -1, axis=0)
            nearest = np.linalg.norm(border - query[frame], axis=-1).min()
            assert distance[frame] == pytest.approx(-nearest, abs=1e-4)


def _shift(corners, points):
    # qhull starts anywhere, ours at the first hull point in input order
    first = min(int(np.flatnonzero((points == corner).all(axis=1))[0]) for corner in corners)
    return -int(np.flatnonzero((corners == points[first]).all(axis=1))[0])


def test_turning_the_floor_changes_nothing():
    rng = np.random.default_rng(2)
    points, query = rng.normal(size=(20, 8, 2)), rng.normal(size=(20, 2))
    points[5:10, :, 1] = 0.0  # segments: the degenerate branch must turn with the rest
    mask = np.ones((20, 8), dtype=bool)
    c, s = np.cos(1.1), np.sin(1.1)
    turn = np.array([[c, s], [-s, c]])
    moved_points, moved_query = points @ turn + [30.0, -7.0], query @ turn + [30.0, -7.0]
    assert signed_distance(moved_points, mask, moved_query) == pytest.approx(signed_distance(points, mask, query))
    assert support_centre(moved_points, mask) == pytest.approx(support_centre(points, mask) @ turn + [30.0, -7.0])


def test_whole_soles_of_the_feet_that_stand():
    points = np.arange(48.0).reshape(2, 2, 4, 3)
    floor, mask = support_points(points, np.array([[True, False], [False, True]]))
    np.testing.assert_array_equal(floor[0][mask[0]], points[0, 0, :, :2])
    np.testing.assert_array_equal(floor[1][mask[1]], points[1, 1, :, :2])


def test_nearest_point_of_a_polygon_a_segment_and_a_point():
    def nearest(points, query):
        return nearest_point(np.array([points]), np.ones((1, len(points)), dtype=bool), np.array([query]))[0]

    assert nearest(SQUARE, [0.3, 0.4]) == pytest.approx([0.3, 0.4])
    assert nearest(SQUARE, [1.5, -2.0]) == pytest.approx([1.5, 0.0])
    assert nearest(SQUARE, [5.0, 6.0]) == pytest.approx([2.0, 2.0])
    assert nearest([[0.0, 0.0], [2.0, 2.0]], [2.0, 0.0]) == pytest.approx([1.0, 1.0])
    assert nearest([[3.0, 4.0]], [0.0, 0.0]) == pytest.approx([3.0, 4.0])
    nobody = nearest_point(SQUARE[None], np.zeros((1, len(SQUARE)), dtype=bool), np.zeros((1, 2)))
    assert np.isnan(nobody).all()
