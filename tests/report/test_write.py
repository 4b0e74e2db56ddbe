"""The page against the run it is made of."""

import base64
import errno
import hashlib
import json
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.mission.record.recorder import Recorder
from glotouch_bt.report import read_run, write_report
from glotouch_bt.report.scene import script
from glotouch_bt.report.sections.map import tip_path_K_m
from glotouch_bt.report.sections.tree import spans
from glotouch_bt.report.truth import true_outlines
from glotouch_bt.robot import BadInput

VOID = {"meta", "img", "br", "input"}


class Balanced(HTMLParser):
    """Fails on a tag that is not closed in order; collects text and tags."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.text: list[str] = []
        self.tags: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open, tag
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text.append(data)


def parsed(page: str) -> Balanced:
    p = Balanced()
    p.feed(page)
    assert p.open == []
    return p


@pytest.fixture(scope="module")
def page(whole: SimpleNamespace) -> str:
    return write_report(whole.folder).read_text()


def test_the_page_says_what_the_run_says(page: str, whole: SimpleNamespace) -> None:
    text = " ".join(parsed(page).text)
    numbers = ("12.3 N", "11.9 N", "6.28 m", "5 of 5", "0.432", "0.479", "compliance <1.63>, 0.73 mm/N")
    assert "an older value" not in text, "only the last of each result counts"
    for said in ("Retrieved <b>wukong & co</b>", "nominal", *numbers):
        assert said in text, said
    assert f"contact stop ({len(whole.contacts)})" in text
    for title in ("Map", "Force", "Squeezes", "Recognition", "Behavior tree", "Log", "About this run"):
        assert f"<h2>{title}</h2>" in page
    for touchset in whole.touchsets:
        for layer in touchset.layers:
            assert f"{layer.aperture_m * 1e3:.1f} mm" in text
    assert page.count("data:image/png;base64,") == 2 * sum(len(t.layers) for t in whole.touchsets)


def test_the_page_loads_nothing_and_runs_only_the_scene(page: str) -> None:
    """The policy of the page names the digest of the only program, so that nothing a record says can run."""
    assert not re.search(r"https?:|[\"'(]//|url\(|@import|<link|<iframe|\ssrc=\"(?!data:)|\son\w+=", page)
    assert len(page) < 3_000_000
    data, program = re.findall(r"<script( [^>]*)?>(.*?)</script>", page, re.DOTALL)
    assert "application/json" in data[0]
    json.loads(data[1])
    assert program == ("", script())
    digest = base64.b64encode(hashlib.sha256(program[1].encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in page


def test_without_the_script_everything_but_the_scene_is_there(
    page: str, tmp_path: Path, writer: SimpleNamespace
) -> None:
    writer.make_run(tmp_path)  # describes no robot
    without = write_report(tmp_path).read_text()
    assert "<script" not in without
    titles = [re.findall(r"<h2>(.*?)</h2>", text) for text in (page, without)]
    assert set(titles[0]) - set(titles[1]) == {"Scene"}


def test_a_skill_adds_its_own_section(page: str) -> None:
    assert "<h2>Touches &amp; walls</h2>" in page
    assert all(said in page for said in ("two &lt;walls&gt;", "wall &lt;x&gt;", "0.0113", "-0.25"))


def test_the_page_says_what_the_mission_is_for_and_how_large_the_objects_are_before_the_probe(page: str) -> None:
    text = " ".join(parsed(page).text)
    places = [
        text.index(said) for said in ("bring <one> object", "5 objects traced: 62 × 62 × 59,", "compliance <1.63>")
    ]
    assert places == sorted(places)
    assert "times real time" not in text


def test_the_scene_speaks_of_a_target_only_if_the_mission_has_one(
    page: str, tmp_path: Path, writer: SimpleNamespace
) -> None:
    assert "probability that it is the target" in page
    writer.make_run(tmp_path, until="sweep", description=RIZON4_XENSE, target="")
    without = write_report(tmp_path).read_text()
    assert "The number at a candidate is its index." in without
    assert "the target" not in without


def test_the_log_leaves_out_what_is_none(tmp_path: Path) -> None:
    with Recorder(tmp_path / "run.mcap", {"mission": "m"}) as record:
        record.event("tool", 1.0, {"held": False, "error": None, "force_N": 3.25})
    assert "<td>not held, force_N = 3.25</td>" in write_report(tmp_path).read_text()


def test_a_record_without_a_run_is_refused(tmp_path: Path) -> None:
    (tmp_path / "run.mcap").write_bytes(b"hello")
    with pytest.raises(BadInput, match="nothing to report"):
        write_report(tmp_path)
    assert not (tmp_path / "report.html").exists()


def test_a_mission_that_explored_nothing_has_no_map(tmp_path: Path) -> None:
    with Recorder(tmp_path / "run.mcap", {"container": {"interior_m": [0.4, 0.3, 0.1]}}) as record:
        record.event("tool", 1.0, {"held": True})
    page = write_report(tmp_path).read_text()
    assert "<h2>Map</h2>" not in page
    assert "objects found" not in page


def test_names_are_escaped(page: str) -> None:
    assert "<b>wukong" not in page
    assert "&lt;b&gt;wukong &amp; co&lt;/b&gt;" in page
    assert "probe stowed &lt;safely&gt;" in page


def test_same_run_same_page(page: str, whole: SimpleNamespace) -> None:
    assert write_report(whole.folder).read_text() == page


@pytest.mark.parametrize("until", ["opened", "sweep"])
def test_a_run_that_stopped_early_gives_a_shorter_report(tmp_path: Path, writer: SimpleNamespace, until: str) -> None:
    writer.make_run(tmp_path, until=until)
    page = write_report(tmp_path).read_text()
    text = " ".join(parsed(page).text)
    assert "Recognition" not in text
    if until == "sweep":
        assert "Aborted: interrupted by <user> & co" in text
        assert "Why" in text


def test_the_title_of_a_failed_run_names_the_node_that_failed(tmp_path: Path) -> None:
    with Recorder(tmp_path / "run.mcap", {"mission": "crowded"}) as record:
        record.event("note", 1.0, {"text": "it ended"})
    reason = {"node": "not too full", "code": "condition_false", "message": "found is 5, not at most 3"}
    (tmp_path / "result.json").write_text(json.dumps({"status": "failure", "reason_chain": [reason]}))
    assert "Failed: not too full: found is 5, not at most 3" in write_report(tmp_path).read_text()


def test_a_cut_record_without_a_result_still_gives_a_report(whole: SimpleNamespace, tmp_path: Path) -> None:
    data = (whole.folder / "run.mcap").read_bytes()
    (tmp_path / "run.mcap").write_bytes(data[: len(data) // 2])
    (tmp_path / "result.json").write_text("[1]")  # somebody else's
    text = " ".join(parsed(write_report(tmp_path).read_text()).text)
    assert "The run did not end" in text
    assert "the record was cut short" in text


def test_a_matcher_of_probabilities_is_drawn_with_them(tmp_path: Path) -> None:
    """Without gates and with probabilities: candidates by probability, and none of them beside; no bar of losses."""
    matches = [
        {"index": i, "loss": 0.001, "probability": p, "terms": {"width": 1.5, "image": -0.5}, "evidence": 4.0,
         "pose_K_O": [0.0, 0.0, 0.0]}
        for i, p in ((0, 0.125), (3, 0.625))
    ]  # fmt: skip
    ranking = {"matches": matches, "margin": 0.1, "accepted": False, "reasons": ["too few <touches>"], "p_absent": 0.25}
    with Recorder(tmp_path / "run.mcap", {"container": {"interior_m": [0.4, 0.3, 0.1]}, "pose_B_K": 4}) as record:
        record.event("ranking", 1.0, {"target": "a & b", "ranking": ranking, "gates": None, "matcher": "likelihood"})
    text = " ".join(parsed(write_report(tmp_path).read_text()).text)
    places = [text.index(w) for w in ("candidate 3", "candidate 0", "none of them")]
    assert all(words in text for words in ("a & b", "too few <touches>", "0.625", "0.125", "0.25"))
    assert places[0] < places[1]
    assert "margin to the second" not in text


def test_events_of_odd_shapes_are_no_error(tmp_path: Path) -> None:
    odd: list[object] = [
        None,
        3,
        "x",
        [],
        [1, "a"],
        {},
        {"contour": 3},
        {"sequences": [{"layers": [{}]}], "matches": [{}]},
    ]
    with Recorder(tmp_path / "run.mcap", {"container": {"interior_m": [0.4, 0.3, 0.1]}, "pose_B_K": 4}) as record:
        for kind, key in (
            ("contact", "contact"),
            ("candidate", "candidate"),
            ("sweep", "path_K_m"),
            ("touchset", "touchset"),
            ("ranking", "ranking"),
            ("tool", "grasp_to_tip_m"),
            ("note", "text"),
        ):
            for i, value in enumerate(odd):
                record.event(kind, 0.1 * i, {key: value})
    parsed(write_report(tmp_path).read_text())


def test_the_tip_path_is_where_the_tip_was(whole: SimpleNamespace, writer: SimpleNamespace) -> None:
    """The ball passed every contact's recorded position, at the height of the contacts."""
    path = tip_path_K_m(read_run(whole.folder))
    path = path[np.isfinite(path).all(axis=1)]
    for contact in whole.contacts:
        assert np.linalg.norm(path - contact.tip_K_m, axis=1).min() < 0.004


def test_true_outlines_come_back_in_K(whole: SimpleNamespace, writer: SimpleNamespace) -> None:
    outlines = true_outlines(read_run(whole.folder))
    assert [o.name for o in outlines] == [spec[0] for spec in writer.OBJECTS]
    for o, spec in zip(outlines, writer.OBJECTS, strict=True):
        np.testing.assert_allclose(o.start_K_m[:-1].mean(axis=0), spec[2], atol=1e-6)
    assert outlines[1].moved_m == pytest.approx(np.hypot(0.009, 0.004), rel=1e-6)
    assert outlines[0].moved_m == 0.0


def test_spans_of_the_tree(whole: SimpleNamespace) -> None:
    found = spans(read_run(whole.folder))
    squeezes = [s for s in found if s.node.endswith("/squeeze")]
    assert [s.status for s in squeezes] == ["SUCCESS", "FAILURE", "SUCCESS", "SUCCESS", "SUCCESS"]
    assert all(s.end_s > s.start_s for s in squeezes)
    (match,) = [s for s in found if s.node.endswith("/match")]
    assert match.start_s == match.end_s


def test_no_run_is_bad_input(tmp_path: Path) -> None:
    with pytest.raises(BadInput):
        write_report(tmp_path)


def test_a_full_disk_leaves_the_report_before(
    whole: SimpleNamespace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "run"
    shutil.copytree(whole.folder, folder)
    before = write_report(folder).read_text(encoding="utf-8")

    def full(part: Path, target: Path) -> Path:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(BadInput, match="No space left"):
        write_report(folder)
    assert (folder / "report.html").read_text(encoding="utf-8") == before
    assert not list(folder.glob(".*"))
