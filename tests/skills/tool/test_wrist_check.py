"""wrist_check and tare on the fake robot: what the wrist reads in free air, and zeroing it."""

from __future__ import annotations

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_skills.common.hand.retract import CLEAR_M
from glotouch_skills.tool.tare import TareWrist
from glotouch_skills.tool.wrist_check import WristCheck


@pytest.fixture
def make(bench):
    """The hand hangs low in the container; `pull_N` is felt from now on (positive: down), as a tare gone stale."""

    def make_one(pull_N: float = 0.0):
        pull = {"N": 0.0}
        b = bench(weight_N=lambda position, aperture: pull["N"])
        b.go(b.arm.shift((0.0, 0.0, -0.22), 0.25))
        pull["N"] = pull_N
        return b

    return make_one


def fingertips_m(b) -> float:
    below = b.arm.description.gripper.fingertip_below_P_m
    return float(b.arm.pose_B_P.position_m[2] - b.world.container.pose_B_K.position_m[2]) - below


@pytest.mark.parametrize("pull_N", [0.0, 0.45, -0.45])
def test_within_bounds(make, pull_N: float) -> None:
    b = make(pull_N)
    assert fingertips_m(b) < 0.1
    skill = b.make(WristCheck)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert fingertips_m(b) == pytest.approx(CLEAR_M, abs=1e-3), "it was looked at in free air"


@pytest.mark.parametrize("pull_N", [0.55, -3.0, float("nan")])
def test_wrist_check__off_zero(make, pull_N: float) -> None:
    b = make(pull_N)
    skill = b.make(WristCheck)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "off_zero")
    measured, limit = skill.reason.evidence["force_N"], skill.reason.evidence["force_limit_N"]
    assert np.isnan(measured) or measured == pytest.approx(abs(pull_N), abs=1e-6)
    assert limit == 0.5


def test_wrist_check__off_zero__by_torque_alone(bench) -> None:
    b = bench()
    b.robot.wrench = lambda stamp, position, quat: np.tile([0.0, 0.0, 0.0, 0.0, 0.3, 0.0], (len(stamp), 1))
    skill = b.make(WristCheck)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "off_zero")
    assert skill.reason.evidence["torque_Nm"] == pytest.approx(0.3)


def test_a_tare_makes_it_read_nothing_again(make) -> None:
    b = make(4.0)
    tare, check = b.make(TareWrist), b.make(WristCheck)
    b.run(tare)
    assert tare.status is Status.SUCCESS, tare.feedback_message
    b.run(check)
    assert check.status is Status.SUCCESS, check.feedback_message


def test_wrist_check__request_failed(make, monkeypatch) -> None:
    b = make()

    class Broken:
        done, error = True, "no answer"

    monkeypatch.setattr(b.robot, "start", lambda request: Broken())
    skill = b.make(TareWrist)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "request_failed")


def test_high_already_nothing_moves(bench) -> None:
    b = bench()
    skill = b.make(WristCheck)
    b.run(skill)
    assert not [c for c in b.commands if c.motion is not None]


def test_broken_off_anywhere(make, preempt_all_along) -> None:
    preempt_all_along(lambda: ((b := make()), b.make(TareWrist)), 4)
    preempt_all_along(lambda: ((b := make()), b.make(WristCheck)), 4)
