"""The stance of the jaws across a push, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_skills.make_space.centring import GAP_M, across_push

GRIPPER = RIZON4_XENSE.gripper


def test_the_jaws_stand_across_the_push_in_the_middle_of_the_object(found) -> None:
    thing = found.box((0.02, -0.03), (0.10, 0.04))
    at = across_push(thing, 0.0, GRIPPER)
    assert at is not None
    np.testing.assert_allclose(at.position_K_m, [0.02, -0.03], atol=1e-9)
    assert at.span_m == pytest.approx(0.04)
    assert at.opening_m == pytest.approx(0.04 + 2 * GAP_M)


@pytest.mark.parametrize("yaw_deg", [30, 110, 250])
def test_the_span_is_the_width_across_the_push(found, yaw_deg: float) -> None:
    yaw = math.radians(yaw_deg)
    at = across_push(found.box((0.02, -0.03), (0.04, 0.02)), yaw, GRIPPER)
    assert at is not None
    assert at.span_m == pytest.approx(0.04 * abs(math.sin(yaw)) + 0.02 * abs(math.cos(yaw)))
    np.testing.assert_allclose(at.position_K_m, [0.02, -0.03], atol=1e-9)


def test_an_object_that_the_open_jaws_do_not_span_is_left(found) -> None:
    assert across_push(found.box((0.0, 0.0), (0.10, 0.04)), 0.5 * math.pi, GRIPPER) is None
