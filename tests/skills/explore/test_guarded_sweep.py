"""guarded_sweep and the guarded moves under it, against an elastic cylinder whose place is known exactly."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_bt.perception.search import SearchMap
from glotouch_bt.perception.touch import Contact, GuardParams
from glotouch_bt.skill.probing.guarded_probe import Prober
from glotouch_skills.explore.guarded_sweep import GuardedSweep
from tests.support.outlines import rectangle
from tests.support.swept_area import covered_fraction

POST, RADIUS, TOP = (0.03, -0.04), 0.03, 0.06
BALL = 0.006


@pytest.fixture
def make(bench, things, tool):
    def make_one(stands=True, start=(-0.05, 0.1, 0.018), inputs=None, **params):
        b = bench(things=[things.floor()] + [things.post(POST, RADIUS, TOP)] * stands, grip_width_m=tool.aperture_m)
        b.go(b.arm.jaws(0.0, speed_m_s=0.2))
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
    # It has retreated from it (the way it came: obliquely here).
    tip = skill.tool.tip_K_m(b.world, b.arm.pose_B_P)
    assert np.linalg.norm(tip[:2] - POST) > RADIUS + BALL + 0.002


def swept(upto_m: float, expected: int | None = 5) -> SearchMap:
    """The bench's box, gone over in rows 20 mm apart from below up to a y."""
    rows = np.arange(-0.188, upto_m, 0.02)
    x = np.tile([-0.138, 0.138, 0.138, -0.138], (len(rows) + 1) // 2)[: 2 * len(rows)]
    return SearchMap.blank(np.array([0.138, 0.188]), expected).with_path(np.column_stack([x, np.repeat(rows, 2)]))


@pytest.mark.parametrize("policy", ["expected_find", "nearest_frontier"])
def test_guarded_sweep__search_exhausted(make, policy: str) -> None:
    """What is left of the empty box is swept, and that ends; nothing was touched on the way."""
    belief = swept(0.12)
    b, skill = make(stands=False, start=(-0.05, 0.1, 0.018), inputs={"previous": belief}, policy=policy)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "search_exhausted")
    assert skill.exhausted is True
    assert not b.of_kind("contact")
    assert skill.reason.evidence["found"] == 0
    assert covered_fraction(skill.map, 0.02) > 0.95 > covered_fraction(belief, 0.02)


def test_guarded_sweep__search_exhausted__with_an_unknown_number(make) -> None:
    """It ends when hardly anything can be left, and the chance is a result of the run, though the skill fails."""
    belief = swept(0.12, expected=None)
    b, skill = make(stands=False, start=(-0.05, 0.1, 0.018), inputs={"previous": belief})
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "search_exhausted")
    assert 0.0 <= skill.chance_left < 0.05 < belief.chance_left
    (event,) = b.of_kind("result")
    assert event["key"] == "chance_left"
    assert event["text"] in skill.reason.message
    assert skill.exhausted is True


def test_an_unknown_number_begins_with_an_open_map(make) -> None:
    b, skill = make(expected_objects="unknown", left_below=0.2)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert (skill.map.expected, skill.map.left_below) == (None, 0.2)
    assert 0.2 < skill.chance_left < 1.0, "most of the box is unexplored"


def test_what_was_touched_by_the_way_is_looked_at_first(make) -> None:
    """A hint leads straight to the post, though nothing else is known."""
    side = np.array([0.0, 1.0, 0.0])
    tip = np.array([POST[0], POST[1] + RADIUS + BALL, 0.018])
    hint = Contact(0.0, tip, -side, side, tip[:2] - [0, BALL], 1.0)
    belief = SearchMap.blank(np.array([0.138, 0.188]), expected=1).with_hints((hint,))
    b, skill = make(inputs={"previous": belief})
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert skill.exhausted is False
    assert skill.map.hints == ()
    np.testing.assert_allclose(skill.contact.tip_K_m, tip, atol=8e-4)


def test_guarded_sweep__search_exhausted__a_lid_covers_the_container(make) -> None:
    """No move in is possible: each is refused with its reason, its place given up, and the search says so."""
    b, skill = make(start=(-0.05, 0.1, 0.14))
    b.arm.scene.add_obstacle("lid", rectangle((0, 0), (0.3, 0.4)), height_m=0.02, base_K_m=0.06)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "search_exhausted")
    assert any("refused" in e["text"] and "lid" in e["text"] for e in b.of_kind("note"))
    assert len(skill.map.path_K_m) == 0
    assert len(skill.map.dropped) > 0


def test_guarded_sweep__tool_lost(make, tool) -> None:
    """The jaws are not as far apart as with the tool between them: nothing moves."""
    b, skill = make(inputs={"tool": dataclasses.replace(tool, aperture_m=tool.aperture_m + 0.005)})
    begun = len(b.commands)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "tool_lost")
    assert skill.reason.evidence == {"aperture_m": pytest.approx(tool.aperture_m)}
    assert not [c for c in b.commands[begun:] if c.motion is not None]


def test_broken_off_anywhere(make, preempt_all_along) -> None:
    preempt_all_along(make, 5)
