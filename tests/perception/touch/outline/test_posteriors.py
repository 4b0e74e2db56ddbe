"""Posterior and evidence against the dense normal distribution of the same linear problem, with derivatives by finite
differences."""

import numpy as np
import pytest

from glotouch_bt.perception.touch.outline.deviation import COEFFICIENT_SD_M, HARMONICS, REST_SD_M
from glotouch_bt.perception.touch.outline.posteriors import CORNER_CONTACT_SD_M, SHIFT_SD_M, infer_posteriors
from glotouch_bt.perception.touch.outline.primitives import FREE_SD_M, Touches, circle, prior, rounded, wrapped

R = 0.006
STEP = 1e-7
PARAMS = {circle: np.array([0.001, -0.002, 0.030]), rounded: np.array([0.001, -0.002, 0.3, 0.035, 0.022, 0.004])}


def touched(shape, rng, contacts=9, free=()):
    """Contacts about a shape with a scatter, some of unknown normals; none came from inside."""
    p = PARAMS[shape]
    bearing = np.linspace(0.1, 6.1, contacts)
    out = np.c_[np.cos(bearing), np.sin(bearing)]
    tips = p[:2] + 0.05 * out
    for _ in range(5):  # onto the offset outline
        g = shape(p[None], tips)
        tips = tips + (g.distance_m[0] - R)[:, None] * g.by_params[0, :, :2]
    tips = tips + rng.normal(0, 4e-4, tips.shape)
    normal = shape(p[None], tips).normal_rad[0] + rng.normal(0, 0.1, contacts)
    sd = np.where(np.arange(contacts) % 4 == 1, np.inf, 0.2)
    return Touches(tips, normal, sd, -out, np.reshape(free, (-1, 2)), R)


def dense(shape, amplitude, touches, scale, moved=0):
    """Return the mean of corrections and coefficients, and the log density of the contacts."""
    p, k = PARAMS[shape], len(touches.tips_m)
    points = touches.points_m

    def seen(q):
        g = shape(q[None], points)
        return np.r_[g.distance_m[0] - R, g.normal_rad[0, :k]]

    def difference(up, down):
        return np.r_[(up - down)[: len(points)], wrapped((up - down)[len(points) :])] / (2 * STEP)

    columns = [difference(seen(p + STEP * e), seen(p - STEP * e)) for e in np.eye(len(p))]
    before, sd = prior(shape, touches)
    start = np.where(np.isfinite(sd), before - p, 0.0)
    sd = np.where(np.isfinite(sd), sd, np.sqrt(np.pi / 8))
    g = shape(p[None], points)
    noise = scale * touches.contact_sd_m * np.ones(k)
    if shape is rounded:
        turn = np.array(columns[:2])[:, len(points) :]
        noise = np.where(np.abs(turn).max(axis=0) > 1.0, np.maximum(noise, CORNER_CONTACT_SD_M), noise)
    if amplitude:
        off = points - p[:2]
        bearing, rho = np.arctan2(off[:, 1], off[:, 0]), np.hypot(off[:, 0], off[:, 1])
        spread = COEFFICIENT_SD_M if shape is circle else np.minimum(COEFFICIENT_SD_M, COEFFICIENT_SD_M[2])
        for wave, its in ((np.cos, 1.0), (np.sin, -1.0)):
            other = np.sin if wave is np.cos else np.cos
            for h, each in zip(HARMONICS, spread, strict=True):
                slope = its * h * other(h * bearing) * np.cos(g.normal_rad[0] - bearing) / rho
                columns.append(np.r_[-wave(h * bearing), slope[:k]])
                start, sd = np.r_[start, 0.0], np.r_[sd, amplitude * each]
        noise = np.hypot(noise, amplitude * REST_SD_M)
    if moved:
        before_it = 1.0 * np.r_[np.arange(len(points)) < moved, np.arange(k) < moved]
        columns += [-before_it * columns[0], -before_it * columns[1]]
        start, sd = np.r_[start, 0.0, 0.0], np.r_[sd, SHIFT_SD_M, SHIFT_SD_M]
    h = np.array(columns).T
    y = np.r_[R - g.distance_m[0], wrapped(touches.normal_rad - g.normal_rad[0, :k])]
    sigma = np.r_[noise, np.full(len(points) - k, FREE_SD_M), touches.normal_sd_rad]
    known = np.isfinite(sigma)
    h, y, sigma = h[known], y[known], sigma[known]
    covariance = h @ np.diag(sd**2) @ h.T + np.diag(sigma**2)
    off = y - h @ start
    mean = start + sd**2 * (h.T @ np.linalg.solve(covariance, off))
    normals, free = sigma[len(points) :], np.full(len(points) - k, FREE_SD_M)  # of constant density
    density = -0.5 * off @ np.linalg.solve(covariance, off) - 0.5 * np.linalg.slogdet(covariance)[1]
    return mean, density + np.log(normals).sum() + np.log(free).sum(), (h, sd, sigma)


@pytest.mark.parametrize("shape", [circle, rounded])
@pytest.mark.parametrize("amplitude", [0.0, 0.3, 2.0])
@pytest.mark.parametrize("moved", [0, 3])
def test_posterior_and_evidence_of_the_linear_problem(shape, amplitude, moved):
    made = touched(shape, np.random.default_rng(4))
    touches = Touches(made.tips_m, made.normal_rad, made.normal_sd_rad, made.approach, made.free_m, R, outliers=moved)
    h = infer_posteriors(shape, PARAMS[shape][None], [amplitude], touches, [1.5])[0]
    mean, density, (rows, sd, sigma) = dense(shape, amplitude, touches, 1.5, moved)
    n = len(h.mean)
    covariance = np.linalg.inv(rows.T @ np.diag(sigma**-2) @ rows + np.diag(sd**-2))[:n, :n]
    assert h.log_evidence == pytest.approx(density, abs=1e-4)
    shares = (1.0,) if amplitude or moved else (1.0, 0.5, 0.25, 0.0)  # the correction of a plain one may be reduced
    assert min(np.abs(h.mean - share * mean[:n]).max() for share in shares) < 2e-6
    np.testing.assert_allclose(h.covariance, covariance, atol=1e-4 * np.abs(covariance).max())


def test_a_free_position_that_the_outline_would_cover_is_kept_out():
    """It counts like a contact there, of `FREE_SD_M`; one that is not covered does not count."""
    covered, clear = np.array([0.001, 0.022]), np.array([0.09, 0.0])
    rng = np.random.default_rng(5)
    half = touched(circle, rng)
    low = half.tips_m[:, 1] < -0.01
    some = [a[low] for a in (half.tips_m, half.normal_rad, half.normal_sd_rad, half.approach)]
    p = PARAMS[circle][None]
    alone = infer_posteriors(circle, p, [1.0], Touches(*some, np.zeros((0, 2)), R))[0]
    same = infer_posteriors(circle, p, [1.0], Touches(*some, clear[None], R))[0]
    np.testing.assert_array_equal(same.mean, alone.mean)
    touches = Touches(*some, covered[None], R)
    mean, density, _ = dense(circle, 1.0, touches, 1.0)
    found = infer_posteriors(circle, p, [1.0], touches)[0]
    np.testing.assert_allclose(found.mean, mean, atol=2e-6)
    assert found.log_evidence == pytest.approx(density, abs=1e-4)


def test_contacts_from_inside_are_penalised():
    made = touched(circle, np.random.default_rng(6))
    inside = Touches(made.tips_m, made.normal_rad, made.normal_sd_rad, -made.approach, made.free_m, R)
    fair, wrong = (infer_posteriors(circle, PARAMS[circle][None], [0.0], t)[0].log_evidence for t in (made, inside))
    assert fair - wrong == pytest.approx(10.0 * len(made.tips_m))
