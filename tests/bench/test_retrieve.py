import csv
import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from glotouch_bt.bench import retrieve
from glotouch_bt.runs.launch import RunRequest

LOST = {"node": "sequence/grasp/lift", "code": "lost", "message": "", "evidence": {}, "advice": ""}


def _result(request: RunRequest) -> dict[str, Any]:
    """Seed 0 retrieves, seed 1 lifts another object, seed 2 loses it, seed 3 stops for safety."""
    target = request.settings["target"]
    status = {2: "failure", 3: "aborted"}.get(request.seed, "success")
    held = {0: target, 1: "other"}.get(request.seed)
    return {
        "status": status, "retrieved": held, "correct": held == target, "candidates": [1, 2], "sim_time_s": 100.0,
        "wall_time_s": 10.0 + request.seed, "peak_force_N": 9.0, "probe_path_m": 3.0, "contacts": 7,
        "skill_time_s": {"squeeze": 60.0 + request.seed, **({"lift": 4.0} if held else {})},
        "reason_chain": [LOST] if request.seed == 2 else [{**LOST, "code": "safety_stop"}] if request.seed == 3 else [],
    }  # fmt: skip


@pytest.fixture
def campaign(tmp_path: Path) -> retrieve.RetrieveCampaign:
    return retrieve.RetrieveCampaign(
        mission="retrieve", targets=("apple", "train"), seeds=range(5), backend="fake", out=tmp_path / "out"
    )


def test_every_trial_is_counted_and_named(campaign: retrieve.RetrieveCampaign, monkeypatch: pytest.MonkeyPatch) -> None:
    def launch(request: RunRequest) -> Any:
        if request.seed == 4:
            raise RuntimeError("a bug")
        code = {2: 1, 3: 3}.get(request.seed, 0)
        return SimpleNamespace(result=_result(request), exit_code=code)

    monkeypatch.setattr(retrieve, "launch_trial", launch)
    shown: list[int] = []
    with ThreadPoolExecutor(2) as pool:
        summary = retrieve.run_campaign(campaign, pool, lambda row, done, total: shown.append(done))
    assert shown == list(range(1, 11))
    assert (summary["success"]["rate"], summary["success"]["n"]) == (0.2, 10)
    assert summary["by_target"]["apple"]["rate"] == 0.2
    assert summary["wrong_object"]["rate"] == 0.2
    assert summary["skill_time_s"] == {"squeeze": 61.5, "lift": 2.0}
    assert summary["safety_stops"]["rate"] == 0.2
    assert summary["tracebacks"]["rate"] == 0.2
    assert summary["causes"] == {
        "wrong_object": 2, "lift: lost": 2, "lift: safety_stop": 2, "traceback RuntimeError: a bug": 2
    }  # fmt: skip
    assert summary["wall_s"]["n"] == 8
    with (campaign.out / "trials.csv").open() as f:
        assert len(list(csv.DictReader(f))) == 10
    assert json.loads((campaign.out / "summary.json").read_text())["success"] == summary["success"]


def test_a_mission_that_says_success_with_an_empty_hand_is_no_success() -> None:
    row = {"status": "success", "retrieved": None, "correct": False, "target": "a", "cause": "nothing_in_gripper"}
    assert not retrieve.succeeded(row)
    assert retrieve.cause({"status": "success", "retrieved": None, "correct": False}) == "nothing_in_gripper"


def test_a_resumed_campaign_keeps_what_was_run_and_passes_settings_on(
    campaign: retrieve.RetrieveCampaign, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[RunRequest] = []

    def launch(request: RunRequest) -> Any:
        asked.append(request)
        assert request.out is not None
        (request.out / "result.json").write_text(json.dumps(_result(request)))
        return SimpleNamespace(result=_result(request), exit_code={2: 1, 3: 3}.get(request.seed, 0))

    monkeypatch.setattr(retrieve, "launch_trial", launch)
    first = replace(campaign, seeds=(0, 1), settings={"devices": "simulated"})
    with ThreadPoolExecutor(1) as pool:
        retrieve.run_campaign(first, pool)
        assert {r.settings["devices"] for r in asked} == {"simulated"}
        before = len(asked)
        again = replace(first, seeds=(0, 1, 3), resume=True)
        summary = retrieve.run_campaign(again, pool)
    assert len(asked) == before + 2, "only the new seed"
    assert summary["success"]["n"] == 6
    assert summary["safety_stops"]["rate"] == pytest.approx(2 / 6)


def test_targets_take_turns_over_the_seeds(campaign: retrieve.RetrieveCampaign) -> None:
    """Three objects, two for each seed: every object is tried as often, and each world twice."""
    turns = replace(campaign, targets=("apple", "train", "truck"), per_seed=2, seeds=range(3))
    tried = [(t.identity["settings"]["target"], t.identity["seed"]) for t in turns.trials()]
    assert tried == [("apple", 0), ("train", 0), ("truck", 1), ("apple", 1), ("train", 2), ("truck", 2)]


def test_an_object_that_was_lifted_and_set_down_again_is_counted() -> None:
    lifts = [{"object": "b"}, {"object": None}, {"object": "a"}, {"object": "b"}]
    assert retrieve.others_lifted({"target": "a", "lifted": lifts}) == "b"
    assert retrieve.others_lifted({"target": "a"}) == ""


def test_peaks_are_grouped_by_the_softness_of_the_contacts() -> None:
    rows = [{"contact_softness_s": s, "peak_force_N": p} for s, p in ((0.004, 8.0), (0.002, 20.0), (0.003, 10.0))]
    harder, softer = retrieve.peak_by_softness(rows)
    assert (harder["n"], harder["median_N"], harder["to_s"]) == (1, 20.0, 0.002)
    assert (softer["n"], softer["median_N"], softer["largest_N"]) == (2, 9.0, 10.0)
    assert len(retrieve.peak_by_softness([{"contact_softness_s": 0.004, "peak_force_N": 8.0}] * 4)) == 1
    assert retrieve.peak_by_softness([{"peak_force_N": 8.0}]) == []
