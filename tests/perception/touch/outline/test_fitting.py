"""The descent on circles and rectangles, against the shapes' own geometry and finite differences."""

import numpy as np
import pytest

from glotouch_bt.perception.touch.outline.fitting import (
    CIRCLE,
    INWARD_COSINE,
    INWARD_LOSS,
    RECTANGLE,
    ROUNDED,
    SCALE_M,
    descend,
    fit,
    fit_both,
)
from glotouch_bt.perception.touch.outline.primitives import (
    FREE_SD_M,
    Touches,
    circle,
    prior,
    ray_m,
    rectangle,
    rounded,
)
from tests.perception.touch.outline.conftest import random_params

R = 0.006
FREE = {circle: [0, 1, 3], rectangle: [0, 1, 2, 3, 4], rounded: [0, 1, 2, 3, 4, 5]}


def touched(p, shape, rng, k=9):
    """Contacts all round a shape, their normals, and free places outside."""
    bearing = rng.uniform(0, 2 * np.pi) + np.linspace(0, 2 * np.pi, k, endpoint=False)
    u = np.c_[np.cos(bearing), np.sin(bearing)]
    tips = p[:2] + ray_m(p[None], R, p[:2], u)[0, :, None] * u + rng.normal(0, 3e-4, (k, 2))
    normal = shape(p[None], tips).normal_rad[0] + rng.normal(0, 0.1, k)
    return Touches(tips, normal, np.full(k, 0.2), -u, p[:2] + 1.3 * (tips - p[:2]), R)


def losses(p, shape, touches):
    """Return the loss whose gradient is followed, and the one that ranks, from distances and normals alone."""
    mean, sd = prior(rounded, touches)
    mean, sd = mean[FREE[shape]], sd[FREE[shape]]
    k = len(touches.tips_m)
    g = shape(p[None], np.vstack([touches.tips_m, touches.free_m]))
    gap = g.distance_m[0] - R
    turn = (g.normal_rad[0, :k] - touches.normal_rad + np.pi) % (2 * np.pi) - np.pi
    z = np.r_[gap[:k] / SCALE_M, np.minimum(gap[k:], 0) / FREE_SD_M, turn / touches.normal_sd_rad]
    data, off = np.sum(np.sqrt(1 + z * z) - 1), 0.5 * np.sum(((p - mean) / sd) ** 2)
    inward = np.sum(np.sum(-g.by_params[0, :k, :2] * touches.approach, axis=1) > INWARD_COSINE)
    return data + off, 2 * data + off + INWARD_LOSS * inward


def as_rounded(p, shape):
    """The shape as a rounded rectangle."""
    if shape is circle:
        return np.array([p[0], p[1], 0.0, p[2], p[2], p[2]])
    return np.r_[p, 0.0] if shape is rectangle else p


@pytest.mark.parametrize(("shape", "kind"), [(circle, CIRCLE), (rectangle, RECTANGLE), (rounded, ROUNDED)])
def test_loss_is_that_of_the_shape_and_its_gradient_the_finite_difference(shape, kind):
    rng = np.random.default_rng(3)
    for known in (0.2, np.inf):
        for _ in range(10):
            p = random_params(shape, rng)
            made = touched(p, shape, rng)
            touches = Touches(made.tips_m, made.normal_rad, np.full(9, known), made.approach, made.free_m, R)
            q = p + rng.normal(0, 0.001, len(p))
            if shape is rounded:
                q[5] = abs(q[5])
            found, loss, gradient = descend(as_rounded(q, shape)[None], np.array([kind]), touches, 0, 0, 0.0)
            np.testing.assert_allclose(found[0], as_rounded(q, shape))
            np.testing.assert_allclose(loss[0], losses(q, shape, touches)[1], rtol=1e-9)
            step = 1e-8 * np.eye(len(p))
            by = [(losses(q + d, shape, touches)[0] - losses(q - d, shape, touches)[0]) / 2e-8 for d in step]
            # at the loss's own scale: a contact in the last nanometre before a corner begins is on two faces
            assert np.median(np.abs(gradient[0, FREE[shape]] - by)) < 1e-3 * np.abs(by).max() + 1e-3


@pytest.mark.parametrize("shape", [circle, rounded])
def test_joint_descent_is_as_good_as_separate_fits(shape):
    rng = np.random.default_rng(4)
    for _ in range(6):
        p = random_params(shape, rng)
        touches = touched(p, shape, rng)
        alone, loss = fit(shape, touches)
        ring, boxes, joint = fit_both(touches)
        if shape is circle:
            np.testing.assert_allclose(ring, alone[0], atol=1e-4)
        else:
            assert joint[0] <= loss[0] + 1e-9
            assert np.linalg.norm(boxes[0][:2] - p[:2]) < 2e-3
