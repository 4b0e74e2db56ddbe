"""orbit_probe round an elastic cylinder: what it fits is what stands there."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_bt.perception.search import SearchMap, trace
from glotouch_bt.perception.touch import Contact, GuardParams, fit_contour
from glotouch_bt.skill.probing.guarded_probe import Prober
from glotouch_skills.explore.orbit_probe import OrbitProbe
from tests.support.outlines import rectangle

POST, RADIUS, TOP, BALL = (0.02, -0.03), 0.028, 0.055, 0.006
TOUCH = np.array([POST[0], POST[1] + RADIUS + BALL, 0.018])


def first_contact() -> Contact:
    up = np.array([0.0, 1.0, 0.0])
    return Contact(0.0, TOUCH, -up, up, TOUCH[:2] - [0, BALL], 1.0)


@pytest.fixture
def make(bench, things, tool):
    def make_one(stands=True, belief=None, more=(), **params):
        standing = [things.floor(), *[things.post(POST, RADIUS, TOP)] * stands, *more]
        b = bench(things=standing, grip_width_m=tool.aperture_m)
        b.go(b.arm.jaws(0.0, speed_m_s=0.2))
        b.arm.scene.hold_tool(True)
        off = TOUCH + np.array([0, 0.006, 0])
        b.go(b.arm.joints(b.arm.kinematics.ik(tool.pose_B_P(b.world, off), b.arm.q)))
        belief = belief or SearchMap.blank(np.array([0.138, 0.188]), expected=1)
        return b, b.make(
            OrbitProbe, inputs={"tool": tool, "contact": first_contact(), "previous_map": belief}, **params
        )

    return make_one


def test_the_outline_is_the_posts(make) -> None:
    b, skill = make(centre_sd_m=0.001)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    (candidate,) = skill.candidates
    assert candidate.contour.kind == "round"
    np.testing.assert_allclose(candidate.contour.centre_K_m, POST, atol=1e-3)
    assert candidate.contour.size_m[0] == pytest.approx(2 * RADIUS, abs=8e-4)
    assert (candidate.contour.family, candidate.contour.covariance.shape) == ("circle", (3, 3))
    assert candidate.height_m == 0.018, "the top is touched later: so far only the sensing height is known"
    assert 4 <= len(candidate.contacts) <= OrbitProbe.Params().max_contacts
    (event,) = b.of_kind("candidate")
    assert event["candidate"] is candidate
    assert event["displaced_m"] < 0.002
    assert (candidate.index, skill.found, skill.complete) == (0, 1, True)
    assert skill.map.inside_exclusion(np.array([POST]))[0]
    assert b.robot.peak_force_N < 6.0


def test_by_itself_it_is_as_coarse_as_it_is_said_to_be(make) -> None:
    b, skill = make()
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    (candidate,) = skill.candidates
    assert np.linalg.norm(candidate.contour.centre_K_m - POST) < 2 * OrbitProbe.Params().centre_sd_m


def test_what_is_touched_by_the_way_becomes_a_hint(make, monkeypatch: pytest.MonkeyPatch) -> None:
    """Contacts that a trace sets aside are where the search shall look first, after those it knew of before."""
    old, stray = first_contact(), first_contact()

    def with_a_stray(*args, **keywords):
        traced = yield from trace(*args, **keywords)
        return dataclasses.replace(traced, outliers=(stray,))

    monkeypatch.setattr("glotouch_bt.perception.search.exploring.trace", with_a_stray)
    b, skill = make(belief=SearchMap.blank(np.array([0.138, 0.188]), expected=2).with_hints((old,)))
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert [h is c for h, c in zip(skill.map.hints, (old, stray), strict=True)] == [True, True]


def test_orbit_probe__tool_lost(make) -> None:
    b, skill = make()
    b.go(b.arm.jaws(0.03, speed_m_s=0.2))
    begun = len(b.commands)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "tool_lost")
    assert not [c for c in b.commands[begun:] if c.motion is not None]


def test_orbit_probe__known_object(make) -> None:
    contour = fit_contour(
        np.array([[np.cos(a), np.sin(a)] for a in np.linspace(0, 6, 9)]) * (RADIUS + BALL) + POST, BALL
    )
    belief = SearchMap.blank(np.array([0.138, 0.188]), expected=2).with_exclusion(contour, 0.01)
    b, skill = make(belief=belief)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "known_object")
    assert (skill.candidates, skill.found, skill.complete) == ((), 0, False)
    assert not [c for c in b.commands if c.motion is not None and c.motion.dq.any()][200:], "it does not go round"


def test_orbit_probe__not_traced(make) -> None:
    """What was touched is gone: nothing is met on the way round, and the place is dropped from the search."""
    b, skill = make(stands=False)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "not_traced")
    assert skill.reason.evidence["contacts"] == 1
    assert skill.candidates == ()


def test_an_impossible_way_round_is_a_failure_not_a_crash(make) -> None:
    b, skill = make()
    wall = dataclasses.replace(b.world.container).interior_m[0]
    b.arm.scene.add_obstacle("block", rectangle((-0.05, 0.0), (0.05, wall)), height_m=0.06)
    b.run(skill)
    assert skill.status in (Status.SUCCESS, Status.FAILURE)
    if skill.status is Status.FAILURE:
        assert skill.reason.code in ("not_traced", "motion_refused")


def test_from_the_objects_other_side_the_ball_goes_back_over_it(make, tool) -> None:
    """As after a trace that was broken off: straight back would be through the object."""
    b, skill = make(centre_sd_m=0.001)
    b.go(Prober(b.context, tool, GuardParams()).hop(np.array([POST[0], POST[1] - RADIUS - 0.02, 0.0]), 0.13, 0.1))
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert b.robot.peak_force_N < 6.0
    np.testing.assert_allclose(skill.candidates[0].contour.centre_K_m, POST, atol=1e-3)


def test_broken_off_anywhere_it_holds_and_can_start_again(make, preempt_all_along) -> None:
    preempt_all_along(make, 5, finish=False)
