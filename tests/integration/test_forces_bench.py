"""`bench forces` in MuJoCo: a joint that leaves its setpoint, and a backend that does not know the true force."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from glotouch_bt.cli import app


@pytest.mark.study
def test_a_part_of_the_matrix(tmp_path: Path) -> None:
    words = ["bench", "forces", "--following", "--moment", "draw", "--joint", "6", "--workers", "1"]
    done = CliRunner().invoke(app, [*words, "--out", str(tmp_path / "a"), "--json"])
    assert done.exit_code == 0, done.output
    summary = json.loads(done.stdout)
    assert summary["trials"] == 8
    assert summary["no_result"]["rate"] == summary["false_success"]["rate"] == 0.0
    assert summary["largest_peak_force_N"] > summary["undisturbed"][0]["peak_force_N"]


def test_a_backend_without_the_truth_is_refused(tmp_path: Path) -> None:
    words = ["bench", "forces", "--mission", "calibrate", "--backend", "fake", "--trials", "1", "--workers", "1"]
    done = CliRunner().invoke(app, [*words, "--out", str(tmp_path / "b")])
    assert done.exit_code == 2
    assert "does not know the true force" in done.stderr
