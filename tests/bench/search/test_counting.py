"""`bench search --count unknown`: figures of made-up rows, and a small campaign."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

from glotouch_bt.bench.search import CountCampaign, run_count_campaign
from glotouch_bt.bench.search.counting import MOMENTS, summarise_counts
from glotouch_bt.robot import BadInput


def a_row(seed: int, right: int, chance: float, moments: list[tuple[float, bool]]) -> dict[str, Any]:
    done = {"found": right, "right": right, "ended": "complete", "travel_m": 6.0}
    return {"seed": seed, "objects": 2, "known": done | {"right": 2}, "unknown": done | {"chance_left": chance},
            "moments": moments}  # fmt: skip


def test_figures_of_made_up_rows() -> None:
    rows = [a_row(0, 2, 0.04, [(0.9, True), (0.5, False)]), a_row(1, 1, 0.04, [(0.9, True), (0.5, True)])]
    out = summarise_counts(rows)
    assert (out["known"]["success"]["rate"], out["unknown"]["success"]["rate"]) == (1.0, 0.5)
    assert out["success_difference"]["mean"] == pytest.approx(-0.5)
    assert (out["left"]["share"]["rate"], out["left"]["stated"]["mean"]) == (0.5, pytest.approx(0.04))
    # Bins: 0.04 twice, 0.5 twice, 0.9 twice; half, half and all of them had something left.
    error = (2 * abs(0.5 - 0.04) + 2 * 0.0 + 2 * 0.1) / 6
    assert out["stated"]["calibration"]["value"] == pytest.approx(error)
    squares = [0.04**2, 0.96**2, 0.1**2, 0.1**2, 0.5**2, 0.5**2]
    assert out["stated"]["brier"]["mean"] == pytest.approx(np.mean(squares))


@pytest.mark.study
def test_a_campaign_states_a_chance_at_every_moment(tmp_path) -> None:
    campaign = CountCampaign(seeds=(300,), out=tmp_path / "out", left_below=0.5)
    rows: list[Any] = []
    with ThreadPoolExecutor(1) as pool:
        summary = run_count_campaign(campaign, pool, lambda row, done, total: rows.append(row))
    (row,) = rows
    chances = [p for p, _ in row["moments"]]
    assert len(chances) == MOMENTS
    assert all(0.0 <= p <= 1.0 for p in chances)
    assert row["unknown"]["chance_left"] < 0.5
    assert row["unknown"]["ended"] == "complete"
    assert summary["layouts"] == 1
    assert json.loads((campaign.out / "summary.json").read_text()) == summary
    assert len((campaign.out / "trials.csv").read_text().splitlines()) == 3


def test_bad_settings_are_named(tmp_path) -> None:
    with pytest.raises(BadInput, match="no_such"):
        CountCampaign(policy="no_such", seeds=(1,), out=tmp_path)
    with pytest.raises(BadInput, match="--planar"):
        CountCampaign(seeds=(), out=tmp_path)
