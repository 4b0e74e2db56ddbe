"""The arm as the driver of exploration plans."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from glotouch_bt.perception.search import Move, MoveOutcome
from glotouch_bt.skill import SkillFailed
from glotouch_skills.common.probe.plan_driver import COLUMN_M_S, Explorer, ExploringSpeeds

POST, RADIUS, TOP, BALL = (0.03, -0.04), 0.03, 0.06, 0.006
START = np.array([0.03, 0.06, 0.018])


@pytest.fixture
def make(bench, things, tool):
    def make_one(start=START, tool=tool):
        b = bench(things=[things.floor(), things.post(POST, RADIUS, TOP)], grip_width_m=0.016)
        b.go(b.arm.jaws(0.0, speed_m_s=0.2))
        b.arm.scene.hold_tool(True)
        b.go(b.arm.joints(b.arm.kinematics.ik(tool.pose_B_P(b.world, start), b.arm.q)))
        journal: list[tuple[str, dict]] = []
        explorer = Explorer(b.context, tool, ExploringSpeeds(), lambda kind, **data: journal.append((kind, data)))
        return b, explorer, journal

    return make_one


def asking(*moves):
    """A plan of these moves; what it felt."""
    felt = []
    for move in moves:
        felt.append((yield move))  # noqa: PERF401 (a comprehension cannot yield)
    return felt


def go(b, explorer, *moves) -> list[MoveOutcome]:
    return b.go(explorer.run(asking(*moves)))


def test_a_sweep_stops_at_the_post_and_journals_it(make) -> None:
    b, explorer, journal = make()
    assert explorer.lowered
    (felt,) = go(b, explorer, Move("sweep", np.array([0.03, -0.04])))
    np.testing.assert_allclose(felt.contact.tip_K_m[:2], [0.03, -0.04 + RADIUS + BALL], atol=4e-4)
    assert felt.path_K_m.shape[1] == 2
    np.testing.assert_allclose(felt.path_K_m[0], START[:2], atol=1e-3)
    assert [kind for kind, _ in journal] == ["sweep", "contact"]
    np.testing.assert_allclose(explorer.tip_K_m, felt.tip_K_m)


def test_a_hop_crosses_above_and_lands(make) -> None:
    b, explorer, _ = make()
    (felt,) = go(b, explorer, Move("hop", np.array([0.03, -0.13])))
    assert felt.contact is None
    assert explorer.lowered
    np.testing.assert_allclose(felt.tip_K_m, [0.03, -0.13], atol=1e-4)
    assert len(felt.path_K_m) == 1, "only where it came down was it at sensing height"
    assert b.robot.peak_force_N < 1.0


def test_a_hop_onto_the_post_stands_off_its_top(make) -> None:
    b, explorer, _ = make()
    (felt,) = go(b, explorer, Move("hop", np.array(POST)))
    np.testing.assert_allclose(felt.contact.approach_K, [0, 0, -1], atol=1e-6)
    assert felt.contact.tip_K_m[2] == pytest.approx(TOP + BALL, abs=5e-4)
    assert not explorer.lowered
    assert len(felt.path_K_m) == 0


def test_what_is_refused_is_felt_as_that(make) -> None:
    """The plan is told why, nothing moves, and it goes on with its next move."""
    b, explorer, journal = make()
    out, back = go(b, explorer, Move("sweep", np.array([0.4, 0.06])), Move("sweep", np.array([0.0, 0.06])))
    assert out.refused
    assert out.contact is None
    assert out.path_K_m.shape == (0, 2)
    np.testing.assert_allclose(out.tip_K_m, START[:2], atol=1e-6)
    assert journal[0][0] == "note"
    assert out.refused in journal[0][1]["text"]
    np.testing.assert_allclose(back.tip_K_m, [0.0, 0.06], atol=1e-4)


@pytest.mark.parametrize(("off_mm", "lost"), [(3.9, False), (4.1, True), (-4.1, True)])
def test_plan_driver__tool_lost__aperture_changed(make, tool, off_mm: float, lost: bool) -> None:
    b, explorer, _ = make(tool=dataclasses.replace(tool, aperture_m=0.016 + 1e-3 * off_mm))
    move = Move("sweep", np.array([0.0, 0.06]))
    if not lost:
        assert go(b, explorer, move)[0].contact is None
        return
    with pytest.raises(SkillFailed, match="mm apart") as failed:
        go(b, explorer, move)
    assert failed.value.reason.code == "tool_lost"


def test_the_ball_comes_down_fast_only_where_it_has_felt_free_space(make) -> None:
    felt, new = np.array([-0.03, 0.06]), np.array([-0.03, 0.14])
    b, explorer, _ = make()
    go(b, explorer, Move("sweep", felt))
    stamps = []
    for goal in (new, felt, new):
        stamps.append(b.context.observation.now_s)
        go(b, explorer, Move("hop", goal))
    slow, fast, again = np.diff([*stamps, b.context.observation.now_s])
    height = ExploringSpeeds().headroom_m - ExploringSpeeds().height_m
    assert slow - fast == pytest.approx(height / ExploringSpeeds().lower_m_s - height / COLUMN_M_S, abs=0.3)
    assert again == pytest.approx(fast, abs=0.1), "it has been there by now"
