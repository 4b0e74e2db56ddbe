"""`bench space` with real missions in MuJoCo."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from glotouch_bt.bench import space


@pytest.mark.study
def test_one_seed_for_real(tmp_path: Path) -> None:
    """Most objects are pushed and carried, stand, and are where the map says."""
    campaign = space.SpaceCampaign(seeds=(2,), out=tmp_path)
    with ThreadPoolExecutor(1) as pool:
        summary = space.run_campaign(campaign, pool)
    for act in space.ACTS:
        assert not summary[act]["worlds_failed"]
        assert summary[act]["asked"] == 5
        assert summary[act]["done"]["rate"] >= 0.6
        assert summary[act]["position_error_mm"]["max"] < 8.0
        assert summary[act]["toppled"]["rate"] == 0.0
    assert json.loads((tmp_path / "summary.json").read_text())["clear"] == summary["clear"]
    assert len((tmp_path / "trials.csv").read_text().splitlines()) == 11
