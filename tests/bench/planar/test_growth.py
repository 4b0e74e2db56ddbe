"""The slopes of `bench growth`, and its explorations in a box of another size."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from glotouch_bt.bench.planar.growth import POINTS, GrowthCampaign, failed_row, growth_row, slopes, summarise
from glotouch_bt.robot import BadInput


def row(objects: int, area: float, seed: int, travel_m: float) -> dict[str, object]:
    return {
        "objects": objects, "area": area, "seed": seed, "ended": "complete", "found": objects, "travel_m": travel_m,
        "contacts": 7 * objects, "planning_s": 0.1, "plans": 4, "longest_plan_s": 0.05, "cause": "",
    }  # fmt: skip


def test_slopes_are_those_of_a_power_law() -> None:
    rows = [row(o, a, s, 2.0 * o**0.7 * a**0.4) for o, a in POINTS for s in (1, 2)]
    found = summarise(rows)["slopes"]
    assert found["travel_m"] == pytest.approx({"objects": 0.7, "area": 0.4})
    assert found["contacts"] == pytest.approx({"objects": 1.0, "area": 0.0}, abs=1e-9)


def test_a_slope_needs_complete_explorations() -> None:
    rows = [row(5, 1.0, 1, 2.0), failed_row(10, 2.0, 1, BadInput("no room"))]
    assert np.isnan(slopes(rows, "travel_m")["area"])


@pytest.mark.study
def test_all_objects_are_found_in_a_larger_box(tmp_path: Path) -> None:
    found = growth_row(GrowthCampaign(seeds=(1,), out=tmp_path, policy="nearest_frontier"), 6, 1.5, 1)
    assert (found["ended"], found["found"]) == ("complete", 6)
    assert found["plans"] > 1
    assert found["longest_plan_s"] <= found["planning_s"]


def test_an_unknown_policy_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="search policy"):
        GrowthCampaign(seeds=(1,), out=tmp_path, policy="nearest")
