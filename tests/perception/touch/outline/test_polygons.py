import numpy as np
import pytest
import scipy
from hypothesis import given
from hypothesis import strategies as st

from glotouch_bt.perception.touch.outline.polygons import (
    area_and_centroid,
    convex_hull,
    minimum_rectangle,
    polygon_distance,
    shrunk_convex,
    star_hull,
)
from glotouch_bt.robot import ParamError

CORNERS = np.array([[0.0, 0.0], [6.0, 0.0], [6.0, 2.0], [2.0, 2.0], [2.0, 5.0], [0.0, 5.0]])  # an L


def turned(points, angle, shift):
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[c, s], [-s, c]]) + shift


@given(st.floats(-3, 3), st.floats(-5, 5), st.floats(-5, 5))
def test_area_and_centroid_of_an_l(angle, x, y):
    """Two rectangles: 6 x 2 about (3, 1) and 2 x 3 about (1, 3.5)."""
    area, centroid = area_and_centroid(turned(CORNERS, angle, [x, y]))
    want = turned(np.array([(12 * 3 + 6 * 1) / 18, (12 * 1 + 6 * 3.5) / 18]), angle, [x, y])
    assert area == pytest.approx(18)
    np.testing.assert_allclose(centroid, want, atol=1e-9)


@given(st.floats(-3, 3), st.floats(0.3, 4), st.floats(0.3, 4))
def test_least_rectangle_of_a_rectangle(angle, a, b):
    centre, size, yaw = minimum_rectangle(turned(np.array([[a, b], [-a, b], [-a, -b], [a, -b]]), angle, [1, 2]))
    np.testing.assert_allclose(centre, [1, 2], atol=1e-9)
    np.testing.assert_allclose(size, sorted([2 * a, 2 * b], reverse=True))
    assert -np.pi / 2 <= yaw < np.pi / 2
    if abs(a - b) > 1e-3:
        assert abs(np.cos(yaw - angle)) == pytest.approx(1.0 if a > b else 0.0, abs=1e-6)


@given(st.integers(0, 10_000), st.floats(0.01, 0.2))
def test_shrinking_undoes_growing(seed, radius):
    """The support function of what is left is that of the points; the disc is a polygon of 256 sides."""
    points = np.random.default_rng(seed).normal(0, 1, (12, 2))
    a = np.linspace(0, 2 * np.pi, 256, endpoint=False)
    ring = np.c_[np.cos(a), np.sin(a)]
    grown = convex_hull((points[:, None] + radius * ring).reshape(-1, 2))
    left = shrunk_convex(grown, radius)
    np.testing.assert_allclose((left @ ring.T).max(0), (points @ ring.T).max(0), atol=1e-3 * radius + 1e-9)


@given(st.floats(-3, 3), st.floats(0.05, 0.1), st.floats(0.02, 0.05), st.integers(2, 40))
def test_collinear_points_on_the_sides_of_a_rectangle_change_nothing(angle, long, short, n):
    """A smaller rectangle is left, although rounding makes the edges along one side not quite parallel."""
    corners = np.array([[0.0, 0], [long, 0], [long, short], [0, short]])
    sides = [np.linspace(a, b, n, endpoint=False) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    left = shrunk_convex(turned(np.concatenate(sides), angle, [0.3, -0.2]), 0.006)
    assert np.isfinite(left).all()
    np.testing.assert_allclose(minimum_rectangle(left)[1], [long - 0.012, short - 0.012], rtol=1e-6)


def test_small_polygon_shrinks_to_its_centroid():
    assert shrunk_convex(np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]), 0.6).shape == (1, 2)


def test_distance_of_an_l():
    """Against a dense outline, and rectangles for the sign."""
    dense = np.concatenate(
        [a + np.linspace(0, 1, 2001)[:, None] * (b - a) for a, b in zip(CORNERS, np.roll(CORNERS, -1, 0), strict=True)]
    )
    points = np.random.default_rng(0).uniform(-1, 7, (300, 2))
    got = polygon_distance(CORNERS, points)
    np.testing.assert_allclose(np.abs(got), np.linalg.norm(points[:, None] - dense, axis=2).min(1), atol=2e-3)
    x, y = points.T
    np.testing.assert_array_equal(got < 0, (x > 0) & (y > 0) & (((x < 6) & (y < 2)) | ((x < 2) & (y < 5))))


@given(st.integers(0, 10_000), st.booleans())
def test_convex_hull_equals_qhull(seed, on_grid):
    """With points on a grid, many coincide or lie on one line; Qhull then keeps some that are no corners."""
    rng = np.random.default_rng(seed)
    points = rng.normal(0, 0.03, (int(rng.integers(4, 60)), 2))
    points = np.round(points, 2) if on_grid else points
    try:
        want = scipy.spatial.ConvexHull(points)
    except scipy.spatial.QhullError:
        with pytest.raises(ParamError):
            convex_hull(points)
        return
    got = convex_hull(points)
    area, _ = area_and_centroid(got)
    assert area == pytest.approx(want.volume)
    assert (polygon_distance(got, points) < 1e-9).all()
    if not on_grid:
        first = int(np.flatnonzero((points[want.vertices] == got[0]).all(axis=1))[0])
        np.testing.assert_array_equal(got, points[np.roll(want.vertices, -first)])


@pytest.mark.parametrize(
    "points",
    [
        np.zeros((0, 2)),
        np.zeros((1, 2)),
        np.zeros((5, 2)),
        np.linspace(0, 0.1, 7)[:, None] * [0.6, 0.8] + [0.3, -0.1],
        np.array([[0, 0], [1, 0], [1, 1], [np.nan, 0]]),
    ],
)
def test_points_without_area_have_no_hull(points):
    with pytest.raises(ParamError):
        convex_hull(points)


@given(st.integers(0, 10_000))
def test_star_hull_equals_the_convex_hull(seed):
    """For random distances along evenly spaced rays."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(8, 80))
    bearing = np.linspace(-np.pi, np.pi, n, endpoint=False)
    star = rng.uniform(0.02, 0.05, n)[:, None] * np.c_[np.cos(bearing), np.sin(bearing)]
    got, want = star[star_hull(star)], convex_hull(star)
    assert len(got) == len(want)
    first = int(np.argmin(np.linalg.norm(want - got[0], axis=1)))
    np.testing.assert_array_equal(got, np.roll(want, -first, axis=0))
