"""`bench space`: the score of a recorded run against closed forms, its summary, and its trials."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from glotouch_bt.bench.space import bench as space
from glotouch_bt.bench.space.scoring import score, tilt_deg, windows
from glotouch_bt.report import RecordedEvent, RunRecord, Tick

UP = [1.0, 0.0, 0.0, 0.0]


def item(x_m: float, quat: list[float] = UP) -> dict[str, Any]:
    return {"name": "thing", "pose_B_O": {"position_m": [x_m, 0.0, 0.0], "quat": quat}}


def turned(angle_deg: float, axis: int) -> list[float]:
    half = np.radians(angle_deg) / 2
    return [float(np.cos(half)), *(float(np.sin(half)) if k == axis else 0.0 for k in range(3))]


@pytest.mark.parametrize(("angle_deg", "axis", "tilt"), [(40.0, 0, 40.0), (75.0, 1, 75.0), (120.0, 2, 0.0)])
def test_a_turn_about_the_vertical_is_no_tilt(angle_deg: float, axis: int, tilt: float) -> None:
    assert tilt_deg(item(0.0), item(0.0, turned(angle_deg, axis))) == pytest.approx(tilt, abs=1e-6)


def placed(stamp_s: float, x_m: float, ended: str) -> RecordedEvent:
    contour = {"centre_K_m": [x_m, 0.0], "kind": "round", "yaw_rad": 0.0}
    return RecordedEvent(stamp_s, "candidate", {"candidate": {"index": 0, "contour": contour}, "ended": ended})


def run(*events: RecordedEvent, end_m: float = 0.03) -> RunRecord:
    """One object of which the probe section is centred in its frame; it was to be moved from 10 s to 20 s."""
    container = {"pose_B_K": {"position_m": [0.0, 0.0, 0.0], "quat": UP}}
    record = RunRecord(Path("run"), run={"container": container})
    record.ticks = [
        Tick(10.0, "m/each/object 0", "INVALID", "RUNNING"),
        Tick(20.0, "m/each/object 0", "RUNNING", "SUCCESS"),
        Tick(20.0, "m/each/object 0/else", "RUNNING", "SUCCESS"),
    ]
    record.events = [placed(5.0, 0.001, "traced"), *events]
    record.truth = {"start": [item(0.0)], "end": [item(end_m)]}
    record.samples = {"stamp_s": np.array([9.0, 12.0, 21.0]), "force_S_N": np.array([[9, 0, 0], [0, 3, 4], [9, 0, 0]])}
    return record


SECTIONS: Any = {"thing": SimpleNamespace(name="thing", centre_m=np.zeros(2))}
FAILED = RecordedEvent(15.0, "failure", {"node": "nudge 3", "code": "blocked"})


def scored(
    record: RunRecord, before_m: float = 0.0, after_m: float = 0.03, quat: list[float] | None = None
) -> dict[str, Any]:
    """Return the row of the only act; the object stood there before and after it, and was turned before it."""
    states = {10.0: [item(before_m, quat or UP)], 20.0: [item(after_m, quat or UP)]}
    (row,) = score(record, SECTIONS, "nudge", states.__getitem__)
    return row


def test_the_error_is_the_distance_of_the_place_in_the_map_from_the_true_one_at_that_time() -> None:
    later = placed(30.0, 0.05, "pushed")
    row = scored(run(placed(15.0, 0.028, "pushed"), later, end_m=0.06), before_m=0.005)
    assert (row["done"], row["tried"], row["cause"], row["object"]) == (True, True, "", "thing")
    assert row["error_before_mm"] == pytest.approx(4.0)
    assert row["position_error_mm"] == pytest.approx(2.0)
    assert row["error_at_end_mm"] == pytest.approx(10.0)
    assert row["moved_mm"] == pytest.approx(25.0)
    assert row["peak_N"] == pytest.approx(5.0)
    assert not row["toppled"]


def test_a_push_that_failed_is_not_done_and_has_its_cause() -> None:
    row = scored(run(placed(15.0, 0.01, "pushed"), FAILED))
    assert (row["done"], row["tried"], row["cause"]) == (False, True, "nudge: blocked")
    row = scored(run(FAILED))
    assert (row["done"], row["tried"]) == (False, False)


def test_what_ended_as_an_act_began_belongs_to_the_act_before() -> None:
    row = scored(run(placed(10.0, 0.01, "pushed"), FAILED))
    assert (row["done"], row["tried"]) == (False, False)


def test_what_the_probe_toppled_is_not_counted_as_toppled_by_the_act() -> None:
    record = run(placed(15.0, 0.028, "pushed"))
    record.truth["end"] = [item(0.03, turned(90.0, 0))]
    row = scored(record)
    assert (row["toppled"], row["fallen_before"]) == (True, False)
    row = scored(record, quat=turned(90.0, 0))
    assert (row["toppled"], row["fallen_before"]) == (False, True)


def test_a_mission_that_ended_before_the_first_act_has_no_row() -> None:
    record = run()
    record.ticks = []
    assert score(record, SECTIONS, "nudge", lambda _: []) == []


def test_an_act_that_did_not_end_lasts_to_the_end_of_the_record() -> None:
    record = run()
    del record.ticks[1:]
    assert [(w.index, w.begin_s, w.end_s) for w in windows(record)] == [(0, 10.0, 21.0)]


def thing(error_mm: float | None, **more: Any) -> dict[str, Any]:
    row = {"done": True, "tried": True, "cause": "", "position_error_mm": error_mm, "duration_s": 20.0, "peak_N": 2.0}
    return row | {"toppled": False, "fallen_before": False} | more


def test_everything_that_was_asked_for_counts() -> None:
    rows = [
        {
            "cause": "",
            "objects": [
                thing(1.0),
                thing(7.0, toppled=True, error_before_mm=6.0, error_at_end_mm=4.0),
                thing(50.0, fallen_before=True),
            ],
        },
        {"cause": "", "objects": [thing(2.0), thing(None, done=False, tried=False, cause="nudge: no_push")]},
        {"cause": "tool_pickup: no_probe", "objects": []},
    ]
    summary = space.summarise(rows)
    assert (summary["asked"], summary["fallen_before"], summary["worlds"]) == (4, 1, 3)
    assert (summary["done"]["rate"], summary["within"]["rate"]) == (pytest.approx(3 / 4), pytest.approx(2 / 3))
    assert summary["within_over_worlds"]["mean"] == pytest.approx(0.75)
    assert summary["toppled"]["rate"] == pytest.approx(1 / 4)
    assert summary["not_done"] == {"nudge: no_push": 1}
    assert summary["worlds_failed"] == {"tool_pickup: no_probe": 1}
    assert summary["position_error_mm"]["max"] == 7.0
    assert summary["off_before"] == 1
    assert summary["within_at_end"]["rate"] == pytest.approx(1 / 3)
    assert space.summarise([])["within"]["n"] == 0


def test_both_acts_are_tried_on_every_seed(tmp_path: Path) -> None:
    campaign = space.SpaceCampaign(seeds=(3, 4), out=tmp_path)
    asked = [(t.identity["mission"], t.identity["seed"]) for t in campaign.trials()]
    assert asked == [("nudge_each", 3), ("clear_each", 3), ("nudge_each", 4), ("clear_each", 4)]
