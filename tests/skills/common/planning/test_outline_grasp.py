"""Grasps from an outline alone, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_skills.common.hand import CLEARANCE_M
from glotouch_skills.common.planning import Neighbour, outline_grasp
from glotouch_skills.common.planning.finger_space import finger_clearance_m
from glotouch_skills.common.planning.grasp_plan import ALTERNATIVES
from glotouch_skills.common.planning.outline_grasp import HEIGHT_RATIO, SIDE_GAPS_M, pad_heights
from glotouch_skills.common.planning.squeeze_motion import lowest_pads_m
from glotouch_skills.common.planning.squeeze_plan import Stance

GRIPPER = RIZON4_XENSE.gripper
HALF = np.array([0.15, 0.20])


@pytest.mark.parametrize("yaw_deg", [-60, 0, 25])
def test_the_jaws_close_across_the_narrow_side_in_the_middle(found, yaw_deg: float) -> None:
    thing = found.box((0.02, -0.03), (0.08, 0.04), math.radians(yaw_deg), height_m=0.07)
    plan = outline_grasp(thing, [], HALF, GRIPPER)
    assert plan is not None
    assert math.remainder(plan.yaw_rad - math.radians(yaw_deg), math.pi) == pytest.approx(0.0, abs=1e-6)
    np.testing.assert_allclose(plan.position_K_m[:2], [0.02, -0.03], atol=1e-6)
    assert plan.aperture_m == pytest.approx(0.04, abs=1e-6)
    assert plan.opening_m == pytest.approx(0.04 + 2 * SIDE_GAPS_M[0], abs=1e-6)
    assert plan.position_K_m[2] == pytest.approx(HEIGHT_RATIO * 0.07)
    assert 1 < len(plan.alternatives) <= ALTERNATIVES


def test_the_open_fingers_of_every_grasp_are_clear(found) -> None:
    thing = found.round((0.0, 0.0), 0.025, index=0)
    others = [
        Neighbour.of(found.round((0.05, 0.02), 0.015, index=1)),
        Neighbour.of(found.box((-0.07, 0), (0.06, 0.05))),
    ]
    plan = outline_grasp(thing, others, HALF, GRIPPER)
    assert plan is not None
    for one in (plan, *plan.alternatives):
        at = Stance(one.position_K_m[:2], one.yaw_rad, one.opening_m, one.aperture_m)
        assert finger_clearance_m(at, others, HALF, GRIPPER) >= CLEARANCE_M


def test_an_object_wider_than_the_jaws_or_shut_in_cannot_be_grasped(found) -> None:
    assert outline_grasp(found.round((0.0, 0.0), 0.045), [], HALF, GRIPPER) is None
    thing = found.box((0.0, 0.0), (0.07, 0.07))
    around = [
        Neighbour.of(found.box(c, s, index=k))
        for k, (c, s) in enumerate((((0.0, y), (0.12, 0.03)) for y in (-0.052, 0.052)), start=1)
    ] + [Neighbour.of(found.box((x, 0.0), (0.03, 0.12), index=5)) for x in (-0.052, 0.052)]
    assert outline_grasp(thing, around, HALF, GRIPPER) is None


def test_low_objects_are_grasped_as_low_as_the_fingers_reach() -> None:
    assert pad_heights(0.02, GRIPPER) == (lowest_pads_m(0.02, GRIPPER),)
    middle, lowest = pad_heights(0.10, GRIPPER)
    assert (middle, lowest) == (pytest.approx(0.055), lowest_pads_m(0.10, GRIPPER))
