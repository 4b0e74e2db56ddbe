"""Stances of adaptive touching: closed forms for a rectangle."""

from __future__ import annotations

import numpy as np
import pytest

from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.motion import FREE_M_S, FeltSpace
from glotouch_bt.perception.touch import TouchSequence, TouchSet
from glotouch_bt.robot import Pose
from glotouch_skills.common.hand import inner_edges
from glotouch_skills.common.hand.descent import ABOVE_RATIO, BESIDE_M_S, FOOT_M, OVER_TOP_M
from glotouch_skills.common.planning import ClosureParams, beside, options
from glotouch_skills.common.planning.squeeze_plan import stance

GRIPPER = RIZON4_XENSE.gripper


@pytest.mark.parametrize(("length_m", "shifts_mm"), [(0.07, {-16, -8, 0, 8, 16}), (0.06, {-8, 0, 8}), (0.03, {0})])
def test_stances_beside_one_stay_over_the_middle_half(found, length_m: float, shifts_mm: set[int]) -> None:
    """A stance 16 mm aside lies within the middle half of 70 mm, not of 60 mm; one 8 mm aside not of 30 mm."""
    box = found.box((0.03, -0.05), (length_m, 0.025))
    at = stance(box, 0.0, 0.0, 0.01, GRIPPER)
    near = beside(TouchSet(box, ()), at, GRIPPER, 0.005)
    straight = {round(1e3 * float(s.position_K_m[0] - 0.03)) for s in near if s.yaw_K_rad == 0.0}
    assert straight == shifts_mm - {0}
    turns_deg = {round(np.rad2deg(s.yaw_K_rad)) for s in near if abs(s.position_K_m[0] - 0.03) < 1e-6}
    assert turns_deg == {5, -5, 10, -10}
    assert all(s.opening_m == pytest.approx(s.span_m + 0.01) for s in near)


def test_a_stance_that_was_used_is_not_offered_again(found) -> None:
    box = found.box((0.03, -0.05), (0.06, 0.025))
    at = stance(box, 0.0, 0.0, 0.01, GRIPPER)
    taken = beside(TouchSet(box, ()), at, GRIPPER, 0.005)[0]
    used = TouchSet(box, (TouchSequence(taken.position_K_m, taken.yaw_K_rad, ()),))
    left = beside(used, at, GRIPPER, 0.005)
    assert 0 < len(left) < len(beside(TouchSet(box, ()), at, GRIPPER, 0.005))
    assert not any(s.yaw_K_rad == taken.yaw_K_rad and np.allclose(s.position_K_m, taken.position_K_m) for s in left)


def test_a_stance_where_the_fingers_find_felt_space_takes_less_time(found) -> None:
    """By the difference of the speeds of `descend`, over the way down beside the object."""
    disc, p, felt = found.round((0.0, 0.0), 0.025, 0.06), ClosureParams(), FeltSpace()
    touchsets, hand_K_m = [TouchSet(disc, ())], np.array([0.0, 0.0, p.headroom_m + GRIPPER.fingertip_below_P_m])
    before = options(touchsets, None, hand_K_m, felt, GRIPPER, p)
    at = before[0].at
    pose_K_P = Pose.pointing_down(np.array([*at.position_K_m, 0.0]), at.yaw_K_rad)
    felt.add(np.column_stack([inner_edges(GRIPPER, pose_K_P, at.opening_m), np.full(10, 0.018)]))
    after = options(touchsets, None, hand_K_m, felt, GRIPPER, p)
    beside_m, above_m = 0.06 + OVER_TOP_M - FOOT_M, p.headroom_m - 0.06 - OVER_TOP_M
    slow, fast = p.descent_speed_m_s, FREE_M_S
    saved_s = above_m * (1 / (ABOVE_RATIO * slow) - 1 / fast) + beside_m * (1 / slow - 1 / BESIDE_M_S)
    assert before[0].seconds - after[0].seconds == pytest.approx(saved_s, abs=1e-6)
    assert [o.seconds for o in after[1:]] == [o.seconds for o in before[1:]]
