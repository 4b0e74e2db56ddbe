"""nudge on the fake robot: it pushes, notices what blocks or is missing, and keeps the map."""

from __future__ import annotations

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_skills.make_space.nudge import Nudge

EDGE_X_M = -0.03


def friction(force_N: float, blocked_from_m: float = np.inf, lift_N: float = 0.0, left_from_m: float = np.inf):
    """A box that resists with its friction from its rear edge on, and with a stiff spring where it is blocked.

    It pushes the fingers up with `lift_N`, as one that is about to topple, and is felt no more from `left_from_m` on.
    """

    def force(ball, radius):
        out = np.zeros_like(ball)
        x = ball[:, 0] + 0.011  # the side of the closed fingers
        low = ball[:, 2] < 0.05
        felt = low & (x > EDGE_X_M) & (x < left_from_m)
        out[felt, 0], out[felt, 2] = -force_N, lift_N
        out[low & (x > blocked_from_m), 0] -= 3000.0 * (x - blocked_from_m)[low & (x > blocked_from_m)]
        return out

    return force


@pytest.fixture
def make(bench, found):
    def make_one(
        force_N=0.7,
        blocked_from_m=np.inf,
        lift_N=0.0,
        left_from_m=np.inf,
        cramped=(0,),
        others=(),
        foot=(),
        yaw_rad=0.0,
        at_m=0.0,
        top_m=0.05,
        grip_width_m=None,
        **params,
    ):
        b = bench(
            tip_P_m=0.115,
            grip_width_m=grip_width_m,
            things=[friction(force_N, blocked_from_m, lift_N, left_from_m), *foot],
        )
        thing = found.box((at_m, 0.0), (0.06, 0.04), yaw_rad, height_m=top_m)
        given = {"known": (thing, *others), "cramped_before": cramped}
        return b, b.make(Nudge, inputs=given, **{"distance_m": 0.03, "direction_deg": 0.0, "centre": False, **params})

    return make_one


def test_the_object_stands_where_the_fingers_stopped(make) -> None:
    b, skill = make()
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    (moved,) = skill.candidates
    np.testing.assert_allclose(moved.contour.centre_K_m, [0.03, 0.0], atol=1e-3)
    assert skill.cramped == ()
    assert b.of_kind("nudge")[0]["resistance_N"] == pytest.approx(0.7, abs=0.1)
    assert b.of_kind("report")[0]["title"] == "Pushes"
    assert float(b.arm.pose_B_P.position_m[2]) > -0.2 + 0.14


@pytest.mark.parametrize(("grip_width_m", "felt"), [(0.04, True), (None, False)])
def test_the_jaws_close_on_the_pushed_object_across_the_push(make, grip_width_m: float | None, felt: bool) -> None:
    b, skill = make(centre=True, grip_width_m=grip_width_m)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    (moved,) = skill.candidates
    np.testing.assert_allclose(moved.contour.centre_K_m, [0.03, 0.0], atol=1e-3)
    without, other = make()
    without.run(other)
    assert (moved.quality > other.candidates[0].quality) == felt
    assert any("did not feel" in n["text"] for n in b.of_kind("note")) != felt


def test_a_direction_may_be_counted_from_the_long_side(make) -> None:
    b, skill = make(yaw_rad=0.5 * np.pi, direction_deg=-90.0, from_long_side=True)
    b.run(skill)
    assert b.of_kind("nudge")[0]["direction_deg"] == pytest.approx(0.0)
    assert skill.candidates[0].contour.centre_K_m[0] > 0.01


def test_a_push_that_is_stopped_at_its_end_is_complete(make) -> None:
    b, skill = make(blocked_from_m=EDGE_X_M + 0.030 - 0.0023)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert b.of_kind("nudge")[0]["stopped"]
    assert skill.candidates[0].contour.centre_K_m[0] == pytest.approx(0.03, abs=1.5e-3)


def test_nudge__blocked__it_stops_softly_and_knows_where(make) -> None:
    b, skill = make(blocked_from_m=EDGE_X_M + 0.010)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "blocked")
    assert skill.candidates[0].contour.centre_K_m[0] == pytest.approx(0.012, abs=0.003)
    assert b.of_kind("nudge")[0]["peak_N"] < 20.0


def test_nudge__nothing_pushed__what_is_not_there_is_doubted(make) -> None:
    b, skill = make(force_N=0.0)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "nothing_pushed")
    assert (skill.doubtful, skill.cramped) == ((0,), ())
    np.testing.assert_allclose(skill.candidates[0].contour.centre_K_m, [0.0, 0.0])


@pytest.mark.parametrize(("lift_N", "code"), [(0.2, None), (0.5, "tipping")])
def test_nudge__tipping__it_ends_before_the_object_falls(make, lift_N: float, code: str | None) -> None:
    b, skill = make(lift_N=lift_N, top_m=0.06)
    b.run(skill)
    assert (skill.reason.code if skill.reason else None) == code
    moved_m = skill.candidates[0].contour.centre_K_m[0]
    assert moved_m == pytest.approx(0.03, abs=1e-3) if code is None else moved_m < 0.015


def test_an_object_that_is_too_flat_to_topple_is_pushed_on(make) -> None:
    b, skill = make(lift_N=0.5, top_m=0.045)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message


@pytest.mark.parametrize("off_m", [0.002, -0.006, 0.008])
def test_an_object_met_elsewhere_than_traced_is_doubted(make, found, off_m: float) -> None:
    b, skill = make(at_m=off_m)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert b.of_kind("nudge")[0]["early_m"] == pytest.approx(off_m, abs=1.5e-3)
    assert skill.doubtful == (() if abs(off_m) < 0.005 else (0,))


def test_nudge__left__what_rolled_away_is_doubted(make) -> None:
    b, skill = make(left_from_m=EDGE_X_M + 0.015)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "left")
    assert (skill.doubtful, skill.cramped) == ((0,), ())


def test_nudge__motion_refused__fingers_that_stand_on_a_foot_push_nothing(make) -> None:
    """A foot that presses with less than what ends the descent is felt at rest."""

    def foot(ball, radius):
        out = np.zeros_like(ball)
        out[ball[:, 2] < 0.03, 2] = 0.6
        return out

    b, skill = make(foot=[foot])
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "motion_refused")
    assert skill.doubtful == (0,)
    assert not b.of_kind("nudge")


def test_nudge__no_push__nothing_moves(make, found) -> None:
    for given in ({"cramped": ()}, {"others": (found.box((0.07, 0.0), (0.06, 0.04), index=1),)}):
        b, skill = make(**given)
        b.run(skill)
        assert (skill.status, skill.reason.code) == (Status.FAILURE, "no_push")


def test_broken_off_anywhere(make, preempt_all_along) -> None:
    preempt_all_along(make, 4, finish=False)
