"""The state of a mission at any time, compared with what went into its record."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from glotouch_bt import cli
from glotouch_bt.mission import load_mission
from glotouch_bt.mission.record.recorder import Recorder
from glotouch_bt.report import RecordReader, read_run
from glotouch_bt.report.state import RunModel, SceneState, planned_nodes
from glotouch_bt.report.state import model as model_file
from glotouch_bt.report.state.model import MAX_KEPT, GrowingRows
from tests.support.fake_cli import install_fakes
from tests.support.made_run import OBJECTS, TIP_M, WANTED, Made


def read(folder: Path) -> RunModel:
    model = RunModel()
    with RecordReader(folder) as reader:
        reader.read()
        model.feed(reader)
    return model


@pytest.fixture(scope="module")
def model(whole: Made) -> RunModel:
    return read(whole.folder)


def test_the_end_holds_everything_that_was_found(model: RunModel, whole: Made) -> None:
    state = model.state_at(model.span_s[1])
    assert state.phase == "ended"
    felt = np.array([[*c.point_K_m, c.tip_K_m[2]] for c in whole.contacts])
    np.testing.assert_allclose([t.point_K_m for t in state.touches], felt, atol=1e-9)
    np.testing.assert_allclose([t.outward_K for t in state.touches], [c.reaction_K for c in whole.contacts], atol=1e-9)
    assert [o.index for o in state.outlines] == [c.index for c in whole.candidates]
    for drawn, candidate in zip(state.outlines, whole.candidates, strict=True):
        assert drawn.height_m == pytest.approx(candidate.height_m)
        size = np.ptp((drawn.outline_K_m - candidate.contour.centre_K_m) @ _axes(candidate.contour.yaw_rad), axis=0)
        np.testing.assert_allclose(size, candidate.contour.size_m, atol=2e-4)  # a circle is drawn with 64 sides
    stable = sum(layer.stable for t in whole.touchsets for s in t.sequences for layer in s.layers)
    assert len(state.patches) == stable == 45
    assert state.log[-1].kind == "grasp"


def _axes(yaw: float) -> np.ndarray:
    return np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])


def test_a_time_holds_nothing_of_later(model: RunModel, whole: Made) -> None:
    events = [(e.stamp_s, e.kind) for e in read_run(whole.folder).events]
    for t_s in np.linspace(*model.span_s, 23):
        state = model.state_at(t_s)
        assert len(state.touches) == sum(kind == "contact" and s <= t_s + 1e-9 for s, kind in events)
        assert len(state.outlines) == sum(kind == "candidate" and s <= t_s + 1e-9 for s, kind in events)
        assert all(line.stamp_s <= t_s + 1e-9 for line in state.log)


def test_joints_jaws_and_force_are_the_newest(model: RunModel, whole: Made) -> None:
    t_s = 0.5 * sum(model.span_s)
    state = model.state_at(t_s)
    assert state.q is not None
    stamp = np.floor(t_s * 100) / 100  # the record has a row every 10 ms
    np.testing.assert_allclose(state.q, np.sin(0.1 * stamp) * np.arange(1, 8) * 0.1, atol=1e-3)
    assert model.state_at(model.span_s[1]).aperture_m == pytest.approx(0.046)
    contact = next(e for e in read_run(whole.folder).events if e.kind == "contact")
    rows = model.motion.rows if model.motion is not None else np.zeros((0, 2))
    near = rows[(rows[:, 0] > contact.stamp_s - 0.07) & (rows[:, 0] <= contact.stamp_s)]
    assert near[:, 1].max() == pytest.approx(2.0, abs=0.3)  # the bump's peak, in noise of 0.05 N a component


def test_the_probe_is_in_the_hand_between_two_events(model: RunModel, whole: Made) -> None:
    taken, returned = (e.stamp_s for e in read_run(whole.folder).events if e.kind == "tool")
    assert model.state_at(taken - 0.01).tip_m is None
    assert model.state_at(taken).tip_m == TIP_M
    assert model.state_at(returned - 0.01).tip_m == TIP_M
    assert model.state_at(returned).tip_m is None


def test_the_tree_is_that_of_the_time(model: RunModel) -> None:
    state = model.state_at(0.0)
    assert state.nodes == {"retrieve": "RUNNING", "retrieve/tool_pickup": "RUNNING"}
    end = model.state_at(model.span_s[1]).nodes
    assert list(end)[:3] == ["retrieve", "retrieve/tool_pickup", "retrieve/explore"]
    assert end["retrieve"] == "SUCCESS"
    assert "RUNNING" not in {s for n, s in end.items() if n != "retrieve/lift"}


def test_planned_nodes_are_there_before_they_run(whole: Made) -> None:
    planned = ["retrieve", "retrieve/tool_pickup", "retrieve/explore", "retrieve/never"]
    model = RunModel(planned)
    assert set(model.state_at(0.0).nodes.values()) == {""}
    with RecordReader(whole.folder) as reader:
        reader.read()
        model.feed(reader)
    assert model.state_at(0.0).nodes == dict(zip(planned, ("RUNNING", "RUNNING", "", ""), strict=True))
    end = model.state_at(model.span_s[1]).nodes
    assert end["retrieve/never"] == ""
    assert end["retrieve/match"] == "SUCCESS"  # a node that was not planned is shown as well


def test_the_plan_is_that_of_the_runs_mission(tmp_path: Path) -> None:
    assert planned_nodes(tmp_path) == []
    mission = load_mission("calibrate")
    (tmp_path / "mission.yaml").write_text(mission.resolved_yaml())
    assert planned_nodes(tmp_path) == [
        "calibrate/sequence", "calibrate/sequence/tool_pickup", "calibrate/sequence/tool_calibrate",
    ]  # fmt: skip
    (tmp_path / "mission.yaml").write_text("mission: [broken")
    assert planned_nodes(tmp_path) == []


def test_depth_maps_vanish_when_they_are_old(model: RunModel, whole: Made) -> None:
    squeezed = [e.stamp_s for e in read_run(whole.folder).events if e.kind == "touchset"]
    pads = model.state_at(squeezed[0]).pads
    assert pads is not None
    left = whole.touchsets[0].sequences[-1].layers[-1].left_m
    np.testing.assert_allclose(pads[0], np.round(left, 6), atol=6e-7)
    assert model.state_at(squeezed[-1] + 0.6).pads is None


def test_a_growing_record_gives_the_same_states(whole: Made, tmp_path: Path) -> None:
    """Reading a record in pieces, as a live view does, gives the same model as reading it whole."""
    data = (whole.folder / "run.mcap").read_bytes()
    copy = tmp_path / "run.mcap"
    copy.write_bytes(b"")
    live, after = RunModel(), read(whole.folder)
    rng = np.random.default_rng(0)
    cuts = np.sort(rng.integers(0, len(data), 40)).tolist()
    with RecordReader(tmp_path, growing=True) as reader, copy.open("r+b") as out:
        written = 0
        for end in [*cuts, len(data)]:
            out.write(data[written:end])
            out.flush()
            written = end
            reader.read()
            live.feed(reader)
            assert_same(live.state_at(live.span_s[1] - 0.6), after.state_at(live.span_s[1] - 0.6))
    assert live.ended
    assert live.span_s == after.span_s
    for t_s in np.linspace(*after.span_s, 17):
        assert_same(live.state_at(t_s), after.state_at(t_s))


def assert_same(a: SceneState, b: SceneState) -> None:
    assert (a.t_s, a.tip_m, a.aperture_m, a.force_N) == (b.t_s, b.tip_m, b.aperture_m, b.force_N)
    assert (a.log, a.states, a.shares) == (b.log, b.states, b.shares)
    assert a.nodes == {n: s for n, s in b.nodes.items() if n in a.nodes}
    assert (a.q is None) == (b.q is None)
    if a.q is not None and b.q is not None:
        np.testing.assert_array_equal(a.q, b.q)
    assert len(a.touches) == len(b.touches)
    assert [o.index for o in a.outlines] == [o.index for o in b.outlines]
    assert len(a.patches) == len(b.patches)


def test_phases_and_judgements_follow_their_events(tmp_path: Path) -> None:
    """Pause, exclusion, rejection, plan, lift and putting back, each at its time."""
    plan = {"candidate": 2, "position_K_m": [0.1, 0.0, 0.03], "yaw_rad": 0.3, "opening_m": 0.08, "aperture_m": 0.06}
    told: list[tuple[float, str, dict[str, object]]] = [
        (1.0, "pause", {}),
        (1.5, "paused", {}),
        (2.0, "resumed", {}),
        (3.0, "next_probe", {"touch": None, "probability": {"0": 0.2, "2": 0.7}, "p_absent": 0.1, "excluded": [1]}),
        (4.0, "reject", {"candidate": 0, "rejected": [0]}),
        (5.0, "plan", {"plan": plan}),
        (6.0, "lift", {}),
        (7.0, "put_back", {"candidate": 2}),
        (7.5, "forgotten", {"candidates": [1]}),
        (8.0, "failure", {"node": "a/b", "code": "tool_lost", "message": "it fell"}),
    ]
    with Recorder(tmp_path / "run.mcap", {"mission": "m"}) as record:
        for stamp_s, kind, data in told:
            record.event(kind, stamp_s, data)
    model = read(tmp_path)
    assert [model.state_at(t).phase for t in (0.5, 1.0, 1.5, 2.0, 8.0)] == [
        "waiting", "pausing", "paused", "running", "ended",
    ]  # fmt: skip
    at = model.state_at(3.0)
    assert [(s.index, s.probability) for s in at.shares] == [(2, 0.7), (0, 0.2), (None, 0.1)]
    assert at.states == {1: "excluded", 2: "best"}
    assert model.state_at(4.0).states == {0: "rejected", 1: "excluded", 2: "best"}
    grasp = model.state_at(5.5).grasp
    assert grasp is not None
    assert (grasp.candidate, grasp.opening_m) == (2, 0.08)
    assert model.state_at(6.0).states[2] == "taken"
    assert model.state_at(6.0).grasp is None
    assert model.state_at(7.0).states[2] == "best"
    assert model.state_at(7.5).states[1] == "rejected"
    assert [model.state_at(t).probe_lost for t in (7.9, 8.0)] == [False, True]
    assert model.marks.stamps == [8.0]
    assert "b: it fell" in model.marks.values[0].text


def test_events_of_another_version_are_listed_and_not_drawn(tmp_path: Path) -> None:
    strange: list[object] = [None, 3, "text", [], {}, {"contour": {"kind": "round"}}, {"index": "x"}]
    with Recorder(tmp_path / "run.mcap", {"mission": "m"}) as record:
        for i, value in enumerate(strange):
            for kind in ("contact", "candidate", "touchset", "plan", "ranking", "next_probe", "tool", "closure", "top"):
                record.event(kind, float(i), {kind: value, "excluded": value, "probability": value, "held": value})
    model = read(tmp_path)
    state = model.state_at(model.span_s[1])
    assert (state.touches, state.outlines, state.patches, state.grasp, state.shares) == ((), (), (), None, ())
    assert len(state.log) == 63


def test_the_target_of_the_ranking_is_said(model: RunModel) -> None:
    line = next(v for v in model.log.values if v.kind == "ranking")
    assert line.text == f"{OBJECTS[WANTED][0]} accepted"


FULL = """
mission: full
world: container_five
tree:
  selector:
    - sequence:
        - wait: {name: look, seconds: 2.0}
        - condition: {name: nothing there, port: done, equals: false}
    - fail: {name: end safely, do: {wait: {name: stow, seconds: 2.0}}}
"""


def test_where_a_mission_failed_stays_in_view(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A false condition is no event, and the selector resets it before the mission ends."""
    (tmp_path / "full.yaml").write_text(FULL)
    install_fakes(monkeypatch.setattr)
    monkeypatch.chdir(tmp_path)
    assert CliRunner().invoke(cli.app, ["run", "full.yaml", "--out", "run"]).exit_code == 1
    model = read(tmp_path / "run")
    (mark,) = model.marks.values
    assert (mark.kind, mark.tone) == ("failed", "bad")
    assert mark.text.startswith("nothing there: ")
    assert mark.stamp_s == pytest.approx(2.0, abs=0.1)
    end = {n.rsplit("/", 1)[-1]: s for n, s in model.state_at(model.span_s[1]).nodes.items()}
    assert end["look"] == "SUCCESS"
    assert (end["sequence"], end["nothing there"], end["end safely"]) == ("FAILURE", "FAILURE", "FAILURE")


def test_a_long_mission_is_kept_in_bounded_memory_with_its_peaks() -> None:
    count = 200_000
    t_s = 0.01 * np.arange(count)
    force = np.zeros(count)
    force[[77, 60_001, 131_073, 199_998]] = 9.0
    numbers = np.column_stack([t_s, force, t_s])
    rows, at_once = GrowingRows(3, peak=1), GrowingRows(3, peak=1)
    at_once.append(numbers)
    for part in np.array_split(numbers, 401):
        rows.append(part)
        assert rows.rows[-1, 0] == part[-1, 0], "a live view shows the newest row"
        assert len(rows.rows) <= MAX_KEPT
        spacing_s = np.diff(rows.rows[:-1, 0])
        np.testing.assert_allclose(spacing_s, spacing_s[0], atol=1e-6)
    assert spacing_s[0] == pytest.approx(0.04)
    np.testing.assert_array_equal(rows.rows, at_once.rows)
    assert rows._data.nbytes < 10e6
    assert (rows.rows[:, 1] == 9.0).sum() == 4
    at = rows.at(700.0)
    assert at is not None
    assert at[2] == pytest.approx(700.0, abs=0.04)


def test_rows_are_merged_as_their_numbers_say(monkeypatch: pytest.MonkeyPatch) -> None:
    """Closed form: row i of stride s has the stamp of the last number of its group, and the group's maximum."""
    monkeypatch.setattr(model_file, "MAX_KEPT", 4)
    numbers = np.column_stack([np.arange(40.0), np.random.default_rng(0).random(40)])
    rows = GrowingRows(2, peak=1)
    rows.append(numbers[:0])
    for n in range(1, 41):
        rows.append(numbers[n - 1 : n])
        stride = next(s for s in (1, 2, 4, 8, 16) if -(-n // s) <= 4)
        groups = [numbers[i : min(i + stride, n)] for i in range(0, n, stride)]
        np.testing.assert_array_equal(rows.rows, [[g[-1, 0], g[:, 1].max()] for g in groups])
