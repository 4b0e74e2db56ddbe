"""`bench contact` with real missions in MuJoCo."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from glotouch_bt.bench import contact


@pytest.mark.study
def test_one_seed_for_real(tmp_path: Path) -> None:
    """The bolted square by the probe is far better than the targets; the whole folder is written."""
    campaign = contact.ContactCampaign(seeds=(1,), per_side=3, out=tmp_path)
    with ThreadPoolExecutor(1) as pool:
        summary = contact.run_campaign(campaign, pool)
    assert summary["probe"]["traced"]["rate"] == 1.0, summary["not_traced"]
    assert summary["probe"]["centre_error_mm"]["mean"] < 0.3
    assert summary["probe"]["contact_rms_mm"]["mean"] < 0.6
    assert summary["probe"]["tip_after_mm"]["mean"] < 0.1 < summary["probe"]["tip_before_mm"]["mean"]
    assert summary["free"]["probe"]["displacement_mm"]["mean"] < 10.0
    assert json.loads((tmp_path / "summary.json").read_text())["probe"] == summary["probe"]
    assert (tmp_path / "traces.png").stat().st_size > 1000
    assert (tmp_path / "errors.png").stat().st_size > 1000
