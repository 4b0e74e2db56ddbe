"""The stance of the jaws across a push, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_skills.common.planning import Stance
from glotouch_skills.make_space.centring import GAPS_M, SPACE_M, across_push

GRIPPER = RIZON4_XENSE.gripper


def test_the_jaws_stand_across_the_push_in_the_middle_of_the_object(found) -> None:
    thing = found.box((0.02, -0.03), (0.10, 0.04))
    at = across_push(thing, 0.0, GRIPPER)
    assert isinstance(at, Stance)
    np.testing.assert_allclose(at.position_K_m, [0.02, -0.03], atol=1e-9)
    assert at.span_m == pytest.approx(0.04)
    assert at.opening_m == pytest.approx(0.04 + 2 * GAPS_M[0])


@pytest.mark.parametrize("yaw_deg", [30, 110, 250])
def test_the_span_is_the_width_across_the_push(found, yaw_deg: float) -> None:
    yaw = math.radians(yaw_deg)
    at = across_push(found.box((0.02, -0.03), (0.04, 0.02)), yaw, GRIPPER)
    assert isinstance(at, Stance)
    assert at.span_m == pytest.approx(0.04 * abs(math.sin(yaw)) + 0.02 * abs(math.cos(yaw)))
    np.testing.assert_allclose(at.position_K_m, [0.02, -0.03], atol=1e-9)


def test_an_object_that_the_open_jaws_do_not_span_is_left(found) -> None:
    wide = found.round((0.0, 0.0), 0.045)
    assert across_push(wide, 0.5 * math.pi, GRIPPER) == "it is too wide for the open jaws"


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_jaws_make_use_of_the_space_that_neighbours_leave(found, side: float) -> None:
    """A finger has 14 mm; a neighbour 24 mm beside the object leaves 10 mm less the clearance for the gap."""
    thing = found.box((0.0, 0.0), (0.04, 0.04))
    finger_m = 2.0 * GRIPPER.finger.half_m[1]
    near = found.box((0.0, side * (0.02 + 0.0085 + finger_m + SPACE_M + 0.02)), (0.04, 0.04), index=1)
    at = across_push(thing, 0.0, GRIPPER, [near])
    assert isinstance(at, Stance)
    assert (at.yaw_K_rad, at.opening_m) == pytest.approx((0.0, 0.04 + 2 * GAPS_M[-1]))


def test_the_jaws_turn_where_neighbours_leave_no_space_across_the_push(found) -> None:
    """Discs close to both fingers: turned by 40 degrees the fingers pass them."""
    thing = found.round((0.0, 0.0), 0.02)
    near = [found.round((0.0, side * 0.05), 0.012, index=i) for i, side in enumerate((1.0, -1.0), 1)]
    at = across_push(thing, 0.0, GRIPPER, near)
    assert isinstance(at, Stance)
    assert abs(at.yaw_K_rad) > 0.3


def test_without_space_there_is_no_stance(found) -> None:
    thing, walls = found.round((0.0, 0.0), 0.02), np.array([0.03, 0.03])
    assert across_push(thing, 0.0, GRIPPER, [], walls) == "neighbours or walls leave no space for the open fingers"
