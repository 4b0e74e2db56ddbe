"""lift on the fake robot."""

from __future__ import annotations

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_skills.take.lift import Lift


@pytest.fixture
def make(bench):
    def make_one(weight_N=2.5, grip_width_m=0.04, **params):
        start = {}

        def weight(position, aperture):
            return weight_N if start and position[2] > start["z"] + 0.005 else 0.0

        b = bench(weight_N=weight, grip_width_m=grip_width_m)
        b.go(b.arm.shift((0.0, 0.0, -0.2), 0.25))
        b.go(b.arm.jaws(0.0, speed_m_s=0.2))
        start["z"] = float(b.arm.pose_B_P.position_m[2])
        return b, b.make(Lift, inputs={"grip_m": 0.04}, **params)

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


@pytest.mark.parametrize(("weight_N", "width_m"), [(0.1, 0.04), (2.5, None)], ids=["no weight", "closed jaws"])
def test_lift__lost(make, weight_N: float, width_m: float | None) -> None:
    b, skill = make(weight_N, width_m)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "lost")
    assert set(skill.reason.evidence) == {"weight_N", "aperture_m"}


def test_broken_off_anywhere(make, preempt_all_along) -> None:
    def still_gripping(b) -> None:
        assert b.arm.aperture_m == pytest.approx(0.04)
        assert np.isclose(b.context.observation.gripper.force_N, 10.0)

    preempt_all_along(lambda: make(height_m=0.10), 10, after=still_gripping)
