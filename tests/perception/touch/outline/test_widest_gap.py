import numpy as np
import pytest

from glotouch_bt.perception.touch.outline.contours import widest_gap
from glotouch_bt.robot import ParamError


@pytest.mark.parametrize(
    ("bearings", "middle", "width"),
    [([0], 180, 360), ([0, 90], 225, 270), ([0, 90, 180], 270, 180), ([170, -170], 0, 340), ([350, 10, 100], 225, 250)],
)
def test_largest_gap(bearings, middle, width):
    got, gap = widest_gap(np.deg2rad(bearings))
    assert np.cos(got - np.deg2rad(middle)) == pytest.approx(1.0)
    assert np.degrees(gap) == pytest.approx(width)
    assert -np.pi < got <= np.pi


def test_largest_gap_is_the_farthest_bearing():
    """Brute force: no bearing is farther from all contacts than the middle of the gap."""
    rng = np.random.default_rng(0)
    grid = np.linspace(-np.pi, np.pi, 7200)
    for _ in range(50):
        b = rng.uniform(-10, 10, rng.integers(1, 9))
        near = np.min(np.arccos(np.clip(np.cos(grid[:, None] - b), -1, 1)), axis=1)
        mine = np.min(np.arccos(np.clip(np.cos(widest_gap(b)[0] - b), -1, 1)))
        assert mine >= near.max() - 1e-3


def test_widest_gap_needs_a_bearing():
    with pytest.raises(ParamError):
        widest_gap(np.zeros(0))
