"""Uncertainty of outlines and places of felt taxels, against independent computations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from glotouch_bt.perception.touch import Contour
from glotouch_bt.report.state import felt_points_P
from glotouch_bt.report.state.parse import densified, outline_sd_m, outward_normals
from glotouch_bt.robot import Pose

RECTANGLE = Contour("box", np.array([0.03, -0.02]), (0.08, 0.04), 0.6, 0.0, np.zeros(0))


def test_the_sd_of_a_circle_is_that_of_centre_and_radius() -> None:
    circle = Contour("round", np.array([0.1, 0.2]), (0.06, 0.06), 0.0, 0.0, np.zeros(0))
    outline = circle.outline_K_m(64)
    sd = outline_sd_m(circle, outline, outward_normals(outline), np.diag([1e-6, 4e-6, 9e-6]).tolist())
    assert sd[0] == pytest.approx(np.sqrt(1e-6 + 9e-6), rel=1e-3)  # at +x: sd of x and of the radius
    assert sd[16] == pytest.approx(np.sqrt(4e-6 + 9e-6), rel=1e-3)  # at +y


def test_the_sd_of_a_rectangle_is_the_spread_of_drawn_rectangles() -> None:
    """Monte Carlo: how far the side through each edge's middle moves along its normal."""
    rng = np.random.default_rng(1)
    root = rng.normal(0.0, 1.0, (5, 5)) * 3e-4
    covariance = root @ root.T
    corners = RECTANGLE.outline_K_m()
    middles = 0.5 * (corners[:-1] + corners[1:])
    closed = np.concatenate([middles, middles[:1]])  # at the middles the normal is that of the side
    a = RECTANGLE.yaw_rad
    long, short = np.array([np.cos(a), np.sin(a)]), np.array([-np.sin(a), np.cos(a)])
    side = np.round((closed - RECTANGLE.centre_K_m) @ np.stack([long, short], axis=1) / [0.04, 0.02]).astype(int)
    normal = side @ np.stack([long, short])
    sd = outline_sd_m(RECTANGLE, closed, normal, covariance.tolist())
    drawn = rng.multivariate_normal(np.zeros(5), covariance, 20000)
    moved = np.zeros((len(drawn), 4))
    for k, (dx, dy, dyaw, dl, ds) in enumerate(drawn):
        made = replace(
            RECTANGLE,
            centre_K_m=RECTANGLE.centre_K_m + np.array((dx, dy)),
            yaw_rad=a + dyaw,
            size_m=(0.08 + 2 * dl, 0.04 + 2 * ds),
        )
        new = made.outline_K_m()
        for i in range(4):  # distance from the old middle to the new line, along the old normal
            along = new[i + 1] - new[i]
            n = np.array([along[1], -along[0]]) / np.linalg.norm(along)
            moved[k, i] = n @ (new[i] - middles[i]) / (n @ normal[i])
    np.testing.assert_allclose(sd[:4], moved.std(axis=0), rtol=0.03)


def test_an_unknown_covariance_is_no_uncertainty() -> None:
    outline = RECTANGLE.outline_K_m()
    for covariance in (None, [], [[1.0]], "x", np.full((5, 5), np.nan).tolist()):
        assert not outline_sd_m(RECTANGLE, outline, outward_normals(outline), covariance).any()


def test_a_dense_outline_is_the_same_outline() -> None:
    outline = RECTANGLE.outline_K_m()
    dense = densified(outline, 0.003)
    steps = np.linalg.norm(np.diff(dense, axis=0), axis=1)
    assert steps.max() <= 0.003 + 1e-12
    assert steps.sum() == pytest.approx(2 * (0.08 + 0.04))
    for corner in outline:
        assert np.linalg.norm(dense - corner, axis=1).min() < 1e-12
    np.testing.assert_array_equal(dense[0], dense[-1])


@pytest.mark.parametrize("order", [1, -1])
def test_normals_point_outward_whatever_the_direction(order: int) -> None:
    outline = RECTANGLE.outline_K_m()[::order]
    out = outward_normals(outline)
    assert (((outline - RECTANGLE.centre_K_m) * out).sum(axis=1) > 0).all()
    np.testing.assert_allclose(np.linalg.norm(out, axis=1), 1.0)


def test_a_taxel_is_where_the_layout_says() -> None:
    """Row 0 is nearest the wrist (-z_P), columns run along +x_P, the left pad is at +y_P (`TactileFrame`)."""
    left, right = np.zeros((35, 20)), np.zeros((35, 20))
    left[0, 19], right[34, 0] = 4e-4, 6e-4
    points, depth = felt_points_P(left, right, 0.05, (0.020, 0.035))
    np.testing.assert_allclose(points, [[0.0095, 0.0254, -0.017], [-0.0095, -0.0256, 0.017]], atol=1e-12)
    np.testing.assert_allclose(depth, [4e-4, 6e-4])
    down = Pose.pointing_down([0.0, 0.0, 0.1], 0.0)
    assert down.apply(points)[0][2] == pytest.approx(0.117)  # nearest the wrist is highest
