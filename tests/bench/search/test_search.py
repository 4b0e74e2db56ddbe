"""Scoring and summary of `bench search` on made-up trials, and a small campaign in the plane."""

from __future__ import annotations

import csv
import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from glotouch_bt.bench.search.bench import SearchCampaign, run_campaign
from glotouch_bt.bench.search.scoring import Found, TrueLayout, discovered_at, score
from glotouch_bt.bench.search.summary import correlation, quantiles, summarise
from glotouch_bt.bench.search.trial import TipPath, recorded_folders, score_run
from glotouch_bt.report.run_record import RecordedEvent, RunRecord, Tick
from glotouch_bt.robot import BadInput


def thing(name="thing", size=(0.08, 0.04), centre=(0.01, 0.0), yaw=0.0, top=0.07):
    return SimpleNamespace(
        name=name, centre_m=np.array(centre), box_yaw_rad=yaw, elongation=size[0] / size[1], top_m=top
    )


def layout(*poses, before=None, **kind):
    after = np.array(poses, dtype=float)
    return TrueLayout(tuple(thing(**kind) for _ in poses), after if before is None else np.array(before), after)


def at(x, y, travel=1.0, kind="round", yaw=0.0, height=None):
    return Found(travel, np.array([x, y]), kind, yaw, height)


def test_a_candidate_is_of_the_nearest_object_not_counted_before():
    """Centres are the felt sections' at the pose: 10 mm along x of the mesh frame, turned with it."""
    truth = layout((0.0, 0.0, 0.0), (0.1, 0.0, np.pi / 2))
    row = score([at(0.012, 0.0, 1.0), at(0.011, 0.0, 2.0), at(0.1, 0.010, 3.0), at(-0.1, 0.1, 4.0)], truth)
    assert row["discovered_m"] == [1.0, 3.0]
    assert row["false_candidates"] == 2
    assert [c["centre_error_mm"] for c in row["candidates"]] == pytest.approx([2.0, 0.0], abs=1e-9)


def test_a_wrong_outline_counts_when_it_is_refined():
    truth = layout((0.0, 0.0, 0.0), (0.1, 0.0, np.pi / 2))
    first = [at(0.045, 0.0, 1.0), at(0.1, 0.020, 2.0)]
    row = score(first, truth, [at(0.011, 0.0, 2.6), at(0.1, 0.010, 3.0)])
    assert row["discovered_m"] == [2.0, 2.6]
    assert row["false_candidates"] == 0
    assert score(first, truth)["discovered_m"] == [2.0]


def test_an_object_counts_from_when_on_its_candidate_stays_near():
    near, far = np.array([0.011, 0.0]), np.array([0.05, 0.0])
    candidate = replace(at(0.01, 0.0, 5.0), earlier=((1.0, near), (2.0, far), (3.0, near)))
    assert score([candidate], layout((0.0, 0.0, 0.0)))["discovered_m"] == [3.0]


@pytest.mark.parametrize(("off_mm", "found"), [(24.9, 1), (25.1, 0)])
def test_discovered_means_within_25_mm(off_mm, found):
    row = score([at(0.01, 1e-3 * off_mm)], layout((0, 0, 0)))
    assert len(row["discovered_m"]) == found


def test_yaw_is_of_the_long_side_whichever_way_round():
    truth = layout((0, 0, 0.2), yaw=0.1)
    for off in (0.0, np.pi, -np.pi):
        row = score([at(0.01, 0.002, kind="box", yaw=0.35 + off)], truth)
        assert row["candidates"][0]["yaw_error_deg"] == pytest.approx(np.rad2deg(0.05))
    assert score([at(0.01, 0, kind="round")], truth)["candidates"][0]["yaw_error_deg"] is None
    square = score([at(0.01, 0, kind="box")], layout((0, 0, 0), size=(0.05, 0.049)))
    assert square["candidates"][0]["yaw_error_deg"] is None


def test_height_and_displacement():
    row = score([at(0.03, 0.0, height=0.0712)], layout((0.02, 0, 0), before=[(0.02, 0.004, 0)]))
    candidate = row["candidates"][0]
    assert candidate["height_error_mm"] == pytest.approx(1.2)
    assert candidate["displaced_mm"] == pytest.approx(4.0)
    assert candidate["centre_error_mm"] == pytest.approx(0.0, abs=1e-9)


def a_row(travels, simulator="mujoco", policy="a", seed=0, **more):
    return {
        "simulator": simulator, "policy": policy, "seed": seed, "ended": "complete", "discovered_m": travels,
        "false_candidates": 0, "candidates": [], "contacts": 10, "travel_m": travels[-1] if travels else 0.0,
    } | more  # fmt: skip


def test_a_trial_that_broke_off_counts_as_far_as_it_came():
    rows = [a_row([0.5, 2.0]), a_row([0.5], seed=1, ended="safety_stop"), a_row([], seed=2, ended="traceback")]
    figures = summarise(rows, ["a"], 2)["policies"]["a"]
    assert figures["mean_discovered"]["1"]["mean"] == pytest.approx(2 / 3)
    assert figures["mean_discovered"]["3"]["mean"] == pytest.approx(1.0)
    assert figures["complete"]["3"]["rate"] == pytest.approx(1 / 3)
    assert figures["complete"]["3"]["n"] == 3
    assert figures["complete_in_the_end"]["rate"] == pytest.approx(1 / 3)
    assert figures["found_share"]["mean"] == pytest.approx(0.5)
    assert figures["ended"] == {"complete": 1, "safety_stop": 1, "traceback": 1}


def test_validation_pairs_layouts():
    rows = [a_row([1.0, 2.0 + 0.1 * s], seed=s) for s in range(6)]
    rows += [a_row([1.0, 2.3 + 0.1 * s], "planar", seed=s) for s in range(2, 9)]
    found = summarise(rows, ["a"], 2)["validation"]["a"]
    assert (found["layouts"], found["both_complete"]) == (4, 4)
    assert found["travel_to_complete"]["mean_difference_m"]["mean"] == pytest.approx(0.3)
    assert found["travel_to_complete"]["correlation"]["r"] == pytest.approx(1.0)


def test_correlation_of_known_pairs():
    rng = np.random.default_rng(0)
    x, e = rng.normal(size=(2, 4000))
    found = correlation(x, 0.6 * x + 0.8 * e)
    assert found["lo"] < 0.6 < found["hi"]
    assert np.isnan(correlation([1.0, 1.0, 1.0], [1.0, 2.0, 3.0])["r"])


def test_quantiles():
    found = quantiles(np.arange(101.0))
    assert (found["median"]["value"], found["p95"]["value"], found["n"]) == (50.0, 95.0, 101)
    assert found["median"]["lo"] < 50 < found["median"]["hi"]
    assert quantiles([])["n"] == 0


def test_travel_of_a_record_counts_from_the_first_sweep_to_the_last_trace():
    """A square of 0.1 m a side, one side a second, seen at 1 kHz with a sway below the threshold."""
    t = np.arange(0.0, 4.0, 0.001)
    corners = np.array([[0, 0], [0.1, 0], [0.1, 0.1], [0, 0.1], [0, 0]])
    sway = 0.0001 * np.sin(300 * t)
    position = np.column_stack(
        [np.interp(t, range(5), corners[:, 0]) + sway, np.interp(t, range(5), corners[:, 1]), 0.1 * np.sin(t)]
    )
    record = RunRecord(
        Path("x"),
        run={"container": {"pose_B_K": {"position_m": [0.6, 0.0, -0.2], "quat": [1.0, 0.0, 0.0, 0.0]}}},
        samples={"stamp_s": t, "position_B_P": position + np.array([0.6, 0.0, 0.0])},
        events=[RecordedEvent(0.0, "tool", {"held": True})],
        ticks=[Tick(1.0, "a/guarded_sweep", "INVALID", "RUNNING"), Tick(3.0, "a/orbit_probe", "RUNNING", "SUCCESS")],
    )
    way = TipPath.of(record)
    assert way.before_m == pytest.approx(0.1, abs=0.004)
    assert way.total_m == pytest.approx(0.2, abs=0.006)
    assert way.travel_m(2.0) == pytest.approx(0.1, abs=0.004)
    assert way.travel_m(99.0) == way.total_m


def test_what_was_forgotten_is_not_found():
    """Two candidates are traced where the two objects stand. The second one is forgotten, and never found again."""
    here = {"position_m": [0.0, 0.0, 0.0], "quat": [1.0, 0.0, 0.0, 0.0]}
    there = here | {"position_m": [0.1, 0.0, 0.0]}
    objects = [{"name": "thing", "pose_B_O": here}, {"name": "thing", "pose_B_O": there}]

    def traced(index: int, x_m: float) -> RecordedEvent:
        contour = {"centre_K_m": [x_m, 0.0], "kind": "round", "yaw_rad": 0.0}
        candidate = {"index": index, "contour": contour, "contacts": []}
        return RecordedEvent(1.0, "candidate", {"candidate": candidate, "node": "orbit_probe", "displaced_m": 0.0})

    both = [traced(0, 0.01), traced(1, 0.11)]
    for more, found in (([], 2), ([RecordedEvent(2.0, "forgotten", {"candidates": [1]})], 1)):
        record = RunRecord(Path("x"), run={"container": {"pose_B_K": here}}, events=[*both, *more])
        record.truth = {"start": objects, "end": objects}
        row = score_run(record, {"thing": thing()})
        assert (len(row["discovered_m"]), row["false_candidates"]) == (found, 0)


def test_a_record_without_exploration_has_no_travel():
    way = TipPath.of(RunRecord(Path("x")))
    assert (way.total_m, way.before_m, way.travel_m(5.0)) == (0.0, 0.0, 0.0)


def test_unknown_policies_are_named():
    with pytest.raises(BadInput, match="no_such"):
        SearchCampaign(policies=("no_such",), seeds=(1,), out=Path("x"))
    with pytest.raises(BadInput, match="nothing to try"):
        SearchCampaign(policies=("random_descent",), seeds=(), out=Path("x"))


def test_the_request_of_a_trial(tmp_path):
    campaign = SearchCampaign(policies=("random_descent",), seeds=(7,), out=tmp_path)
    trial = campaign.mission_trial("random_descent", 7)
    assert trial.folder == tmp_path / "random_descent-s7"
    assert (trial.identity["mission"], trial.identity["seed"]) == ("survey", 7)
    assert trial.identity["settings"] == {"policy": "random_descent", "expected_objects": "5"}


def test_a_campaign_in_the_plane_writes_all_there_is(tmp_path):
    campaign = SearchCampaign(
        policies=("nearest_frontier",), seeds=(), planar_seeds=(3, 4), out=tmp_path / "out", planar_budget_m=1.0
    )
    seen = []
    with ThreadPoolExecutor(1) as pool:
        summary = run_campaign(campaign, pool, lambda row, done, total: seen.append((row["seed"], done, total)))
    assert seen == [(3, 1, 2), (4, 2, 2)]
    figures = summary["planar"]["nearest_frontier"]
    assert figures["mean_discovered"]["5"]["n"] == 2
    assert figures["mean_discovered"]["1"]["mean"] <= figures["mean_discovered"]["5"]["mean"]
    assert json.loads((campaign.out / "summary.json").read_text()) == summary
    with (campaign.out / "trials.csv").open() as f:
        trials = list(csv.DictReader(f))
    with (campaign.out / "candidates.csv").open() as f:
        candidates = list(csv.DictReader(f))
    assert [t["seed"] for t in trials] == ["3", "4"]
    travels = [float(x) for x in trials[0]["discovered_at_m"].split()]
    assert len(candidates) == sum(len(t["discovered_at_m"].split()) for t in trials)
    assert discovered_at({"discovered_m": travels}, 3.0) == int(trials[0]["discovered_3_m"])
    assert (campaign.out / "discovered.png").stat().st_size > 10_000


def test_recorded_runs_are_those_that_ended_under_the_conditions_with_their_truth(tmp_path):
    def run(name, result, *files):
        (tmp_path / name).mkdir(parents=True)
        (tmp_path / name / "result.json").write_text(result)
        for f in files:
            (tmp_path / name / f).touch()

    run("runs/a", '{"conditions": "nominal"}', "run.mcap", "truth.json")
    run("b", '{"conditions": "nominal"}', "run.mcap", "truth.json")
    run("c", '{"conditions": "harsh"}', "run.mcap", "truth.json")
    run("no_truth", '{"conditions": "nominal"}', "run.mcap")
    run("broken", "{", "run.mcap", "truth.json")
    assert recorded_folders(tmp_path, "nominal") == [tmp_path / "b", tmp_path / "runs/a"]
    assert recorded_folders(tmp_path, "harsh") == [tmp_path / "c"]
    with pytest.raises(BadInput, match="no recorded run"):
        recorded_folders(tmp_path, "ideal")
