"""lift on the fake robot."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_bt.robot import TactileFrame
from glotouch_skills.common.planning import GraspPlan
from glotouch_skills.take.lift import Lift

PRESSED = np.pad(np.full((15, 10), 4e-4), ((10, 10), (5, 5)))
FLAT = np.zeros_like(PRESSED)


@pytest.fixture
def make(bench):
    def make_one(weight_N=2.5, grip_width_m=0.04, gel_m=PRESSED, jaws=None, inputs=None, **params):
        start = {}

        def weight(position, aperture):
            return weight_N if start and position[2] > start["z"] + 0.005 else 0.0

        b = bench(weight_N=weight, grip_width_m=grip_width_m)
        b.go(b.arm.shift((0.0, 0.0, -0.2), 0.25))
        b.go(b.arm.jaws(0.0, speed_m_s=0.2))
        start["z"] = float(b.arm.pose_B_P.position_m[2])
        cycle = b.robot.cycle

        def reported(command):
            seen = cycle(command)
            if seen.tactile is not None:
                seen = dataclasses.replace(seen, tactile=TactileFrame(seen.tactile.stamp_s, gel_m, gel_m))
            return dataclasses.replace(seen, gripper=dataclasses.replace(seen.gripper, **(jaws or {})))

        b.robot.cycle = reported
        return b, b.make(Lift, inputs={"grip_m": 0.04} | (inputs or {}), **params)

    return make_one


def test_the_weight_is_what_hangs_in_the_hand(make) -> None:
    b, skill = make(height_m=0.12)
    z = float(b.arm.pose_B_P.position_m[2])
    begun = len(b.commands)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert skill.weight_N == pytest.approx(2.5, abs=1e-9)
    assert float(b.arm.pose_B_P.position_m[2]) == pytest.approx(z + 0.12, abs=1e-6)
    assert all(c.gripper is None for c in b.commands[begun:]), "the jaws are left alone"


@pytest.mark.parametrize(
    "against",
    [
        {"weight_N": 0.1},
        {"grip_width_m": None},
        {"gel_m": FLAT},
        {"jaws": {"aperture_m": 0.08}},
        {"jaws": {"force_N": 0.0}},
    ],
    ids=["no weight", "closed jaws", "untouched gels", "opened jaws", "jaws without force"],
)
def test_lift__lost_if_any_witness_says_so(make, against) -> None:
    b, skill = make(**against)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "lost")
    assert set(skill.reason.evidence) == {"weight_N", "aperture_m", "moved_m", "jaw_N", "gels_touched"}


def test_an_object_that_holds_the_hand_back_is_let_go(make) -> None:
    made = GraspPlan(3, np.zeros(3), 0.0, 0.04, 0.06)
    b, skill = make(weight_N=14.0, inputs={"made": made, "doubtful_before": (1,)})
    z, cycle, before_it_opened = float(b.arm.pose_B_P.position_m[2]), b.robot.cycle, []

    def watched(command):
        seen = cycle(command)
        if seen.gripper.aperture_m < 0.0405:
            before_it_opened.append(float(seen.position_B_P[-1][2]))
        return seen

    b.robot.cycle = watched
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "stuck")
    assert skill.reason.evidence == {"force_N": pytest.approx(14.0, rel=0.01), "limit_N": 12.0}
    assert max(before_it_opened) < z + 0.008, "it stops at once: the weight begins at 5 mm"
    assert before_it_opened[-1] == pytest.approx(z, abs=1e-3), "it lets go where the object was taken"
    assert (skill.graspable, skill.doubtful) == (False, (1, 3)), "it is traced anew"
    assert b.arm.aperture_m == pytest.approx(0.06, abs=1e-3)
    assert float(b.arm.pose_B_P.position_m[2]) > z + 0.05


def test_a_heavy_object_needs_a_higher_limit(make) -> None:
    b, skill = make(weight_N=14.0, max_N=20.0)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message


def test_an_object_that_turned_between_the_jaws_is_held(make) -> None:
    """The jaws closed from 40 to 26 mm on the way up; both gels, the force and the weight still show it."""
    b, skill = make(jaws={"aperture_m": 0.026})
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert skill.held_m == pytest.approx(0.026)


def test_broken_off_anywhere(make, preempt_all_along) -> None:
    def still_gripping(b) -> None:
        assert b.arm.aperture_m == pytest.approx(0.04)
        assert np.isclose(b.context.observation.gripper.force_N, 10.0)

    preempt_all_along(lambda: make(height_m=0.10), 6, after=still_gripping)
