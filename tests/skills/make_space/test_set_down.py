"""set_down on the fake robot: it carries, lets go, and enters the object where it stands."""

from __future__ import annotations

import math

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_bt.perception.touch import TouchSet
from glotouch_bt.robot import Pose
from glotouch_skills.common.planning import FreePlace
from glotouch_skills.common.planning.grasp_plan import GraspPlan
from glotouch_skills.make_space.set_down import SetDown

TAKEN = GraspPlan(0, np.array([0.01, 0.04, 0.03]), 0.0, 0.05, 0.07)
HIGH_B_M = np.array([0.61, 0.04, -0.02])
SHIFT_M = np.array([-0.03, -0.10])


@pytest.fixture
def make(bench, found):
    """Jaws on a disc 50 mm wide, 0.15 m above where it was taken."""

    def make_one(jaws_m=0.05, shift_m=SHIFT_M, turn_deg=0.0, others=(), felt=(), **kw):
        b = bench(grip_width_m=jaws_m, tip_P_m=0.022, **kw)
        b.go(b.arm.line(Pose.pointing_down(HIGH_B_M, b.arm.pose_B_P.yaw_rad), 0.2, check=False))
        b.go(b.arm.jaws(0.0, speed_m_s=0.2))
        thing = found.round((0.01, 0.04), 0.025)
        place = FreePlace(0, thing.contour.centre_K_m, np.asarray(shift_m), math.radians(turn_deg), 0.02)
        b.opened = []
        cycle = b.robot.cycle

        def watch(command):
            if command.gripper is not None and command.gripper.aperture_m > 0.05:
                b.opened.append(b.arm.pose_B_P)
            return cycle(command)

        b.robot.cycle = watch
        given = {"made": TAKEN, "places": (place,), "known": (thing, *others), "felt_before": felt}
        return b, b.make(SetDown, inputs=given)

    return make_one


@pytest.mark.parametrize("turn_deg", [0.0, 45.0])
def test_it_is_let_go_of_at_its_place_and_stands_there_in_the_map(make, turn_deg: float) -> None:
    b, skill = make(turn_deg=turn_deg)
    yaw = b.arm.pose_B_P.yaw_rad
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    for pose in b.opened:
        np.testing.assert_allclose(pose.position_m, [0.58, -0.06, -0.17 + 0.0015], atol=2e-4)
        assert math.remainder(pose.yaw_rad - yaw - math.radians(turn_deg), 2 * math.pi) == pytest.approx(0, abs=1e-3)
    np.testing.assert_allclose(skill.candidates[0].contour.centre_K_m, [-0.02, -0.06], atol=5e-4)
    assert float(b.arm.pose_B_P.position_m[2]) > -0.2 + 0.14
    assert skill.cramped == ()
    assert b.of_kind("report")[0]["title"] == "Objects set down"
    assert len(skill.cleared) == 1


def test_its_touches_and_all_refusals_are_given_up_and_what_stood_near_is_doubted(make, found) -> None:
    near, far = found.round((0.01, 0.085), 0.018, index=1), found.round((0.10, 0.15), 0.018, index=2)
    felt = tuple(TouchSet(c, ()) for c in (found.round((0.01, 0.04), 0.025), near))
    b, skill = make(others=(near, far), felt=felt)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert [t.candidate.index for t in skill.touchsets] == [1]
    assert skill.refused == ()
    assert skill.doubtful == (1,)
    assert skill.candidates[1:] == (near, far)


def test_set_down__not_held__what_fell_is_doubted(make) -> None:
    b, skill = make(jaws_m=None)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "not_held")
    assert skill.doubtful == (0,)
    assert not b.opened


def test_set_down__no_place__it_is_kept(make, found) -> None:
    b, skill = make(others=(found.box((-0.02, -0.06), (0.08, 0.08), index=1),))
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "no_place")
    assert not b.opened
    np.testing.assert_allclose(skill.candidates[0].contour.centre_K_m, [0.01, 0.04], atol=1e-3)


def test_set_down__in_the_way__it_is_kept(make, things) -> None:
    b, skill = make(things=[things.floor(0.05)])
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "in_the_way")
    assert not b.opened
    assert float(b.arm.pose_B_P.position_m[2]) > -0.2 + 0.14


def test_it_may_stand_a_little_higher(make, things) -> None:
    b, skill = make(things=[things.floor(0.016)])
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert 0.004 < b.of_kind("set_down")[0]["above_m"] < 0.014


def test_broken_off_anywhere(make, preempt_all_along) -> None:
    preempt_all_along(make, 4, finish=False)
