"""The open fingers come down as fast as the space below them is known."""

from __future__ import annotations

import numpy as np
import pytest

from glotouch_bt.motion import FREE_M_S, hand_pose_B
from glotouch_skills.common.hand.descent import BESIDE_M_S, FOOT_M, OVER_TOP_M, descend, seconds_at

OPENING, TOP, SLOW, HEADROOM, LOW = 0.06, 0.05, 0.01, 0.13, 0.005


def fall(b, felt: bool) -> float:
    """Robot time of a descent from the headroom to just above the floor."""
    arm = b.arm
    tips = arm.description.gripper.fingertip_below_P_m
    high, low = (hand_pose_B(arm, b.world.container, np.array([0.0, 0.0, z + tips]), 0.0) for z in (HEADROOM, LOW))
    b.go(arm.jaws(OPENING))
    b.go(arm.line(high, 0.2))
    if felt:
        turn = np.linspace(0.0, 2.0 * np.pi, 200)
        ring = 0.5 * OPENING * np.column_stack([np.cos(turn), np.sin(turn)])
        arm.felt.add(np.column_stack([ring, np.full(len(ring), 0.018)]))
    begin = b.context.observation.now_s
    assert b.go(descend(b.context, low, OPENING, TOP, SLOW)) is True
    return b.context.observation.now_s - begin


def test_unknown_space_is_entered_slowly_and_felt_space_fast(bench) -> None:
    unknown = (HEADROOM - TOP - OVER_TOP_M) / (3 * SLOW) + (TOP + OVER_TOP_M - LOW) / SLOW
    known = (HEADROOM - TOP - OVER_TOP_M) / FREE_M_S + (TOP + OVER_TOP_M - FOOT_M) / BESIDE_M_S + (FOOT_M - LOW) / SLOW
    b = bench()
    assert fall(b, felt=False) == pytest.approx(unknown, abs=0.5)
    assert fall(b, felt=False) < 0.6 * unknown, "the hand came down there before"
    assert fall(bench(), felt=True) == pytest.approx(known, abs=0.5)


def test_the_time_of_a_way_at_several_speeds() -> None:
    """0.1 m at 0.1 m/s, then 0.05 m at 0.01 m/s."""
    speed_steps = ((0.0, 0.1), (0.1, 0.01))
    assert seconds_at(speed_steps, 0.15) == pytest.approx(6.0)
    assert seconds_at(speed_steps, 0.05) == pytest.approx(0.5)
