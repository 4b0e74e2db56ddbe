import numpy as np
import pytest

from glotouch_bt.perception.touch import Contour, largest_gap_direction, needs_more, next_direction, widest_gap
from glotouch_bt.robot import ParamError

ROUND = Contour("round", np.zeros(2), (0.06, 0.06), 0.0, 3e-4, np.zeros(0))
BOX = Contour("box", np.zeros(2), (0.10, 0.04), 0.3, 3e-4, np.zeros(0))


def at(contour, *degrees, distance=0.036):
    a = np.deg2rad(degrees)
    return contour.centre_K_m + distance * np.c_[np.cos(a), np.sin(a)]


@pytest.mark.parametrize(
    ("bearings", "middle", "width"),
    [([0], 180, 360), ([0, 90], 225, 270), ([0, 90, 180], 270, 180), ([170, -170], 0, 340), ([350, 10, 100], 225, 250)],
)
def test_largest_gap(bearings, middle, width):
    got, gap = widest_gap(np.deg2rad(bearings))
    assert np.cos(got - np.deg2rad(middle)) == pytest.approx(1.0)
    assert np.degrees(gap) == pytest.approx(width)
    assert largest_gap_direction(np.deg2rad(bearings)) == got
    assert -np.pi < got <= np.pi


def test_largest_gap_is_the_farthest_bearing():
    """By brute force: no bearing is farther from all contacts than the one chosen."""
    rng = np.random.default_rng(0)
    grid = np.linspace(-np.pi, np.pi, 7200)
    for _ in range(50):
        b = rng.uniform(-10, 10, rng.integers(1, 9))
        near = np.min(np.arccos(np.clip(np.cos(grid[:, None] - b), -1, 1)), axis=1)
        mine = np.min(np.arccos(np.clip(np.cos(largest_gap_direction(b) - b), -1, 1)))
        assert mine >= near.max() - 1e-3


def test_no_bearing_no_gap():
    with pytest.raises(ParamError):
        widest_gap(np.zeros(0))


def test_stopping_rule():
    assert needs_more(at(ROUND, 0, 72, 144, 216, 288), ROUND)  # five
    assert not needs_more(at(ROUND, 0, 60, 120, 180, 240, 300), ROUND)
    assert needs_more(at(ROUND, 0, 30, 60, 90, 120, 150), ROUND)  # one side only
    assert not needs_more(at(ROUND, *range(0, 120, 10)), ROUND)  # enough is enough
    poor = Contour("round", np.zeros(2), (0.06, 0.06), 0.0, 4e-3, np.zeros(0))
    assert needs_more(at(poor, 0, 60, 120, 180, 240, 300), poor)
    assert not needs_more(at(poor, *range(0, 360, 36)), poor)


def test_a_box_needs_all_its_faces():
    """The far end of a long box untouched: more contacts, and the next one goes there."""
    c, s = np.cos(0.3), np.sin(0.3)
    local = np.array([[0.03, 0.026], [0, 0.026], [-0.03, 0.026], [-0.04, -0.026], [0, -0.026], [0.03, -0.026]])
    ends = np.array([[0.056, 0.01], [0.056, -0.01], [-0.056, 0.0]])
    turn = np.array([[c, s], [-s, c]])
    half = np.vstack([local, ends[:2]]) @ turn
    assert needs_more(half, BOX)
    assert np.cos(next_direction(half, BOX) - (0.3 + np.pi)) == pytest.approx(1.0)
    blocked = np.array([0.3 - np.pi])
    assert np.cos(next_direction(half, BOX, blocked) - (0.3 + np.pi)) < 0.9
    assert not needs_more(np.vstack([local, ends]) @ turn, BOX)
