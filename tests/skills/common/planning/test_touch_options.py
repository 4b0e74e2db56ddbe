"""Stances of adaptive touching: closed forms for a rectangle."""

from __future__ import annotations

import numpy as np
import pytest

from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.perception.touch import TouchSequence, TouchSet
from glotouch_skills.common.planning import beside
from glotouch_skills.common.planning.squeeze_plan import stance

GRIPPER = RIZON4_XENSE.gripper


@pytest.mark.parametrize(("length_m", "shifts_mm"), [(0.06, {-8, 0, 8}), (0.03, {0})])
def test_stances_beside_one_stay_over_the_middle_half(found, length_m: float, shifts_mm: set[int]) -> None:
    """A stance 8 mm aside lies within the middle half of 60 mm, not of 30 mm."""
    box = found.box((0.03, -0.05), (length_m, 0.025))
    at = stance(box, 0.0, 0.0, 0.01, GRIPPER)
    near = beside(TouchSet(box, ()), at, GRIPPER, 0.005)
    straight = {round(1e3 * float(s.position_K_m[0] - 0.03)) for s in near if s.yaw_K_rad == 0.0}
    assert straight == shifts_mm - {0}
    turns_deg = {round(np.rad2deg(s.yaw_K_rad)) for s in near if abs(s.position_K_m[0] - 0.03) < 1e-6}
    assert turns_deg == {10, -10}
    assert all(s.opening_m == pytest.approx(s.span_m + 0.01) for s in near)


def test_a_stance_that_was_used_is_not_offered_again(found) -> None:
    box = found.box((0.03, -0.05), (0.06, 0.025))
    at = stance(box, 0.0, 0.0, 0.01, GRIPPER)
    taken = beside(TouchSet(box, ()), at, GRIPPER, 0.005)[0]
    used = TouchSet(box, (TouchSequence(taken.position_K_m, taken.yaw_K_rad, ()),))
    assert len(beside(used, at, GRIPPER, 0.005)) == len(beside(TouchSet(box, ()), at, GRIPPER, 0.005)) - 1
