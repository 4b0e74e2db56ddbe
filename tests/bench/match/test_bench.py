"""`glotouch bench match`: what it starts, writes and prints, and bad input; acquisition is mocked."""

from __future__ import annotations

import csv
import json
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from glotouch_bt import cli
from glotouch_bt.bench.match import bench, closures, trials
from glotouch_bt.bench.match.bench import MatchCampaign, objects_of, run_campaign
from glotouch_bt.bench.match.dataset import write_layout
from glotouch_bt.bench.match.methods import chosen
from glotouch_bt.bench.match.trials import Decided
from glotouch_bt.robot import BadInput
from tests.bench.match.conftest import SIZES_M, a_layout, by_size


class Threads(ThreadPoolExecutor):
    """In place of processes, so that mocks reach the work."""

    def __init__(self, workers: int, *_: object) -> None:
        super().__init__(workers)


@pytest.fixture
def quick(made_up, monkeypatch):
    """Everything but the orchestration replaced by what can be worked out by hand."""
    monkeypatch.setattr(bench, "models_of", trials.models_of)
    monkeypatch.setattr(trials, "methods", lambda: dict.fromkeys((*chosen(()),), by_size))
    monkeypatch.setattr(closures, "infer_belief", lambda *known, **_: SimpleNamespace(ranking=by_size(*known)))
    monkeypatch.setattr(closures, "expected_gain", lambda belief, options: list(range(len(options))))
    monkeypatch.setattr(bench, "timing_task", lambda *_: {"new_stl_s": 0.5, "pair_ms": {"likelihood": 7.25}})


@pytest.fixture
def undrawn(monkeypatch):
    """No plots, which take seconds; the recorded dataset's and the empty one's are drawn."""
    monkeypatch.setattr(bench, "plot_all", lambda *_: None)


def campaign(tmp_path, **changes):
    given = {
        "seeds": (3, 4), "conditions": "nominal", "objects": None, "strangers": tmp_path, "dataset": None,
        "methods": chosen(()), "backend": "mujoco", "out": tmp_path / "o",
    }  # fmt: skip
    return MatchCampaign(**given | changes)


def test_a_recorded_dataset(quick, monkeypatch, tmp_path):
    """Two layouts; in the second, the large one is missing and something of no name is there."""
    monkeypatch.setattr(MatchCampaign, "check", lambda self: None)
    write_layout(tmp_path / "set", a_layout(3))
    write_layout(tmp_path / "set", a_layout(9, ("small", "middle", None), (0.04, 0.06, 0.05)))
    shown = []
    with ThreadPoolExecutor(1) as pool:
        summary = run_campaign(campaign(tmp_path, dataset=tmp_path / "set"), pool, lambda *row: shown.append(row))
    assert [(row["seed"], row["touched"], row["nameless"], done, total) for row, done, total in shown] == [
        (3, 3, 0, 1, 2),
        (9, 2, 1, 2, 2),
    ]
    assert shown[0][0]["right"] == dict.fromkeys(chosen(()), 3)
    assert list(summary["methods"]) == list(chosen(()))
    figures = summary["methods"]["likelihood"]
    assert (figures["row_top1"]["rate"], figures["row_top1"]["n"]) == (1.0, 5)
    assert figures["row_top1"]["whole_layouts"]["n"] == 2
    assert (figures["absent_lifted"]["rate"], figures["absent_lifted"]["n"]) == (0.0, 5)
    assert figures["stranger_lifted"]["n"] == 6
    assert summary["paper"]["paper_full"]["row_top1"] == 0.9
    assert summary["loss_matrix"]["objects"] == ["large", "middle", "small"]
    assert summary["loss_matrix"]["likelihood"][0] == pytest.approx([0.0, 2.0, 4.0])
    assert (summary["seeds"], summary["recorded"], summary["timing"]["new_stl_s"]) == ([3, 9], True, 0.5)
    assert set(summary["closures_to_confidence"]) == {"recorded", "in_turn", "adaptive"}
    out = tmp_path / "o"
    assert json.loads((out / "summary.json").read_text()) == summary
    names = {"campaign.json", "trials.csv", "pairs.csv", "closures.csv", "layouts.csv", "summary.json"}
    plots = {"top1.png", "losses.png", "reliability.png", "closures.png"}
    assert {p.name for p in out.iterdir() if p.is_file() and p.name[0] != "."} == names | plots
    with (out / "trials.csv").open() as f:
        assert len(list(csv.DictReader(f))) == 6 * (5 + 5 + 1 + 6)


def test_layouts_that_cannot_be_acquired_are_rows(quick, undrawn, monkeypatch, tmp_path):
    monkeypatch.setattr(MatchCampaign, "check", lambda self: None)
    monkeypatch.setattr(MatchCampaign, "layout_request", lambda self, seed: seed)

    def acquire(seed, dataset):
        if seed == 4:
            raise RuntimeError("the solver diverged")
        layout = a_layout(seed)
        write_layout(dataset, layout)
        return layout

    monkeypatch.setattr(bench, "acquire_layout", acquire)
    with ThreadPoolExecutor(1) as pool:
        summary = run_campaign(campaign(tmp_path, methods=("likelihood",)), pool)
    assert summary["ended"] == {"success": 1, "traceback RuntimeError: the solver diverged": 1}
    assert (summary["layouts"], summary["methods"]["likelihood"]["row_top1"]["n"]) == (2, 3)
    assert (tmp_path / "o" / "touchsets" / "s0003-c2.npz").is_file()


def test_touches_without_a_robot_are_written_like_acquired_ones(quick, undrawn, monkeypatch, tmp_path):
    monkeypatch.setattr(MatchCampaign, "check", lambda self: None)
    monkeypatch.setattr(bench, "sampled_layout", lambda backend, world, conditions, seed, images: a_layout(seed))
    with ThreadPoolExecutor(1) as pool:
        summary = run_campaign(campaign(tmp_path, sampled=True), pool)
    assert (summary["sampled"], summary["methods"]["likelihood"]["row_top1"]["n"]) == (True, 6)
    assert summary["closures_to_confidence"] == {}
    assert (tmp_path / "o" / "touchsets" / "s0004-c1.npz").is_file()


def test_nothing_acquired_at_all(quick, monkeypatch, tmp_path):
    monkeypatch.setattr(MatchCampaign, "check", lambda self: None)
    monkeypatch.setattr(bench, "acquire_layout", lambda *_: a_layout(names=()))
    monkeypatch.setattr(MatchCampaign, "layout_request", lambda self, seed: seed)
    with ThreadPoolExecutor(1) as pool:
        summary = run_campaign(campaign(tmp_path), pool)
    assert summary["methods"]["likelihood"]["row_top1"]["rate"] is None
    assert summary["ece"]["value"] is None


def test_five_of_a_large_folder(tmp_path):
    for k in range(9):
        (tmp_path / f"o{k}.stl").write_text(str(k))
    drawn = {seed: {p.name for p in objects_of(tmp_path, seed, tmp_path / "c").iterdir()} for seed in range(12)}
    assert {len(names) for names in drawn.values()} == {5}
    assert len({frozenset(n) for n in drawn.values()}) > 6
    assert {p.name for p in objects_of(tmp_path, 3, tmp_path / "again").iterdir()} == drawn[3]
    few = tmp_path / "c" / "s0000"
    assert objects_of(few, 3, tmp_path / "d") == few


def test_the_mission_of_a_layout(tmp_path):
    request = campaign(tmp_path, seeds=(5,)).layout_request(5)
    assert (request.mission, request.seed, request.settings) == ("touch_all", 5, {"expected_objects": "5"})
    assert request.out == tmp_path / "o" / "runs" / "s0005"


def test_unknown_methods_are_refused():
    with pytest.raises(BadInput, match="must be among paper_width, paper_depth, paper_full, likelihood_outline"):
        chosen(["paper_ful"])
    assert chosen(["likelihood", "paper_full"]) == ("paper_full", "likelihood")


BAD = [
    (["--method", "nearest"], "must be among"),
    (["--phases", "0"], "--phases"),
    (["--conditions", "nominl"], "did you mean 'nominal'"),
    (["--objects", "gone"], "is not a folder with .stl files in it"),
    (["--strangers", "gone"], "no such folder of STL files"),
    (["--dataset", "gone"], "is not a folder of recorded TouchSets"),
    (["--backend", "mujco"], "unknown backend 'mujco'"),
    (["--out", "taken/here"], "cannot be written here"),
]


@pytest.fixture
def command(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setattr("glotouch_bt.campaign.WorkerPool", Threads)
    yield CliRunner()
    cli._debug = False


@pytest.mark.parametrize(("words", "message"), BAD, ids=[" ".join(w) for w, _ in BAD])
def test_bad_input_is_exit_2_before_anything_is_written(words, message, command, tmp_path):
    (tmp_path / "taken").write_text("x")
    done = command.invoke(cli.app, ["bench", "match", *words])
    assert done.exit_code == 2, done.output
    assert message in done.stderr
    assert "Traceback" not in done.output
    assert [p.name for p in tmp_path.iterdir()] == ["taken"]


@pytest.mark.parametrize("as_json", [False, True])
def test_the_command(as_json, command, quick, undrawn, monkeypatch, tmp_path):
    monkeypatch.setattr(MatchCampaign, "check", lambda self: None)
    (tmp_path / "there").mkdir()
    write_layout(tmp_path / "set", a_layout(3))
    words = ["--dataset", "set", "--strangers", "there", "--out", "o", "--workers", "1"] + ["--json"] * as_json
    done = command.invoke(cli.app, ["bench", "match", *words])
    assert done.exit_code == 0, done.output
    assert done.stderr.startswith("[1/1] seed 3: success, 3 of 3 touched; right: paper_width 3, ")
    if as_json:
        assert json.loads(done.stdout)["methods"]["likelihood"]["row_top1"]["n"] == 3
    else:
        for text in ("90.0", "100.0 [44, 100]", "(100, 100)", *SIZES_M, "in_turn", "7.2", "takes 0.50 s", "o/summary"):
            assert text in done.stdout.replace("\n", " "), text


@pytest.mark.parametrize("changes", [{"touched": True}, {"in_the_box": 10}])
def test_options_that_need_touches_without_a_robot(changes, tmp_path):
    with pytest.raises(BadInput, match="--sampled"):
        campaign(tmp_path, strangers=None, **changes).check()


def test_a_handled_object_is_compared_with_its_stl(quick, monkeypatch, tmp_path):
    monkeypatch.setattr(MatchCampaign, "check", lambda self: None)
    monkeypatch.setattr(bench, "sampled_layout", lambda backend, world, conditions, seed, images: a_layout(seed))
    handled = {t.name: t.touchset for t in a_layout(3).touched}
    monkeypatch.setattr(bench, "handled_objects", lambda *_: handled)
    seen = []

    def decide(layout, folder, strangers, names, felt):
        seen.append((names, felt))
        return Decided([], [])

    monkeypatch.setattr(bench, "decide", decide)
    bench.layout_task(campaign(tmp_path, sampled=True, touched=True, methods=("likelihood",)), 3, None)
    assert seen == [(("likelihood", "touched"), handled)]
