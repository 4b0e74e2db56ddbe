"""touch_top: the plan over surfaces of known height, and the skill on an elastic post with something higher on it."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from py_trees.common import Status
from scipy.spatial import ConvexHull

from glotouch_bt.perception.search.top import BallMove, BallOutcome, Top, TopRule, rounds, top_plan
from glotouch_bt.robot import MotionRefused
from glotouch_skills.explore.touch_top import TouchTop

BALL, CEILING, LOWEST = 0.006, 0.136, 0.024
FINEST_M = 2e-5
"""A graze that is less deep may fall between two of the 400 places at which `play` looks for a touch."""
Height = Callable[[np.ndarray], np.ndarray]  # (n, 2) -> (n,) ball's centre when it touches the object from above there


def box(x: float, y: float, half_x: float, half_y: float, top: float) -> Height:
    """Closed form: a ball over an upright box touches its top, or beside it its edge."""

    def height(p: np.ndarray) -> np.ndarray:
        out = np.hypot(np.maximum(np.abs(p[:, 0] - x) - half_x, 0), np.maximum(np.abs(p[:, 1] - y) - half_y, 0))
        return np.where(out < BALL, top + np.sqrt(np.maximum(BALL**2 - out**2, 0.0)), -1.0)

    return height


def together(*parts: Height) -> Height:
    return lambda p: np.max([part(p) for part in parts], axis=0)


def play(plan, height: Height) -> tuple[Top, list[BallMove]]:
    """Drive a plan over a surface; a move that would go through it unguarded fails the test."""
    tip, moves = np.array([0.0, 0.0, CEILING]), []
    move = next(plan)
    while True:
        moves.append(move)
        goal, touch = np.array(move.goal_K_m), None
        path = tip + np.linspace(0, 1, 400)[1:, None] * (goal - tip)
        low = height(path[:, :2]) - path[:, 2]
        if move.kind in ("down", "pass", "feel"):
            if (low > 1e-9).any():
                at = int(np.argmax(low > 1e-9))
                touch = path[at - 1].copy() if at else tip.copy()  # the last place that is free
                if move.kind == "down":
                    touch[2] = height(goal[None, :2])[0]
        else:
            end = np.array([*goal[:2], max(goal[2], tip[2])]) if move.kind == "over" else goal
            assert height(end[None, :2])[0] <= end[2] + 1e-4
            if move.kind == "back":
                assert low.max() <= 1e-4, "back into the object"
        tip = goal if touch is None else touch
        try:
            move = plan.send(BallOutcome(tip, touch))
        except StopIteration as stop:
            return stop.value, moves


def outline(half_x: float, half_y: float) -> np.ndarray:
    u = np.linspace(-1, 1, 6)
    one = np.ones(6)
    return np.concatenate(
        [np.column_stack(v) for v in ((u, one), (u, -one), (one, u), (-one, u))]
    ) * [half_x, half_y]  # fmt: skip


def plan_over(points: np.ndarray, rule: TopRule | None = None, centre: tuple[float, float] = (0.0, 0.0)):
    rule = rule or TopRule()
    return top_plan(np.array(centre), rounds(points, np.array(centre), rule), 0.9 * points[::6], LOWEST, CEILING, rule)


def test_a_flat_top_is_touched_once_and_passed_over() -> None:
    top, moves = play(plan_over(outline(0.03, 0.02)), box(0, 0, 0.03, 0.02, 0.05))
    assert top.ball_K_m[2] == pytest.approx(0.05 + BALL, abs=1e-9)
    assert (top.touches, top.passed) == (1, 1.0)
    assert all(m.goal_K_m[2] > 0.05 + BALL for m in moves if m.kind == "pass")


@settings(max_examples=40, deadline=None)
@given(
    st.floats(-0.040, 0.040), st.floats(-0.014, 0.014), st.floats(0.003, 0.02), st.floats(0.003, 0.008),
    st.floats(0.004, 0.05),
)  # fmt: skip
def test_a_chimney_on_a_deck_is_found_if_any_pass_can_meet_it(
    x: float, y: float, half_x: float, half_y: float, rise: float
) -> None:
    """Where the ball, just above the deck on its way, would go through it; then it is touched on its flat top."""
    points, chimney = outline(0.050, 0.022), box(x, y, half_x, half_y, 0.04 + rise)
    top, _ = play(plan_over(points), together(box(0, 0, 0.050, 0.022, 0.04), chimney))
    error = 0.04 + rise + BALL - top.ball_K_m[2]
    found = -1e-9 <= error <= TopRule().clearance_m + FINEST_M
    assert found or not _is_met(chimney, points, 0.04 + BALL + TopRule().clearance_m)


def _is_met(height: Height, points: np.ndarray, level_m: float) -> bool:
    """True if a ball at this level, on the way round and through, goes through something."""
    way = rounds(points, np.zeros(2), TopRule())
    return any((height(a + np.linspace(0, 1, 400)[:, None] * (b - a)) > level_m + 1e-4).any() for a, b in pairwise(way))


def test_few_chimneys_hide_between_the_passes() -> None:
    """As thin as the ball, they may: passes are up to `reach_m` from what is inside. 1000 drawn places."""
    points, rng = outline(0.050, 0.022), np.random.default_rng(0)
    places = rng.uniform((-0.040, -0.014), (0.040, 0.014), (1000, 2))
    hidden = [not _is_met(box(*p, 0.003, 0.003, 0.06), points, 0.04 + BALL + TopRule().clearance_m) for p in places]
    assert np.mean(hidden) < 0.15


@settings(max_examples=40, deadline=None)
@given(st.floats(0.0, 2 * np.pi), st.floats(0.1, 1.0))
def test_a_slope_is_climbed_to_its_edge(direction: float, slope: float) -> None:
    """A ramp within a square: its highest edge is reached to within the clearance and half of the ball's step."""
    n = np.array([np.cos(direction), np.sin(direction)])

    def ramp(p: np.ndarray) -> np.ndarray:
        return np.where(np.abs(p).max(axis=1) < 0.025, 0.05 + slope * (p @ n) + BALL * np.hypot(1, slope), -1.0)

    top, _ = play(plan_over(outline(0.025, 0.025)), ramp)
    highest = 0.05 + slope * 0.025 * np.abs(n).sum() + BALL * np.hypot(1, slope)
    assert 0 <= highest - top.ball_K_m[2] <= 0.015 * slope + TopRule().clearance_m


def test_what_is_hollow_is_touched_at_its_rim() -> None:
    def ring(p: np.ndarray) -> np.ndarray:
        off = np.maximum(np.abs(np.linalg.norm(p, axis=1) - 0.027) - 0.002, 0.0)
        return np.where(off < BALL, 0.06 + np.sqrt(np.maximum(BALL**2 - off**2, 0.0)), -1.0)

    a = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    top, _ = play(plan_over(0.029 * np.column_stack([np.cos(a), np.sin(a)])), ring)
    assert top.ball_K_m[2] == pytest.approx(0.06 + BALL, abs=TopRule().clearance_m)


def test_nothing_there() -> None:
    top, moves = play(plan_over(outline(0.03, 0.02)), lambda p: np.full(len(p), -1.0))
    assert top.ball_K_m is None
    assert {m.kind for m in moves} == {"over", "down"}


@settings(max_examples=40, deadline=None)
@given(st.integers(4, 40), st.integers(0, 10_000))
def test_the_passes_stay_inside_and_leave_nothing_out_of_reach(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    a = np.sort(rng.uniform(0, 2 * np.pi, n))
    points = rng.uniform(0.02, 0.05, (n, 1)) * np.column_stack([np.cos(a), np.sin(a)])
    rule = TopRule()
    middle = points.mean(axis=0)
    way = rounds(points, middle, rule)
    hull = ConvexHull(points)
    assert (hull.equations[:, :2] @ way.T + hull.equations[:, 2:] <= 1e-9).all()
    dense = np.concatenate([p + np.linspace(0, 1, 60)[:, None] * (q - p) for p, q in pairwise([middle, *way])])
    anywhere = rng.dirichlet(np.full(n, 0.3), 500) @ points  # within the outline's hull
    away = np.linalg.norm(anywhere[:, None] - dense, axis=2).min(axis=1)
    assert away.max() <= rule.reach_m + rule.inset_m + 0.005


# -- the skill ----------------------------------------------------------------------------------------------------


POST, RADIUS, TOP = (0.02, -0.03), 0.028, 0.055


@pytest.fixture
def make(bench, things, tool, found):
    def make_one(things_there, radius=RADIUS, **params):
        b = bench(things=[things.floor(), *things_there])
        b.arm.scene.hold_tool(True)
        above = np.array([POST[0], POST[1] + 0.05, 0.1])
        b.go(b.arm.joints(b.arm.kinematics.ik(tool.pose_B_P(b.world, above), b.arm.q)))
        return b, b.make(TouchTop, inputs={"tool": tool, "candidate": found.round(POST, radius, 0.02)}, **params)

    return make_one


def test_the_height_of_a_post(make, things) -> None:
    b, skill = make([things.post(POST, RADIUS, TOP)])
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert skill.measured.height_m == pytest.approx(TOP, abs=5e-4)
    assert skill.height_m == skill.measured.height_m
    assert skill.measured.top_touched
    assert skill.measured.contour is skill.candidate.contour
    (event,) = b.of_kind("candidate")
    assert event["candidate"] is skill.measured, "the record's last word on it has the height"
    assert b.robot.peak_force_N < 6.0


def test_an_object_lower_than_the_ball_s_centre_was(make, things) -> None:
    """The lower half of the ball met its edge, 20 mm above the floor in the middle."""
    b, skill = make([things.post(POST, RADIUS, 0.016)])
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert skill.measured.height_m == pytest.approx(0.016, abs=5e-4)


def test_a_chimney_beside_the_middle(make, things) -> None:
    chimney = (POST[0] + 0.014, POST[1] + 0.006)
    b, skill = make([things.post(POST, RADIUS, TOP), things.post(chimney, 0.008, TOP + 0.02)])
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert skill.measured.height_m == pytest.approx(TOP + 0.02, abs=1e-3)


def test_a_chimney_at_the_edge_of_a_narrow_post(make, things) -> None:
    """Passes 10 mm inside its outline would miss it."""
    chimney = (POST[0] + 0.0185, POST[1])
    b, skill = make([things.post(POST, 0.020, TOP), things.post(chimney, 0.002, TOP + 0.02)], radius=0.020)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert not skill.gone
    assert skill.measured.height_m == pytest.approx(TOP + 0.02, abs=1e-3)


def test_touch_top__no_top(make) -> None:
    """The object is gone: the reason says so, and the candidate is as high as its sides were touched."""
    b, skill = make([])
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "no_top")
    assert skill.gone
    assert skill.measured.height_m == pytest.approx(0.02)
    assert skill.measured.index == skill.candidate.index


def test_it_can_be_broken_off_anywhere(make, things, preempt_all_along) -> None:
    preempt_all_along(lambda: make([things.post(POST, RADIUS, TOP)]), 4, finish=False)


def test_a_refused_pass_is_left_out(make, things, monkeypatch) -> None:
    b, skill = make([things.post(POST, RADIUS, TOP)])
    shift = b.arm.shift

    def refuse_level(step, speed, **options):
        if abs(step[2]) < 1e-6 and np.linalg.norm(step[:2]) > 0.01:
            raise MotionRefused("pass", "a wall is in the way")
        return (yield from shift(step, speed, **options))

    monkeypatch.setattr(b.arm, "shift", refuse_level)
    b.run(skill)
    assert skill.status is Status.SUCCESS
    assert skill.measured.height_m == pytest.approx(TOP, abs=5e-4)
    assert [e for e in b.of_kind("note") if "left out" in e["text"]]
