"""Results of a run: the sizes of the objects, then the results that skills declare."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from glotouch_bt.mission.record import NullRecord, RunSummary
from glotouch_bt.robot import HOLD, Observation
from glotouch_bt.robot.fake import FakeRobot


def candidate(index: int, height_m: float, top_touched: bool) -> dict[str, object]:
    size_m = [0.103, 0.044]
    return {"index": index, "contour": {"size_m": size_m}, "height_m": height_m, "top_touched": top_touched}


def test_the_result_has_each_object_as_it_was_measured_last() -> None:
    summary = RunSummary(NullRecord())
    summary.event("result", 1.0, {"node": "tool_calibrate", "key": "tool", "text": "a probe"})
    summary.event("candidate", 2.0, {"node": "orbit_probe", "candidate": candidate(0, 0.03, False)})
    assert summary.results["candidates"] == {"node": "orbit_probe", "text": "1 object traced: 103 × 44 mm"}
    summary.event("candidate", 3.0, {"node": "orbit_probe", "candidate": candidate(1, 0.03, False)})
    summary.event("candidate", 4.0, {"node": "touch_top", "candidate": candidate(0, 0.063, True)})
    text = "2 objects traced: 103 × 44 × 63, 103 × 44 mm"
    assert summary.results["candidates"] == {"node": "touch_top", "text": text}
    assert list(summary.results) == ["candidates", "tool"]


def test_objects_that_were_forgotten_are_no_result() -> None:
    summary = RunSummary(NullRecord())
    for index in range(3):
        summary.event("candidate", 2.0, {"node": "orbit_probe", "candidate": candidate(index, 0.03, False)})
    summary.event("forgotten", 3.0, {"node": "forget_doubtful", "candidates": (0, 2)})
    summary.event("candidate", 4.0, {"node": "orbit_probe", "candidate": candidate(3, 0.03, False)})
    assert [c["index"] for c in summary.candidates] == [1, 3]
    assert summary.results["candidates"]["text"].startswith("2 objects traced")


@pytest.mark.parametrize("odd", [None, {}, {"index": 0}, {"contour": 3}, {"contour": {"size_m": ["a", "b"]}}])
def test_a_candidate_of_another_shape_is_no_result(odd: object) -> None:
    summary = RunSummary(NullRecord())
    summary.event("candidate", 1.0, {"candidate": odd})
    assert len(summary.candidates) == 1
    assert summary.results == {}


def test_cycles_are_counted_by_skill() -> None:
    summary = RunSummary(NullRecord())
    observation = FakeRobot().observe()
    for skill, cycles in (("sweep", 2), ("squeeze", 3), ("sweep", 1)):
        summary.skill = skill
        for _ in range(cycles):
            summary.block(observation, HOLD)
    assert summary.skill_cycles == {"sweep": 3, "squeeze": 3}
    again = RunSummary(NullRecord())
    again.restore(summary.state())
    assert again.skill_cycles == summary.skill_cycles


def pressed(newtons: float) -> Observation:
    """Return a block in which the wrist reads a force along x."""
    observation = FakeRobot().observe()
    wrench = np.zeros_like(observation.wrench_S)
    wrench[:, 0] = newtons
    return replace(observation, wrench_S=wrench)


def test_the_peak_force_counts_from_the_first_tare_on() -> None:
    """Before it, the sensor reads the weight of the hand. A tare that failed does not count."""
    summary = RunSummary(NullRecord())
    for number, error in enumerate((None, "the arm moved", None)):
        summary.block(pressed(9.0), HOLD)
        summary.event("request", 1.0, {"number": number, "request": "Payload" if number == 0 else "Tare"})
        summary.event("request_done", 1.0, {"number": number, "error": error})
    summary.flush()
    assert summary.peak_force_N == 0.0
    again = RunSummary(NullRecord())
    again.restore(summary.state())
    for newtons in (2.5, 1.0):
        again.block(pressed(newtons), HOLD)
    again.flush()
    assert again.peak_force_N == pytest.approx(2.5)
