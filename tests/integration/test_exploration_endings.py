"""Explorations that cannot end as expected end all the same, with the reason: in MuJoCo, as from the command line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from glotouch_bt.runs.launch import RunRequest, RunResult, launch
from tests.integration.conftest import BLOCK_M

OUTSIDE = [0.0, 0.30, 0.0]
"""On the table beside the container."""


def survey(objects: Path, out: Path, place: list[float], expected: int) -> RunResult:
    settings = {"layout": json.dumps({"block": place}), "expected_objects": str(expected)}
    return launch(RunRequest("survey", seed=5, settings=settings, objects=objects, out=out))


@pytest.mark.study
def test_an_empty_container_is_searched_and_said_to_be_empty(block: Path, tmp_path: Path) -> None:
    done = survey(block, tmp_path / "run", OUTSIDE, 1)
    assert (done.exit_code, done.result["status"]) == (1, "failure")
    assert any("search_exhausted" in r for r in done.result["reasons"]), done.result["reasons"]
    assert done.result["candidates"] == []
    assert done.result["probe_path_m"] < 12.0, (
        "the search, also close to the walls and for small objects, looks at the probe, and the way back to its holder"
    )


@pytest.mark.parametrize("yaw", [pytest.param(0.0, marks=pytest.mark.study), 0.4])
def test_an_object_against_a_wall_is_found(block: Path, tmp_path: Path, yaw: float) -> None:
    """Two millimetres from the wall the ball cannot go round it; what can be touched says where it is."""
    reach = 0.5 * (BLOCK_M[0] * np.cos(yaw) + BLOCK_M[1] * np.sin(yaw))
    x = 0.15 - 0.002 - float(reach)
    done = survey(block, tmp_path / "run", [x, 0.02, yaw], 1)
    assert done.result["status"] == "success", done.result["reasons"]
    (candidate,) = done.result["candidates"]
    off = np.array(candidate["contour"]["centre_K_m"]) - (x, 0.02)
    assert float(np.hypot(*off)) < 0.012
    assert candidate["height_m"] == pytest.approx(BLOCK_M[2], abs=0.002)


@pytest.mark.study
def test_an_object_in_a_corner_ends(block: Path, tmp_path: Path) -> None:
    x, y = 0.15 - 0.002 - 0.5 * BLOCK_M[0], 0.2 - 0.002 - 0.5 * BLOCK_M[1]
    done = survey(block, tmp_path / "run", [x, y, 0.0], 1)
    assert done.result["status"] in ("success", "failure")
    assert done.exit_code in (0, 1)
    assert done.result["probe_path_m"] < 8.0
