"""The true peak force stays below the hard limit although sensors or joints fail, and no lost object is a success."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from glotouch_bt.robot import Limits
from glotouch_bt.runs import RunRequest, launch
from glotouch_bt.validation.forces.following import MISSIONS

AT_PLACE = {"x": "20", "y": "50", "width": "40", "layout": json.dumps({"block": [0.02, 0.05, 0.0]})}


@pytest.fixture
def faulted(block: Path, tmp_path: Path) -> Any:
    """Run a mission with one fault; return its result after the checks that hold for every run."""
    (tmp_path / "pickup.yaml").write_text(MISSIONS["pickup"])

    def run(mission: str, fault: str, given: dict[str, Any], when: dict[str, Any]) -> dict[str, Any]:
        plan = {"fault": fault, "with": given, "when": when, "for": "ever"}
        spec = json.dumps({k: v for k, v in plan.items() if v})
        (tmp_path / "plan.yaml").write_text(f"faults: f\nplan:\n  - {spec}\n")
        request = RunRequest(
            str(tmp_path / "pickup.yaml") if mission == "pickup" else mission,
            seed=1,
            settings=AT_PLACE if mission == "pick_at" else {"layout": AT_PLACE["layout"]},
            objects=block,
            out=tmp_path / "run",
            faults=tmp_path / "plan.yaml",
            report=False,
        )
        result = dict(launch(request).result)
        assert result["faults"][0]["effective"]
        assert result["peak_force_N"] < Limits().hard_force_N
        assert result["status"] != "success" or result["retrieved"] == "block"
        return result

    return run


@pytest.mark.parametrize(("joint", "rate_rad_s"), [(3, 0.12), (0, 0.06), (1, -0.06), (1, -0.12)])
def test_a_joint_that_leaves_its_setpoint_while_the_probe_is_drawn(faulted: Any, joint: int, rate_rad_s: float) -> None:
    """The probe stands in its holder, which gives by 1 mm for 54 N."""
    given = {"joint": joint, "offset_rad": rate_rad_s, "rise_s": 1.0}
    result = faulted("pickup", "following_error", given, {"node": "tool_pickup", "aperture_below_m": 0.03})
    assert result["status"] == "aborted"


@pytest.mark.parametrize("after_s", [8.5, 8.8])
def test_a_joint_that_leaves_its_setpoint_while_the_jaws_close(faulted: Any, after_s: float) -> None:
    given = {"joint": 1, "offset_rad": -0.06, "rise_s": 1.0}
    when = {"node": "grasp", "aperture_below_m": 0.06, "after_s": after_s}
    assert faulted("pick_at", "following_error", given, when)["status"] == "aborted"


@pytest.mark.parametrize("fault", ["wrench_off", "wrench_stuck"])
def test_a_wrist_that_is_dead_from_its_first_sample_ends_the_first_motion(faulted: Any, fault: str) -> None:
    result = faulted("pick_at", fault, {}, {})
    assert result["reason_chain"][-1]["code"] == "guard_wrench_silent"
    assert result["peak_force_N"] == 0.0


@pytest.mark.parametrize("time_s", [0.0, 4.5])
def test_a_wrist_that_is_half_a_second_late(faulted: Any, time_s: float) -> None:
    """From the start, and between two motions."""
    result = faulted("calibrate", "wrench_delay", {"delay_s": 0.526}, {"time_s": time_s})
    assert result["reason_chain"][-1]["code"] in ("guard_wrench_silent", "guard_wrench_stuck")


def test_an_object_that_is_dropped_in_the_lift_is_not_reported_as_lifted(faulted: Any) -> None:
    """The open jaws weighed 8.7 N before the wrist was tared."""
    given = {"opening_m": 0.08, "duration_s": 10}
    result = faulted("pick_at", "grip_drop", given, {"node": "lift", "after_s": 0.5})
    assert (result["status"], result["reason_chain"][-1]["code"]) == ("failure", "lost")


@pytest.mark.parametrize(("seed", "aside_mm"), [pytest.param(53657, 4.3, marks=pytest.mark.study), (53749, 5.4)])
def test_a_tilted_shaft_passes_through_its_slot_both_ways(tmp_path: Path, seed: int, aside_mm: float) -> None:
    """The slot leaves the ball 2.5 mm. The hand gives way on the way out, and stands aside on the way in."""
    text = (
        "mission: there_and_back\nworld: container_five\ntree: {sequence: [tool_pickup, tool_calibrate, tool_return]}\n"
    )
    (tmp_path / "there_and_back.yaml").write_text(text)
    request = RunRequest(str(tmp_path / "there_and_back.yaml"), seed=seed, conditions="harsh", report=False)
    result = launch(replace(request, out=tmp_path / "run")).result
    assert result["status"] == "success"
    assert 1e3 * math.hypot(*result["calibration"]["tip_P_m"][:2]) == pytest.approx(aside_mm, abs=0.2)
    assert 10.0 < result["true_peak_force_N"] < Limits().hard_force_N
