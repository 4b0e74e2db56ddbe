"""The page of a run, without a browser: what it sends, for a whole, a cut and a replaced record."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("viser")

from glotouch_bt.mission.record.recorder import Recorder
from glotouch_bt.view.page import MissionControls
from glotouch_bt.view.serve import page_server
from glotouch_bt.view.watch import RunWatch
from tests.support.made_run import POSE_B_K, Made, make_run


@pytest.fixture
def server() -> Iterator[Any]:
    with page_server(None, browser=False) as (opened, _):
        yield opened


@pytest.fixture
def watch(server: Any) -> Iterator[Callable[..., RunWatch]]:
    """Watch a folder; the record is closed at the end."""
    made: list[RunWatch] = []

    def start(folder: Path, controls: MissionControls | None = None) -> RunWatch:
        made.append(RunWatch(server, folder, controls))
        return made[-1]

    yield start
    for each in made:
        each.close()


def told(shown: RunWatch) -> dict[str, str]:
    """The texts of the panels, drawn as for a viewer."""
    shown.viewers = -1
    shown.step(0.1)
    return {name: html.content for name, html in shown.page.html.items()}


def test_every_panel_shows_the_run(watch: Callable[..., RunWatch], whole: Made) -> None:
    texts = told(watch(whole.folder))
    assert "the mission succeeded" in texts["status"]
    assert "candidate 4" in texts["posterior"]
    assert texts["log"].count("<div") > 40
    assert "polyline" in texts["signals"]
    assert "polygon" in texts["strip"]
    assert "tool_pickup" in texts["tree"]


def test_nothing_is_drawn_while_nothing_changes(
    server: Any, watch: Callable[..., RunWatch], whole: Made, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown = watch(whole.folder)
    shown.step(0.1)
    drawn: list[float] = []
    draw = shown.page.draw
    monkeypatch.setattr(shown.page, "draw", lambda state, *note: (drawn.append(state.t_s), draw(state, *note)))
    shown.step(0.1)
    assert drawn == []  # nobody looks
    monkeypatch.setattr(server, "get_clients", lambda: {0: None})
    for _ in range(5):
        shown.step(0.1)
    assert len(drawn) == 1  # somebody has come
    shown.player.seek(1.0)
    for _ in range(5):
        shown.step(0.1)
    assert drawn[1:] == [1.0]


def test_what_a_record_says_is_never_markup(watch: Callable[..., RunWatch], whole: Made) -> None:
    """The target of the made-up run is named `<b>wukong & co</b>`."""
    texts = told(watch(whole.folder))
    assert all("<b>wukong" not in text for text in texts.values())
    assert "&lt;b&gt;wukong &amp; co&lt;/b&gt;" in texts["status"] + texts["posterior"]


def test_a_cut_record_is_shown_and_said_to_be_silent(
    watch: Callable[..., RunWatch], whole: Made, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = (whole.folder / "run.mcap").read_bytes()
    (tmp_path / "run.mcap").write_bytes(data[: len(data) // 2])
    monkeypatch.setattr("glotouch_bt.view.watch.SILENT_S", -1.0)
    texts = told(watch(tmp_path))
    assert "no new entry for" in texts["status"]
    assert "candidate 1" in texts["posterior"]


def test_a_view_may_wait_for_its_run(watch: Callable[..., RunWatch], tmp_path: Path) -> None:
    shown = watch(tmp_path / "later")
    assert "waiting for the first cycle" in told(shown)["status"]
    make_run(tmp_path / "later", until="sweep")
    assert "was aborted" in told(shown)["status"]


def test_a_resumed_run_replaces_the_record(watch: Callable[..., RunWatch], whole: Made, cut: Made) -> None:
    shown = watch(cut.folder)
    assert "candidate 0" not in told(shown)["posterior"]
    shutil.copy(whole.folder / "run.mcap", cut.folder / "new")
    (cut.folder / "new").replace(cut.folder / "run.mcap")
    assert "candidate 0" in told(shown)["posterior"]


def test_a_record_that_is_no_record_is_said_so(watch: Callable[..., RunWatch], tmp_path: Path) -> None:
    (tmp_path / "run.mcap").write_bytes(b"some text that is long enough to have no magic")
    assert "is not an MCAP record" in told(watch(tmp_path))["status"]


def test_a_description_that_makes_no_sense_costs_the_scene_only(watch: Callable[..., RunWatch], tmp_path: Path) -> None:
    joint = {"name": "j", "origin_m": [0, 0, 0], "origin_rpy_rad": [0, 0, 0], "axis": [0, 0, 0], "lower_rad": 0}
    joint |= {"upper_rad": 0, "velocity_rad_s": 0, "torque_Nm": 0, "armature_kgm2": 0}
    link = {"name": "l", "mass_kg": 0, "com_m": [0, 0, 0], "inertia_kgm2": [0] * 6, "capsules": []}
    pose = {"position_m": [0, 0, 0], "quat": [1, 0, 0, 0]}
    box = {"centre_m": [0, 0, 0], "half_m": [0, 0, 0]}
    hand = {"pose_E_P": pose, "mass_kg": 0, "com_E_m": [0, 0, 0], "finger_mass_kg": 0, "stroke_m": 0, "force_N": 0}
    hand |= {
        "speed_m_s": 0,
        "body": [box],
        "finger": box,
        "pad_window_m": [0, 0],
        "pad_shape": [1, 1],
        "pad_depth_m": 0,
    }
    robot = {"name": "r", "base": link, "joints": [{**joint, "link": link}], "pose_last_E": pose, "home_q": [1e308]}
    run = {"mission": "m", "robot": {"description": {**robot, "gripper": hand}}}
    with Recorder(tmp_path / "run.mcap", run) as record:
        record.event("note", 1.0, {"text": "still there"})
    texts = told(watch(tmp_path))
    assert "the scene cannot be drawn" in texts["status"]
    assert "still there" in texts["log"]


def test_true_objects_are_shown_only_when_asked_for(
    server: Any, watch: Callable[..., RunWatch], tmp_path: Path
) -> None:
    made = make_run(tmp_path / "run")
    pose = {"position_m": POSE_B_K.position_m.tolist(), "quat": [1.0, 0.0, 0.0, 0.0]}
    outline = [[0.5, 0.0], [0.6, 0.0], [0.6, 0.1]]
    one = {"name": "pear", "outline_B_m": outline, "pose_B_O": pose}
    (made.folder / "truth.json").write_text(json.dumps({"start": [one], "end": [one, one, "broken"]}))
    shown = watch(made.folder)
    told(shown)
    switch = shown.page.ghost_switch
    assert switch.options == ("hidden", "at the start", "at the end")
    assert switch.value == "hidden"
    nodes = server.scene._handle_from_node_name
    assert not [n for n in nodes if n.startswith("/ghost")]
    switch.value = "at the end"
    told(shown)
    assert sorted(n for n in nodes if n.startswith("/ghost/")) == [
        "/ghost/0",
        "/ghost/1",
        "/ghost/label0",
        "/ghost/label1",
    ]


def test_a_run_of_hardware_offers_no_truth(watch: Callable[..., RunWatch], cut: Made) -> None:
    shown = watch(cut.folder)
    told(shown)
    assert shown.page.ghost_switch.visible is False


def test_only_the_page_of_a_live_run_has_mission_buttons(watch: Callable[..., RunWatch], cut: Made) -> None:
    asked: list[str] = []
    controls = MissionControls(*(lambda word=word: asked.append(word) for word in ("pause", "go on", "stop")))
    live = watch(cut.folder, controls)
    assert live.page.mission_buttons is not None
    told(live)
    assert live.page.mission_buttons.visible is False  # the mission has ended
    assert watch(cut.folder).page.mission_buttons is None


@pytest.mark.parametrize("answered", [False, True])
def test_the_question_to_stop_closes_when_the_mission_ends(
    server: Any, watch: Callable[..., RunWatch], tmp_path: Path, answered: bool
) -> None:
    asked: list[str] = []
    live = watch(tmp_path / "run", MissionControls(*(lambda word=word: asked.append(word) for word in ("a", "b", "c"))))
    told(live)
    (press,) = live.page.mission_buttons._impl.update_cb
    press(SimpleNamespace(target=SimpleNamespace(value="stop")))
    told(live)
    (question,) = server.gui._modal_handle_from_uuid.values()
    if answered:
        (let_it_run,) = (c for c in question._children.values() if getattr(c, "label", "") == "Let it run")
        let_it_run._impl.update_cb[0](None)
    assert question.closed is answered
    make_run(tmp_path / "run", until="sweep")
    told(live)
    assert question.closed is True
    assert asked == []
