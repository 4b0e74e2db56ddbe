import numpy as np
import pytest

from glotouch_bt.perception.touch.outline.primitives import circle, ray_m, rectangle, rounded
from tests.perception.touch.outline.conftest import random_params

R = 0.006


@pytest.mark.parametrize("shape", [circle, rectangle, rounded])
def test_derivatives_are_the_finite_differences(shape):
    """Everywhere but on the few seams between faces and corners."""
    rng = np.random.default_rng(0)
    for _ in range(40):
        p = random_params(shape, rng)
        points = p[:2] + rng.uniform(-0.07, 0.07, (40, 2))
        g = shape(p[None], points)
        for j in range(len(p)):
            step = np.zeros(len(p))
            step[j] = 1e-7
            up, down = shape((p + step)[None], points), shape((p - step)[None], points)
            by = (up.distance_m - down.distance_m) / 2e-7
            assert np.quantile(np.abs(by - g.by_params[..., j]), 0.95) < 1e-5


@pytest.mark.parametrize("shape", [circle, rectangle, rounded])
def test_the_normal_is_the_gradient_of_the_distance(shape):
    rng = np.random.default_rng(3)
    for _ in range(40):
        p = random_params(shape, rng)
        g = shape(p[None], p[:2] + rng.uniform(-0.07, 0.07, (40, 2)))
        gradient = -np.stack([np.cos(g.normal_rad), np.sin(g.normal_rad)], axis=-1)
        np.testing.assert_allclose(g.by_params[..., :2], gradient, atol=1e-9)


@pytest.mark.parametrize("shape", [circle, rectangle, rounded])
def test_rays_end_where_the_ball_touches(shape):
    rng = np.random.default_rng(1)
    for _ in range(40):
        p = random_params(shape, rng)
        bearing = np.r_[rng.uniform(-np.pi, np.pi, 50), p[2] + np.pi * np.array([-1, -0.5, 0, 0.5, 1])]
        u = np.c_[np.cos(bearing), np.sin(bearing)]
        origin = p[:2] + rng.uniform(-0.006, 0.006, 2)
        tips = origin + ray_m(p[None], R, origin, u)[0, :, None] * u
        np.testing.assert_allclose(shape(p[None], tips).distance_m[0], R, atol=1e-9)


def test_distance_of_rounded_corners():
    """A square of half side 20 with corners of radius 5 is one of half side 15 swept by a disc of 5."""
    p = np.array([[0, 0, 0.3, 0.020, 0.020, 0.005]])
    q = np.array([[0, 0, 0.3, 0.015, 0.015]])
    points = np.random.default_rng(2).uniform(-0.05, 0.05, (100, 2))
    outside = rectangle(q, points).distance_m[0] > 0
    want = rectangle(q, points).distance_m[0] - 0.005
    np.testing.assert_allclose(rounded(p, points).distance_m[0][outside], want[outside], atol=1e-12)
