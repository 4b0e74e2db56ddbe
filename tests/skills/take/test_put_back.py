"""put_back on the fake robot: down to where it was taken, let go, up again."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_bt.robot import Pose
from glotouch_skills.common.planning.grasp_plan import GraspPlan
from glotouch_skills.take.put_back import PutBack

TAKEN = GraspPlan(0, np.array([0.01, 0.04, 0.03]), 0.3, 0.05, 0.07)
OVER_B_M = np.array([0.61, 0.04, -0.17])
SHORT_B_M = np.array([0.0, 0.0, 0.0015])


@pytest.fixture
def make(bench):
    """Jaws on something 50 mm wide, 0.15 m above where it was taken."""

    def make_one(made=TAKEN, jaws_m=0.05, aside_m=0.0, **kw):
        b = bench(grip_width_m=jaws_m, tip_P_m=0.022, **kw)
        high = Pose.pointing_down(OVER_B_M + np.array([aside_m, 0.0, 0.15]), b.arm.pose_B_P.yaw_rad)
        b.go(b.arm.line(high, 0.2, check=False))
        b.go(b.arm.jaws(0.0, speed_m_s=0.2))
        b.opened = []
        cycle = b.robot.cycle

        def watch(command):
            if command.gripper is not None and command.gripper.aperture_m > 0.05:
                b.opened.append(b.arm.pose_B_P.position_m.copy())
            return cycle(command)

        b.robot.cycle = watch
        return b, b.make(PutBack, inputs={} if made is None else {"made": made})

    return make_one


@pytest.mark.parametrize("aside_m", [0.0, 0.04])
def test_it_is_let_go_of_where_it_was_taken(make, aside_m: float) -> None:
    b, skill = make(aside_m=aside_m)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    np.testing.assert_allclose(b.opened, np.tile(OVER_B_M + SHORT_B_M, (len(b.opened), 1)), atol=1e-4)
    assert b.arm.aperture_m == pytest.approx(0.07, abs=1e-3)
    assert float(b.arm.pose_B_P.position_m[2]) > -0.2 + 0.14


def test_it_may_stand_a_little_higher(make, things) -> None:
    b, skill = make(things=[things.floor(0.016)])  # fingertips are 22 mm below the pads: met 8 mm above its place
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert 0.004 < min(b.opened, key=lambda p: p[2])[2] - OVER_B_M[2] < 0.014


def test_put_back__in_the_way__the_object_is_kept(make, things) -> None:
    b, skill = make(things=[things.floor(0.05)])
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "in_the_way")
    assert not b.opened
    assert float(b.arm.pose_B_P.position_m[2]) > -0.2 + 0.14


@pytest.mark.parametrize(("made", "jaws_m"), [(TAKEN, None), (None, 0.05)], ids=["empty jaws", "nothing was taken"])
def test_nothing_to_put_back(make, made, jaws_m) -> None:
    b, skill = make(made, jaws_m)
    z = float(b.arm.pose_B_P.position_m[2])
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert float(b.arm.pose_B_P.position_m[2]) == pytest.approx(z)
    assert b.arm.aperture_m > 0.015


@pytest.mark.parametrize("apart_m", [0.03, 0.056, 0.065])
def test_jaws_that_let_go_before_hold_nothing(make, things, apart_m: float) -> None:
    """The grasp is still on the blackboard. Going down to its place would meet what stands there now."""
    b, skill = make(dataclasses.replace(TAKEN, closed_m=0.05), None, things=[things.floor(0.05)])
    b.go(b.arm.jaws(apart_m, speed_m_s=0.2))
    z = float(b.arm.pose_B_P.position_m[2])
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert float(b.arm.pose_B_P.position_m[2]) == pytest.approx(z)


def test_what_turned_between_the_jaws_is_put_back_too(make) -> None:
    """The jaws closed farther than when it was taken, and press."""
    b, skill = make(dataclasses.replace(TAKEN, closed_m=0.05), 0.04)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    np.testing.assert_allclose(b.opened, np.tile(OVER_B_M + SHORT_B_M, (len(b.opened), 1)), atol=1e-4)
    assert b.opened


def test_broken_off_anywhere(make, preempt_all_along) -> None:
    preempt_all_along(make, 5)


def test_jaws_that_are_still_closing_hold_nothing(make, things) -> None:
    """What was in them fell as the hand rose: it does not go down to press closed fingertips on it."""
    b, skill = make(jaws_m=None, things=[things.floor(0.05)])
    b.go(b.arm.jaws(0.06, speed_m_s=0.2))
    b.opened.clear()
    cycle, left, heights = b.robot.cycle, iter(np.linspace(0.06, 0.0, 60)), list[float]()

    def closing(command):
        heights.append(float(b.arm.pose_B_P.position_m[2]))
        seen = cycle(command)
        return dataclasses.replace(seen, gripper=dataclasses.replace(seen.gripper, aperture_m=next(left, 0.0)))

    b.robot.cycle = closing
    z = float(b.arm.pose_B_P.position_m[2])
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert min(heights) == pytest.approx(z)
    assert b.arm.aperture_m < 0.03
