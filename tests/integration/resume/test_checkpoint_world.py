"""A mission in MuJoCo that is broken off and resumed ends as its twin, to the bit: world, arm, probe, record."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from glotouch_bt.mission.record.run_summary import RunSummary
from glotouch_bt.report import read_run
from glotouch_bt.runs.launch import RunRequest, launch
from glotouch_bt.runs.resume import resume

MISSION = """mission: fetch
world: container_five
tree:
  sequence:
    - tool_pickup
    - retry: {attempts: 2, do: tool_return}
"""
DIFFERS = ("wall_time_s", "wall_open_s", "resumed")


@pytest.fixture(scope="module")
def mission(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("mission") / "fetch.yaml"
    path.write_text(MISSION)
    return path


@pytest.fixture(scope="module")
def cached(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Hulls computed here stay here."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


def request(mission: Path, out: Path) -> RunRequest:
    return RunRequest(mission=str(mission), seed=6, out=out, report=False)


def broken_off_at(stamp_s: float) -> Callable[[float, RunSummary], None]:
    def look(robot_s: float, summary: RunSummary) -> None:
        if robot_s >= stamp_s:
            raise KeyboardInterrupt

    return look


def told(folder: Path) -> dict[str, Any]:
    result = json.loads((folder / "result.json").read_text())
    return {k: v for k, v in result.items() if k not in DIFFERS}


@pytest.fixture(scope="module")
def twin(mission: Path, cached: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("twin") / "run"
    done = launch(request(mission, folder))
    assert done.outcome.status == "success", done.outcome.reasons
    return folder


@pytest.mark.parametrize("stamp_s", [4.0, 16.0])
def test_it_ends_as_its_twin(mission: Path, twin: Path, tmp_path: Path, stamp_s: float) -> None:
    """Broken off before the first skill ended (the probe half drawn), and on the way back with it."""
    folder = tmp_path / "run"
    first = launch(request(mission, folder), on_progress=broken_off_at(stamp_s))
    assert first.exit_code == 130
    done = resume(folder, report=False)
    assert done.outcome.status == "success"
    assert told(folder) == told(twin)
    assert json.loads((folder / "truth.json").read_text()) == json.loads((twin / "truth.json").read_text())
    mine, theirs = read_run(folder), read_run(twin)
    assert mine.complete
    for name, column in theirs.samples.items():
        assert mine.samples[name].tobytes() == column.tobytes(), name
    assert (mine.events, mine.ticks, mine.ports) == (theirs.events, theirs.ticks, theirs.ports)
