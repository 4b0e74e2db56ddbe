from dataclasses import replace

import numpy as np
import pytest

from glotouch_bt.perception.touch import Candidate, Contact, Contour
from glotouch_bt.perception.touch.outline.envelope import KNOWN_QUALITY, envelope, footprint


def _candidate(points: np.ndarray) -> Candidate:
    contacts = tuple(
        Contact(0.0, np.array([*p, 0.0]), np.array([1.0, 0, 0]), np.array([-1.0, 0, 0]), p, 1.0) for p in points
    )
    outline = Contour("round", points.mean(axis=0), (0.01, 0.01), 0.0, 0.0, np.zeros(len(points)))
    return Candidate(0, outline, 0.05, 1.0, contacts)


@pytest.mark.parametrize("yaw_deg", [-80.0, -30.0, 0.0, 17.0, 60.0])
def test_envelope_of_a_rectangle_is_the_rectangle(yaw_deg: float) -> None:
    yaw = np.deg2rad(yaw_deg)
    local = np.array([[x, y] for x in np.linspace(-0.05, 0.05, 9) for y in (-0.02, 0.02)])
    c, s = np.cos(yaw), np.sin(yaw)
    found = envelope(_candidate(local @ np.array([[c, s], [-s, c]]) + [0.03, -0.07]))
    assert found.kind == "box"
    assert found.size_m == pytest.approx((0.10, 0.04), abs=1e-9)
    assert found.centre_K_m == pytest.approx([0.03, -0.07], abs=1e-9)
    assert np.cos(2 * (found.yaw_rad - yaw)) == pytest.approx(1.0)


def test_envelope_of_a_circle_is_the_circle() -> None:
    a = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    found = envelope(_candidate(0.03 * np.stack([np.cos(a), np.sin(a)], axis=1)))
    assert found.kind == "round"
    assert found.size_m[0] == pytest.approx(0.06)


def test_envelope_contains_all_points() -> None:
    rng = np.random.default_rng(3)
    for _ in range(30):
        points = rng.normal(0.0, 0.02, (9, 2)) * [1.0, rng.uniform(0.3, 1.0)]
        assert (envelope(_candidate(points)).residuals_m <= 1e-12).all()


def test_footprint_of_an_uncertain_outline_is_what_was_met() -> None:
    """Two contacts, and a circle of 60 mm that was never felt: presumed, it counts; else only the contacts do."""
    known = _candidate(np.array([[-0.01, 0.0], [0.01, 0.0]]))
    outline = replace(known.contour, centre_K_m=np.array([0.0, 0.03]), size_m=(0.06, 0.06))
    doubtful = replace(known, contour=outline, quality=KNOWN_QUALITY - 0.01)
    assert np.ptp(footprint(doubtful), axis=0) == pytest.approx([0.06, 0.06], abs=1e-4)
    np.testing.assert_allclose(np.ptp(footprint(doubtful, presumed=False), axis=0), [0.024, 0.004], atol=1e-12)
    sure = replace(doubtful, quality=KNOWN_QUALITY)
    np.testing.assert_array_equal(footprint(sure, presumed=False), footprint(sure))
