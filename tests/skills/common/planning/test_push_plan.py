"""Pushes along the floor, against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.motion import finger_outline_half_m
from glotouch_skills.common.hand import CLEARANCE_M
from glotouch_skills.common.planning import (
    NEEDED_M,
    Neighbour,
    Push,
    PushPlanner,
    after_push,
    displaced,
    finger_space_m,
    touched_edge_m,
)
from glotouch_skills.common.planning.finger_space import Rectangle, clearance_m, cramped_stances, gap_m
from glotouch_skills.common.planning.push_plan import FOOT_SD_M, PLACE_SD_M
from glotouch_skills.common.planning.touch_options import stances_over

GRIPPER = RIZON4_XENSE.gripper
HALF = np.array([0.15, 0.20])


def planner(*candidates) -> PushPlanner:
    return PushPlanner(candidates, HALF, GRIPPER)


def last(pushes):
    found = None
    for found in pushes:  # noqa: B007
        pass
    return found


@pytest.mark.parametrize("yaw_deg", [0, 35, 90, 200])
def test_the_edge_of_a_circle_is_one_radius_behind_its_centre(found, yaw_deg: float) -> None:
    thing = found.round((0.02, -0.03), 0.025)
    u = np.array([math.cos(math.radians(yaw_deg)), math.sin(math.radians(yaw_deg))])
    edge, lever = touched_edge_m(thing, math.radians(yaw_deg), 0.014)
    assert edge == pytest.approx(float(thing.contour.centre_K_m @ u) - 0.5 * thing.contour.size_m[0], abs=5e-4)
    assert lever < 0.002


def test_a_corner_beside_the_centre_is_a_lever(found) -> None:
    thing = found.box((0.0, 0.0), (0.08, 0.03))
    assert touched_edge_m(thing, math.pi / 2, 0.014)[1] == pytest.approx(0.0, abs=1e-6)
    assert touched_edge_m(thing, math.radians(70), 0.014)[1] > 0.005
    assert isinstance(planner(thing).along(thing, math.radians(70), 0.02), str)


@pytest.mark.parametrize("early_m", [-0.004, 0.0, 0.006])
def test_a_pushed_object_moves_from_where_it_was_met(found, early_m: float) -> None:
    """Met early: between an object that stood nearer (and moved as far) and one with a foot (that moved farther)."""
    thing = found.box((0.0, 0.0), (0.06, 0.04))
    push = planner(thing).along(thing, 0.0, 0.03)
    assert isinstance(push, Push)
    moved = after_push(thing, push, 0.025, early_m)
    share = PLACE_SD_M**2 / (PLACE_SD_M**2 + FOOT_SD_M**2)
    np.testing.assert_allclose(moved.contour.centre_K_m, [0.025 - share * early_m, 0.0], atol=1e-9)
    assert moved.quality < thing.quality


def test_an_object_whose_place_is_uncertain_stands_where_it_was_met(found) -> None:
    thing = found.box((0.0, 0.0), (0.06, 0.04))
    thing = replace(thing, contour=replace(thing.contour, covariance=np.diag([0.02**2, 0.0, 0.0, 0.0, 0.0])))
    push = planner(thing).along(thing, 0.0, 0.03)
    assert isinstance(push, Push)
    moved = after_push(thing, push, 0.025, 0.006)
    np.testing.assert_allclose(moved.contour.centre_K_m, [0.019, 0.0], atol=2e-4)


@pytest.mark.parametrize(("radius_m", "fits"), [(0.033, True), (0.020, False)])
def test_the_fork_holds_a_wide_object_only(found, radius_m: float, fits: bool) -> None:
    """The corners of the open fingers touch a circle where its chord is as long as the gap."""
    thing = found.round((0.0, 0.0), radius_m)
    push = PushPlanner([thing], HALF, GRIPPER, 0.03).along(thing, 0.0, 0.03)
    assert isinstance(push, Push) == fits
    if fits:
        radius = 0.5 * float(np.ptp(Neighbour.of(thing).points_K_m[:, 0]))
        edge, lever = touched_edge_m(thing, 0.0, float(finger_outline_half_m(GRIPPER, 0.03)[1]), 0.03)
        assert edge == pytest.approx(-math.sqrt(radius**2 - 0.015**2), abs=1e-3)
        assert lever < 0.002


def test_a_displacement_carries_contacts_and_outline_along(found) -> None:
    thing = found.round((0.0, 0.0), 0.02)
    moved = displaced(thing, np.array([0.01, -0.02]), 0.5, 0.001, 0.002)
    np.testing.assert_allclose(moved.extent_K_m - thing.extent_K_m, np.tile([0.01, -0.02], (len(moved.extent_K_m), 1)))
    assert moved.quality == pytest.approx(1.0 / (1.0 / thing.quality + 5e-6 / 25e-6))


def test_distances_of_rectangles_and_circles(found) -> None:
    other = Neighbour.of(found.round((0.05, 0.0), 0.02))
    radius = 0.5 * float(np.ptp(other.points_K_m[:, 0]))
    at = Rectangle(np.zeros(2), 0.0, np.array([0.01, 0.01]))
    assert clearance_m(at, [other], HALF) == pytest.approx(0.04 - radius, abs=2e-4)
    at_wall = Rectangle(np.array([0.145, 0.0]), 0.0, np.array([0.01, 0.01]))
    assert clearance_m(at_wall, [], HALF) == pytest.approx(-0.005)
    assert clearance_m(Rectangle(np.array([0.05, 0.0]), 0.0, np.array([0.002, 0.002])), [other], HALF) < 0.0
    assert gap_m(other, other.moved(np.array([0.0, 2 * radius + 0.01]))) == pytest.approx(0.01, abs=2e-4)


def test_a_push_makes_the_space_that_was_lacking(found) -> None:
    """Two boxes side by side: the fingers fit over the first once one of them was pushed away."""
    left, right = found.box((0.0, -0.021), (0.05, 0.04)), found.box((0.0, 0.021), (0.05, 0.04), index=1)
    tight = found.box((0.0, -0.07), (0.05, 0.04), index=2)
    around = [Neighbour.of(right), Neighbour.of(tight)]
    cramped = cramped_stances(left, around, HALF, GRIPPER)
    assert finger_space_m(left, around, HALF, GRIPPER, cramped) < CLEARANCE_M <= NEEDED_M
    push = last(planner(left, right, tight).for_space(left))
    assert push is not None
    assert push.space_m >= NEEDED_M
    moved = {c.index: c for c in (left, right, tight)}
    moved[push.candidate] = displaced(moved[push.candidate], push.distance_m * push.along_K)
    others = [Neighbour.of(c) for i, c in moved.items() if i != 0]
    assert finger_space_m(moved[0], others, HALF, GRIPPER, cramped) == pytest.approx(push.space_m)


@pytest.mark.parametrize(("off_mm", "fits"), [(22, False), (24, True)])
def test_a_stance_lacks_space_if_even_the_narrowest_opening_does(found, off_mm: int, fits: bool) -> None:
    """A box of 40 mm has a wall beside its long side: finger (14 mm), gap (5 mm) and clearance (4 mm) make 23 mm."""
    at_wall = found.box((0.0, 0.2 - 0.02 - 1e-3 * off_mm), (0.06, 0.04))
    cramped = cramped_stances(at_wall, [], HALF, GRIPPER)
    along_wall = [abs(math.sin(at.yaw_K_rad)) < 1e-6 for at in stances_over(at_wall, GRIPPER, 0.01)]
    assert any(along_wall)
    assert cramped[along_wall].tolist() == [not fits] * sum(along_wall)


def test_nothing_is_pushed_where_nothing_lacks_space(found) -> None:
    free = found.box((0.0, 0.0), (0.06, 0.04))
    assert not cramped_stances(free, [], HALF, GRIPPER).any()
    assert last(planner(free).for_space(free)) is None


def test_what_cannot_be_pushed_says_why(found) -> None:
    slim = found.box((0.0, 0.0), (0.06, 0.02), height_m=0.09)
    assert "topple" in str(planner(slim).along(slim, math.pi / 2, 0.02))
    corner = found.box((0.115, 0.0), (0.06, 0.04))
    assert "wall" in str(planner(corner).along(corner, 0.0, 0.03))
    assert "fit behind" in str(planner(corner).along(corner, math.pi, 0.03))
    one, two = found.box((0.0, 0.0), (0.06, 0.04)), found.box((0.07, 0.0), (0.06, 0.04), index=1)
    assert "candidate 1" in str(planner(one, two).along(one, 0.0, 0.03))
