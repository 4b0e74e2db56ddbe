"""The guarded moves that skills share: rest, both rules, inertia, and what a contact says of the push."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from glotouch_bt.perception.touch import GuardParams
from glotouch_bt.robot import MotionRefused
from glotouch_bt.skill import SkillFailed
from glotouch_bt.skill.probing.guarded_probe import MAX_REST_S, REST_S, SAME_REST_S, Prober

START = np.array([-0.05, 0.1, 0.06])


@pytest.fixture
def make(bench, things, tool):
    def make_one(thing=None, **keywords):
        b = bench(things=[thing or things.floor()], **keywords)
        b.arm.scene.hold_tool(True)
        b.go(b.arm.joints(b.arm.kinematics.ik(tool.pose_B_P(b.world, START), b.arm.q)))
        return b, Prober(b.context, tool, GuardParams())

    return make_one


def plate(force_N, height_m):
    """A force straight up as soon as the ball's centre is below a height, however deep."""

    def force(ball, radius):
        out = np.zeros_like(ball)
        out[:, 2] = np.where(ball[:, 2] < height_m, force_N, 0.0)
        return out

    return force


@pytest.mark.parametrize("way", [[0, 0, 0.04], [0, 0, -0.04], [0.06, 0, 0], [0, -0.06, 0.0], [0.03, 0, 0.03]])
@pytest.mark.parametrize("any_direction", [False, True])
def test_starts_and_stops_are_no_contact(make, way, any_direction) -> None:
    b, prober = make()
    probed = b.go(prober.move(START + way, 0.05, any_direction=any_direction))
    assert probed.contact is None
    np.testing.assert_allclose(probed.path_K_m[-1], START + way, atol=1e-5)


def test_a_gentle_touch_from_above_is_found(make) -> None:
    """0.25 N: less than the hand's inertia along the probe, 0.47 N."""
    b, prober = make(plate(0.25, 0.04))
    probed = b.go(prober.move(START - [0, 0, 0.04], 0.03))
    assert probed.contact is not None
    assert probed.contact.tip_K_m[2] == pytest.approx(0.04, abs=6e-4)
    assert not probed.contact.pushed_K_m.any()


def test_guarded_probe__hard_contact(make) -> None:
    b, prober = make(plate(24.0, 0.04))
    with pytest.raises(SkillFailed) as failed:
        b.go(prober.move(START - [0, 0, 0.04], 0.03))
    reason = failed.value.reason
    assert reason.code == "hard_contact"
    assert reason.evidence["quantity"] == "residual_force_N"
    assert reason.evidence["value"] == pytest.approx(24.0, abs=0.5)
    b.go(b.arm.hold(0.05))
    assert np.abs(b.context.observation.dq).max() < 1e-6


def test_a_rest_lasts_until_the_wrench_is_steady_and_no_longer_than_allowed(make) -> None:
    b, prober = make()
    still = b.context.observation.now_s
    b.go(prober.rest())
    assert b.context.observation.now_s - still == pytest.approx(REST_S, abs=0.021)
    # Nothing happened since: the same rest stands, and costs nothing.
    before, first = b.context.observation.now_s, b.go(b.arm.hold(0.0))
    assert first == []
    again = prober.rest()
    with pytest.raises(StopIteration):
        next(again)
    assert b.context.observation.now_s == before
    # A force that swings is waited for; one that goes on swinging is not waited for without end.
    for ends_s, max_delay_s in ((before + 0.3, 0.3 + REST_S + 0.05), (np.inf, MAX_REST_S)):
        b, prober = make(swinging(ends_s))
        b.go(b.arm.hold(max(before - b.context.observation.now_s, 0.01)))
        begin = b.context.observation.now_s
        b.go(prober.rest())
        assert b.context.observation.now_s - begin <= max_delay_s + 1e-9
        assert b.context.observation.now_s - begin > REST_S + 0.05


@pytest.mark.parametrize(("stays_N", "rest_s"), [(0.0, SAME_REST_S), (0.02, SAME_REST_S), (0.2, REST_S)])
def test_a_rest_is_short_where_the_wrench_is_that_of_the_last_one(make, stays_N, rest_s) -> None:
    """The second rest sees a force that has come to stay: as large as a contact, it needs a whole rest of its own."""
    force_N = [0.0]
    b, prober = make(lambda ball, radius: np.tile([force_N[0], 0.0, 0.0], (len(ball), 1)))
    first = b.go(prober.rest())
    force_N[0] = stays_N
    b.go(b.arm.hold(0.2))
    begin = b.context.observation.now_s
    again = b.go(prober.rest())
    assert b.context.observation.now_s - begin == pytest.approx(rest_s, abs=0.011)
    assert (again is first) == (rest_s == SAME_REST_S)


def swinging(ends_s):
    """2 N up and down at 4 Hz, by the count of calls (one a period)."""
    calls = [0]

    def force(ball, radius):
        calls[0] += 1
        t = calls[0] * 0.01
        return np.tile([0.0, 0.0, 2.0 * np.sin(25.0 * t) * (t < ends_s)], (len(ball), 1))

    return force


def test_the_latency_is_the_tools(make, tool) -> None:
    b, _ = make()
    late = dataclasses.replace(tool, latency_s=0.008)
    assert Prober(b.context, late, GuardParams())._guard.latency_s == 0.008


@pytest.mark.parametrize("bearing", [0.0, 1.0, 2.5])
def test_a_bent_probe_is_no_push(make, tool, bearing) -> None:
    """A spring of 2 mm/N that stands still is the same to the hand as a rigid wall and a probe that gives as much."""
    yields_m_N, there = 2e-3, START[:2] + 0.03 * np.array([np.cos(bearing), np.sin(bearing)])
    u = np.array([np.cos(bearing), np.sin(bearing), 0.0])

    def spring(ball, radius):
        return -np.outer(np.maximum((ball[:, :2] - there) @ u[:2], 0.0) / yields_m_N, u)

    pushed = {}
    for measured in (None, np.full(2, yields_m_N)):
        b, _ = make(spring)
        known = dataclasses.replace(tool, compliance_P_m_N=measured, latency_s=0.0)  # the fake wrist reports at once
        contact = b.go(Prober(b.context, known, GuardParams()).move(START + 0.06 * u, 0.03)).contact
        pushed[measured is None] = np.linalg.norm(contact.pushed_K_m)
    assert pushed[False] < 1e-4 < 5e-4 < pushed[True]


def test_a_press_ends_at_its_force(make, things) -> None:
    b, prober = make(things.post((0.03, 0.1), 0.03, 0.2))
    b.go(prober.move(START + np.array([0.08, 0, 0]), 0.02))
    before = b.go(prober.stand(0.1))
    b.go(prober.press(np.array([1.0, 0.0, 0.0]), 0.004, 0.005, 3.0 - before.force_K_N[0]))
    after = b.go(prober.stand(0.1))
    assert 3.0 <= before.force_K_N[0] - after.force_K_N[0] < 5.0
    assert b.robot.peak_force_N < 12.0


def test_guarded_probe__hard_contact_in_a_press(make) -> None:
    """A force that grows out of bounds in a direction other than the press's."""
    b, prober = make(lambda ball, radius: np.outer(np.where(ball[:, 0] > -0.03, 1.0, 0.0), [-0.5, 0.0, 0.0])
                     + np.outer(np.where(ball[:, 0] > -0.027, 1.0, 0.0), [0.0, 0.0, 24.0]))  # fmt: skip
    probed = b.go(prober.move(START + np.array([0.04, 0, 0]), 0.01))
    assert probed.contact is not None
    with pytest.raises(SkillFailed) as failed:
        b.go(prober.press(np.array([1.0, 0.0, 0.0]), 0.004, 0.005, 3.0))
    assert failed.value.reason.code == "hard_contact"


def test_nothing_is_pressed_before_a_contact(make) -> None:
    b, prober = make()
    with pytest.raises(MotionRefused):
        b.go(prober.press(np.array([1.0, 0.0, 0.0]), 0.004, 0.005, 3.0))
    with pytest.raises(MotionRefused):
        b.go(prober.stand(0.1))


def test_a_post_that_does_not_yield_is_pushed_at_most_by_the_overrun(make, things, tool) -> None:
    b, prober = make(things.post((0.03, 0.1), 0.03, 0.2))
    probed = b.go(prober.move(START + np.array([0.08, 0, 0]), 0.04))
    contact = probed.contact
    way = probed.path_K_m[-1, :2] - contact.tip_K_m[:2]
    assert 0 < np.linalg.norm(contact.pushed_K_m) < np.linalg.norm(way) < 2e-3
    assert contact.pushed_K_m @ contact.reaction_K[:2] < 0
