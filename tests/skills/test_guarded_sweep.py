"""guarded_sweep and the guarded moves under it, against an elastic cylinder whose place is known exactly."""

from __future__ import annotations

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_bt.search import SearchMap
from glotouch_bt.touch import GuardParams
from skills.guarded_sweep import GuardedSweep
from skills.probing import Prober

POST, RADIUS, TOP = (0.03, -0.04), 0.03, 0.06
BALL = 0.006


@pytest.fixture
def make(bench, things, tool):
    def make_one(stands=True, start=(-0.05, 0.1, 0.018), inputs=None, **params):
        b = bench(things=[things.floor()] + [things.post(POST, RADIUS, TOP)] * stands)
        b.arm.scene.hold_tool(True)
        b.go(b.arm.joints(b.arm.kinematics.ik(tool.pose_B_P(b.world, np.array(start)), b.arm.q)))
        return b, b.make(GuardedSweep, inputs={"tool": tool, **(inputs or {})}, **params)

    return make_one


def test_a_guarded_move_ends_where_the_ball_meets_the_post(make, tool) -> None:
    b, _ = make(start=(0.03, 0.1, 0.018))
    probed = b.go(Prober(b.context, tool, GuardParams()).move(np.array([0.03, -0.04, 0.018]), 0.04))
    contact = probed.contact
    # On the axis, coming along -y: ball centre one radius and one ball before the middle.
    np.testing.assert_allclose(contact.tip_K_m, [0.03, -0.04 + RADIUS + BALL, 0.018], atol=4e-4)
    np.testing.assert_allclose(contact.point_K_m, [0.03, -0.04 + RADIUS], atol=4e-4)
    np.testing.assert_allclose(contact.approach_K, [0, -1, 0], atol=1e-6)
    np.testing.assert_allclose(contact.reaction_K, [0, 1, 0], atol=1e-3)
    assert b.robot.peak_force_N < 5.0


def test_a_guarded_move_through_nothing_runs_its_whole_way(make, tool) -> None:
    b, _ = make(stands=False)
    probed = b.go(Prober(b.context, tool, GuardParams()).move(np.array([0.05, 0.1, 0.018]), 0.04))
    assert probed.contact is None
    np.testing.assert_allclose(probed.path_K_m[-1], [0.05, 0.1, 0.018], atol=1e-5)
    np.testing.assert_allclose(probed.path_K_m[:, 1:], [[0.1, 0.018]] * len(probed.path_K_m), atol=1e-5)


def test_a_hop_goes_up_and_across(make, tool) -> None:
    b, _ = make()
    prober = Prober(b.context, tool, GuardParams())
    b.go(prober.hop(np.array([0.05, 0.02, 0.0]), 0.13, 0.1))
    np.testing.assert_allclose(prober.tip_K_m, [0.05, 0.02, 0.13], atol=1e-5)


def test_the_sweep_ends_at_the_post(make) -> None:
    b, skill = make()
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    away = np.linalg.norm(skill.contact.tip_K_m[:2] - POST)
    assert away == pytest.approx(RADIUS + BALL, abs=8e-4)
    assert len(skill.map.path_K_m) > 10
    (event,) = b.of_kind("contact")
    assert event["contact"] is skill.contact
    # It has retreated from it.
    tip = skill.tool.tip_K_m(b.world, b.arm.pose_B_P)
    assert np.linalg.norm(tip[:2] - POST) > RADIUS + BALL + 0.004


def test_search_exhausted(make) -> None:
    """Coarse coverage of the empty box ends; nothing was touched on the way."""
    b, skill = make(stands=False, coverage_radius_m=0.08)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "search_exhausted")
    assert b.robot.peak_force_N == 0.0
    assert isinstance(skill.map, SearchMap)


def test_motion_refused(make) -> None:
    b, skill = make(start=(-0.05, 0.1, 0.14))
    b.arm.scene.add_obstacle("lid", "box", centre_K_m=(0, 0), size_m=(0.3, 0.4), height_m=0.02, base_K_m=0.06)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "motion_refused")
    assert "lid" in skill.reason.message


def test_broken_off_anywhere(make, preempt_all_along) -> None:
    preempt_all_along(make, 10)
