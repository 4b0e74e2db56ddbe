"""grasp on the fake robot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_skills.common.planning.grasp_plan import GraspPlan
from glotouch_skills.take.grasp import Grasp

PLAN = GraspPlan(0, np.array([0.01, 0.04, 0.03]), 0.3, 0.05, 0.07)


@pytest.fixture
def make(bench):
    def make_one(plan=PLAN, known=None, grip_width_m=0.05, stuff=(), **params):
        b = bench(grip_width_m=grip_width_m, things=stuff, tip_P_m=0.022)
        inputs = {"plan": plan} if known is None else {"plan": plan, "known": known}
        return b, b.make(Grasp, inputs=inputs, **params)

    return make_one


def test_the_jaws_close_at_the_place(make) -> None:
    b, skill = make()
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert skill.grip_m == pytest.approx(0.05, abs=1e-6)
    assert skill.made.closed_m == skill.grip_m
    assert (skill.graspable, skill.doubtful) == (True, ())
    np.testing.assert_allclose(b.arm.pose_B_P.position_m, [0.61, 0.04, -0.17], atol=1e-5)
    assert abs(np.sin(b.arm.pose_B_P.yaw_rad - 0.3)) < 1e-6
    targets = [c.gripper for c in b.commands if c.gripper is not None]
    assert {round(t.aperture_m, 6) for t in targets[1:]} == {0.0}
    assert round(targets[0].aperture_m, 6) == 0.07
    assert (targets[1].force_N, targets[-1].force_N) == (3.0, 20.0)


def test_grasp__no_grasp__jaws_close_on_nothing(make) -> None:
    b, skill = make(grip_width_m=None)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "no_grasp")
    assert "closed to 0.0 mm" in skill.reason.message
    assert (skill.graspable, skill.doubtful) == (False, (0,)), "it was moved: it is traced anew"
    assert b.arm.aperture_m == pytest.approx(0.07, abs=1e-4)
    assert float(b.arm.pose_B_P.position_m[2]) > -0.2 + 0.14


def test_grasp__no_grasp__fingers_touch_on_the_way_down(make, things) -> None:
    b, skill = make(stuff=[things.floor(0.05)])
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "no_grasp")
    assert "stood on something" in skill.reason.message
    assert float(b.arm.pose_B_P.position_m[2]) > -0.2 + 0.14
    assert b.robot.peak_force_N < 10.0


def test_the_next_best_is_tried_when_there_is_no_room(make, found) -> None:
    """A neighbour stands where the first grasp's finger would go: the alternative, turned, has room."""
    neighbour = found.round((0.01, 0.10), 0.027, index=1)
    crosswise = replace(PLAN, yaw_rad=np.pi / 2)
    first = replace(PLAN, yaw_rad=0.0, alternatives=(crosswise,))
    b, skill = make(first, known=(found.round((0.01, 0.04), 0.025), neighbour))
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert abs(np.cos(b.arm.pose_B_P.yaw_rad)) < 1e-6
    assert any("candidate 1" in n["text"] for n in b.of_kind("note"))
    assert not [o for o in b.arm.scene.obstacles if o.startswith("candidate")]


def test_grasp__no_space__beside_the_wall_nothing_moves(make) -> None:
    b, skill = make(replace(PLAN, position_K_m=np.array([0.0, 0.17, 0.03])))
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "no_space")
    assert "wall" in skill.reason.message
    assert (skill.cramped, skill.lacks_space) == ((0,), True)
    assert (skill.graspable, skill.doubtful) == (True, ()), "it was not moved: it need not be traced anew"
    assert not [c for c in b.commands if c.motion is not None]


def test_grasp__no_grasp__one_of_the_grasps_was_tried(make) -> None:
    """The hand fits at one grasp, where the jaws close on nothing: the object was moved, whatever the other lacks."""
    tight = replace(PLAN, position_K_m=np.array([0.0, 0.17, 0.03]))
    b, skill = make(replace(tight, alternatives=(PLAN,)), grip_width_m=None)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "no_grasp")
    assert (skill.cramped, skill.lacks_space) == ((), False)
    assert (skill.graspable, skill.doubtful) == (False, (0,))


def test_broken_off_anywhere(make, found, preempt_all_along) -> None:
    preempt_all_along(lambda: make(known=(found.round((0.01, -0.1), 0.02, index=1),)), 6)
