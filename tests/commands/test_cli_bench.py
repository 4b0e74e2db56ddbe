"""`glotouch bench search | contact | detection | retrieve`: what they start and print, and bad input."""

from __future__ import annotations

import json
from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from glotouch_bt import cli
from glotouch_bt.bench import RetrieveCampaign, detection
from glotouch_bt.bench.contact import bench as contact
from glotouch_bt.bench.contact.bench import METRICS, MORE, PAPER
from glotouch_bt.bench.contact.square import TOOLS
from glotouch_bt.bench.search import bench as search
from glotouch_bt.bench.search.summary import ERRORS, summarise


class NoPool:
    """In place of worker processes, which mocked studies do not need."""

    def __init__(self, workers: int, *_: object) -> None:
        self.workers = workers

    def __enter__(self) -> NoPool:
        return self

    def __exit__(self, *_: object) -> None:
        return None

    def submit(self, *_: object) -> Future[Any]:
        raise AssertionError("a mocked study submits nothing")


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[CliRunner]:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setattr("glotouch_bt.campaign.WorkerPool", NoPool)
    yield CliRunner()
    cli._debug = False


BAD = [
    (["search", "--policies", "expected_fnd"], "must be among expected_find, nearest_frontier, random_descent"),
    (["search", "--policies", " , "], "must be among"),
    (["search", "--trials", "0"], "give --trials, --planar or --recorded"),
    (["search", "--trials", "-1"], "--trials"),
    (["search", "--objects", "gone"], "is not a folder with .stl files in it"),
    (["search", "--conditions", "nominl"], "did you mean 'nominal'"),
    (["search", "--backend", "mujco"], "unknown backend 'mujco'"),
    (["search", "--out", "taken/here"], "cannot be written here"),
    (["contact", "--trials", "0"], "--trials"),
    (["contact", "--per-side", "16"], "--per-side"),
    (["contact", "--per-side", "0"], "--per-side"),
    (["contact", "--conditions", "gone.yaml"], "no such conditions"),
    (["contact", "--out", "taken"], "cannot be written here"),
    (["detection", "--trials", "0"], "--trials"),
    (["detection", "--robots", "0"], "--robots"),
    (["detection", "--hours", "0"], "--hours"),
    (["detection", "--conditions", "nominal", "--conditions", "hrsh"], "did you mean 'harsh'"),
    (["detection", "--backend", "mujco"], "unknown backend 'mujco'"),
    (["detection", "--out", "taken/here"], "cannot be written here"),
]


@pytest.mark.parametrize(("words", "message"), BAD, ids=[" ".join(w) for w, _ in BAD])
def test_bad_input_is_exit_2_before_anything_is_written(
    words: list[str], message: str, command: CliRunner, tmp_path: Path
) -> None:
    (tmp_path / "taken").write_text("x")
    done = command.invoke(cli.app, ["bench", *words])
    assert done.exit_code == 2, done.output
    assert message in done.stderr
    assert done.stdout == ""
    assert "Traceback" not in done.output
    assert [p.name for p in tmp_path.iterdir()] == ["taken"]


def a_trial(simulator: str, policy: str, travel_m: list[float]) -> dict[str, Any]:
    errors = dict.fromkeys(ERRORS, 0.5)
    return {
        "simulator": simulator, "policy": policy, "seed": 4, "ended": "complete", "discovered_m": travel_m,
        "false_candidates": 0, "candidates": [errors] * len(travel_m), "contacts": 9, "travel_m": travel_m[-1],
        "contact_gap_mm": [0.1],
    }  # fmt: skip


@pytest.mark.parametrize("as_json", [False, True])
def test_search(as_json: bool, command: CliRunner, monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[Any] = []

    def run(campaign: search.SearchCampaign, pool: NoPool, show: search.OnRow) -> dict[str, Any]:
        started.append((campaign, pool.workers))
        rows = [a_trial("mujoco", p, [0.5, 1.5]) for p in campaign.policies]
        rows += [a_trial("planar", p, [0.6, 4.0]) for p in campaign.policies]
        show(rows[0], 1, 4)
        return summarise(rows, campaign.policies, 2) | {"conditions": campaign.conditions, "objects": 2}

    monkeypatch.setattr("glotouch_bt.bench.search.run_campaign", run)
    words = ["--policies", "nearest_frontier, expected_find", "--trials", "3", "--planar", "5", "--seed", "4"]
    done = command.invoke(cli.app, ["bench", "search", *words, "--out", "o", "--workers", "1"] + ["--json"] * as_json)
    assert done.exit_code == 0, done.output
    ((campaign, workers),) = started
    assert campaign.policies == ("nearest_frontier", "expected_find")
    assert (campaign.seeds, campaign.planar_seeds, workers) == ((4, 5, 6), (4, 5, 6, 7, 8), 1)
    assert done.stderr == "[1/4] mujoco nearest_frontier seed 4: 2 found, 1.50 m, complete\n"
    if as_json:
        assert set(json.loads(done.stdout)["policies"]) == {"nearest_frontier", "expected_find"}
    else:
        for text in ("nearest_frontier, planar", "paper, random_descent", "1.00 [1.00", "centre_error_mm", "o/summary"):
            assert text in done.stdout.replace("\n", " "), text


@pytest.mark.parametrize("as_json", [False, True])
def test_contact(as_json: bool, command: CliRunner, monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[contact.ContactCampaign] = []

    def run(campaign: contact.ContactCampaign, _pool: NoPool, show: Any) -> dict[str, Any]:
        started.append(campaign)
        good = {"seed": 100, "cause": "", **dict.fromkeys((*METRICS, *MORE), 1.25)}
        rows = [good | {"tool": tool, "square": "fixed"} for tool in TOOLS]
        rows.append({"tool": "gripper", "square": "free", "seed": 100, "cause": "lost"})
        for k, row in enumerate(rows):
            show(row, k + 1, len(rows))
        said = {"paper": PAPER, "conditions": campaign.conditions, "seeds": list(campaign.seeds)}
        return contact.summarise(rows) | said | {"contacts_per_side": campaign.per_side}

    monkeypatch.setattr("glotouch_bt.bench.contact.run_campaign", run)
    done = command.invoke(cli.app, ["bench", "contact", "--trials", "1", "--per-side", "2"] + ["--json"] * as_json)
    assert done.exit_code == 0, done.output
    (campaign,) = started
    assert (campaign.seeds, campaign.per_side, campaign.conditions) == ((100,), 2, "nominal")
    assert campaign.out.parent == Path("runs")
    assert campaign.out.name.endswith("-bench-contact")
    assert "[1/3] probe fixed seed 100: centre 1.25 mm" in done.stderr
    assert "[3/3] gripper free seed 100: lost" in done.stderr
    if as_json:
        assert json.loads(done.stdout)["probe"]["centre_error_mm"]["mean"] == 1.25
    else:
        for text in ("centre_error_mm", "0.37", "3.15", "free gripper seed 100: lost", "traced", "1/1", "0/1"):
            assert text in done.stdout, text


@pytest.mark.parametrize("as_json", [False, True])
def test_detection(as_json: bool, command: CliRunner, monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[detection.DetectionStudy] = []

    def run(study: detection.DetectionStudy, on_line: Any) -> dict[str, Any]:
        started.append(study)
        on_line("harsh seed 100: 0 false in 31.0 min")
        return {"conditions": {}, "seeds": list(study.seeds)}

    monkeypatch.setattr(detection, "run_study", run)
    monkeypatch.setattr(detection, "table", lambda summary: ["nominal", f"  {len(summary['seeds'])} trials"])
    done = command.invoke(cli.app, ["bench", "detection", "--out", "o"] + ["--json"] * as_json)
    assert done.exit_code == 0, done.output
    (study,) = started
    assert study.conditions == ("nominal", "harsh")
    assert (study.seeds[0], len(study.seeds), study.hours, study.minutes) == (100, 100, 2.0, 31.0)
    assert (study.pushes, study.robots, study.backend, study.out) == (40, 1, "mujoco", Path("o"))
    assert done.stderr == "harsh seed 100: 0 false in 31.0 min\n"
    if as_json:
        assert len(json.loads(done.stdout)["seeds"]) == 100
    else:
        assert done.stdout == "nominal\n  100 trials\no/summary.json\n"


def test_retrieve_aims_at_the_objects_of_the_given_world(command: CliRunner, monkeypatch: pytest.MonkeyPatch) -> None:
    """The mission's default target is not among the solids of that world."""
    started: list[RetrieveCampaign] = []

    def run(campaign: RetrieveCampaign, *_: object) -> dict[str, Any]:
        started.append(campaign)
        return {}

    monkeypatch.setattr("glotouch_bt.bench.run_campaign", run)
    done = command.invoke(cli.app, ["bench", "retrieve", "--world", "clutter_ten", "--out", "o", "--json"])
    assert done.exit_code == 0, done.output
    assert len(started[0].targets) == 10
    assert "wukong" not in started[0].targets
