"""`glotouch resume` as a person types it, on a robot without physics: after kill -9, Ctrl-C, a stop; its refusals."""

from __future__ import annotations

import json
import os
import random
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from typer.testing import CliRunner

from glotouch_bt import cli
from glotouch_bt.mission.checkpoint.store import CHECKPOINT_FILE
from glotouch_bt.report import read_run
from tests.support import fake_cli

FAKE_CLI = Path(__file__).parents[2] / "support" / "fake_cli.py"
HEAD = "mission: m\nworld: container_five\nparameters:\n  end: {type: str, default: ok}\n"
TREE = """tree:
  sequence:
    - wait: {name: first, seconds: 0.5}
    - retry:
        attempts: 2
        do: {wait: {name: second, seconds: 20.0, end: $end}}
    - repeat:
        times: 3
        do: {wait: {name: third, seconds: 8.0}}
    - wait: {name: last, seconds: 0.5}
"""
DIFFERS = ("wall_time_s", "wall_open_s", "resumed")


def glotouch(*words: object) -> Any:
    """In this process: starting one takes longer than the mission."""
    with pytest.MonkeyPatch.context() as patch:
        fake_cli.install_fakes(patch.setattr)
        done = CliRunner().invoke(cli.app, [str(w) for w in words])
    return SimpleNamespace(returncode=done.exit_code, stdout=done.stdout, stderr=done.stderr)


def started(*words: object) -> subprocess.Popen[bytes]:
    """A process of its own, to be killed."""
    command = [sys.executable, FAKE_CLI, *map(str, words)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


@pytest.fixture(scope="module")
def mission(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("mission") / "m.yaml"
    path.write_text(HEAD + TREE)
    return path


@pytest.fixture(scope="module")
def twin(mission: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("twin") / "run"
    done = glotouch("run", mission, "--seed", 4, "--out", folder)
    assert done.returncode == 0, done.stderr
    return folder


def told(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "result.json").read_text())
    return found


def checkpoints(folder: Path) -> int:
    try:
        with sqlite3.connect(f"file:{folder / CHECKPOINT_FILE}?mode=ro", uri=True) as db:
            count: int = db.execute("SELECT count(*) FROM checkpoint").fetchone()[0]
    except sqlite3.Error:
        return 0
    return count


def broken_off(mission: Path, folder: Path, how: signal.Signals, after: int, more_s: float = 0.0) -> None:
    """Run until there are `after` checkpoints and a little longer, then send a signal."""
    process = started("run", mission, "--seed", 4, "--out", folder)
    while process.poll() is None and checkpoints(folder) < after:
        time.sleep(0.002)
    time.sleep(more_s)
    process.send_signal(how)
    process.communicate()


def same_as_twin(folder: Path, twin: Path) -> None:
    mine, theirs = told(folder), told(twin)
    assert {k: v for k, v in mine.items() if k not in DIFFERS} == {k: v for k, v in theirs.items() if k not in DIFFERS}
    a, b = read_run(folder), read_run(twin)
    assert a.complete
    assert all(a.samples[k].tobytes() == b.samples[k].tobytes() for k in b.samples)
    assert (a.ticks, a.events, a.ports) == (b.ticks, b.events, b.ports)


@pytest.mark.parametrize(("after", "how"), [(2, signal.SIGKILL), (4, signal.SIGINT)])
def test_a_run_that_was_broken_off_ends_as_its_twin_to_the_bit(
    mission: Path, twin: Path, tmp_path: Path, after: int, how: signal.Signals
) -> None:
    """Results and records, whatever the moment; what it replaces is kept; and then there is nothing left to resume."""
    folder = tmp_path / "run"
    broken_off(mission, folder, how, after, random.Random(after).uniform(0.0, 0.1))
    read_run(folder)
    assert (folder / "result.json").exists() == (how is signal.SIGINT)
    done = glotouch("resume", folder)
    assert done.returncode == 0, done.stderr
    assert "checkpoint" in done.stderr
    same_as_twin(folder, twin)
    [resumed] = told(folder)["resumed"]
    assert resumed["checkpoint"] >= after - 1
    assert (folder / "earlier" / "1" / "run.mcap").is_file()
    assert not list(folder.glob(".*"))
    again = glotouch("resume", folder)
    assert again.returncode == 2
    assert "has ended (reached its goal)" in again.stderr


def test_a_run_killed_after_its_last_skill_and_before_its_result_is_gone_on_with(
    mission: Path, twin: Path, tmp_path: Path
) -> None:
    """Its last checkpoint is there, its result is not: the tree is brought to its end again."""
    folder = tmp_path / "run"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("glotouch_bt.runs.folder.RunFolder.write_json", _killed)
        assert glotouch("run", mission, "--seed", 4, "--out", folder).returncode == 3
    assert not (folder / "result.json").exists()
    done = glotouch("resume", folder)
    assert done.returncode == 0, done.stderr
    same_as_twin(folder, twin)


def test_a_record_that_is_lost_is_said_to_be_on_the_terminal(mission: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("glotouch_bt.runs.folder.RunFolder.write_json", _killed)
        glotouch("run", mission, "--seed", 4, "--out", folder)
    (folder / "run.mcap").unlink()
    (folder / "run.mcap").mkdir()
    assert "cannot be moved to 'earlier'" in glotouch("resume", folder).stderr
    (folder / "run.mcap").rmdir()
    assert "note: the record does not hold what was before the checkpoint" in glotouch("resume", folder).stderr


def _killed(*told: object) -> None:
    raise RuntimeError("here")


def test_a_resumed_run_may_be_killed_too(mission: Path, twin: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    broken_off(mission, folder, signal.SIGKILL, 1)
    process = started("resume", folder)
    before = checkpoints(folder)
    while process.poll() is None and checkpoints(folder) <= before:
        time.sleep(0.002)
    process.kill()
    process.communicate()
    done = glotouch("resume", folder, "--json")
    assert done.returncode == 0, done.stderr
    same_as_twin(folder, twin)
    assert len(json.loads(done.stdout)["resumed"]) == 2


def test_a_stopped_run_starts_the_skill_again(mission: Path, tmp_path: Path) -> None:
    """A simulated world repeats itself: so does its safety stop, with the same exit code."""
    folder = tmp_path / "run"
    first = glotouch("run", mission, "--seed", 4, "--set", "end=stop", "--out", folder)
    assert first.returncode == 3
    again = glotouch("resume", folder)
    assert again.returncode == 3
    assert told(folder)["reason_chain"][-1]["code"] == "safety_stop"
    assert len(told(folder)["resumed"]) == 1
    listed = json.loads(glotouch("resume", folder, "--list", "--json").stdout)
    assert listed["ended"] == "aborted"
    assert [c["node"].rsplit("/", 1)[-1] for c in listed["checkpoints"]] == ["", "first"]


def test_a_run_starts_at_a_node(mission: Path, twin: Path, tmp_path: Path) -> None:
    """In a copy, from the last time it began; the copy says where it comes from, the run itself is left alone."""
    before = {p.name: p.read_bytes() for p in twin.iterdir() if p.name.endswith((".json", ".mcap"))}
    out = tmp_path / "copy"
    done = glotouch("resume", twin, "--from", "third", "--out", out)
    assert done.returncode == 0, done.stderr
    result = told(out)
    assert result["status"] == "success"
    assert result["resumed"][-1]["start"] == "m/sequence/repeat/third"
    assert result["sim_time_s"] == told(twin)["sim_time_s"], "it went on with the third pass of three"
    first = [t for t in read_run(out).ticks if t.node.endswith("third") and t.new == "RUNNING"]
    assert len(first) == 3
    assert {p.name: p.read_bytes() for p in twin.iterdir() if p.name.endswith((".json", ".mcap"))} == before
    assert glotouch("resume", twin, "--from", "second", "--out", out).returncode == 2, "not empty"


def test_the_mission_s_file_may_be_gone_or_have_changed(mission: Path, tmp_path: Path) -> None:
    mine = tmp_path / "mine.yaml"
    mine.write_text(mission.read_text())
    for n, damage in enumerate((mine.unlink, lambda: mine.write_text("mission: other\n"))):
        mine.write_text(mission.read_text())
        folder = tmp_path / f"run{n}"
        assert glotouch("run", mine, "--set", "end=stop", "--out", folder).returncode == 3
        damage()
        done = glotouch("resume", folder)
        assert done.returncode == 3, done.stderr
        assert told(folder)["reason_chain"][-1]["code"] == "safety_stop"


def test_a_run_that_is_under_way_is_left_alone(mission: Path, tmp_path: Path) -> None:
    """A second process neither resumes it nor runs over it; when it is dead, it may."""
    folder = tmp_path / "run"
    process = started("run", mission, "--seed", 4, "--out", folder)
    while process.poll() is None and checkpoints(folder) < 1:
        time.sleep(0.002)
    process.send_signal(signal.SIGSTOP)
    copied = ("resume", folder, "--out", tmp_path / "copy")
    for words in (("resume", folder), ("run", mission, "--out", folder), copied):
        done = glotouch(*words)
        assert done.returncode == 2
        assert "a run is under way" in done.stderr
    process.kill()
    process.communicate()
    assert glotouch("resume", folder).returncode == 0


def refused(*words: object) -> str:
    done = glotouch("resume", *words)
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    assert done.stderr.count("\n") == 1, done.stderr
    return done.stderr


def test_what_cannot_be_resumed_is_one_message(twin: Path, tmp_path: Path) -> None:
    assert "no run here" in refused(tmp_path / "nowhere")
    assert "no run here" in refused(tmp_path)
    recorded = tmp_path / "recorded"
    recorded.mkdir()
    (recorded / "run.mcap").write_bytes(b"")
    assert "no checkpoint here" in refused(recorded)
    assert "did you mean 'third'" in refused(twin, "--from", "thrid", "--out", tmp_path / "x")
    copy = tmp_path / "copy"
    copy.mkdir()
    (copy / CHECKPOINT_FILE).write_bytes((twin / CHECKPOINT_FILE).read_bytes())
    with sqlite3.connect(copy / CHECKPOINT_FILE) as db:
        db.execute("UPDATE run SET value = '{}' WHERE key = 'mission'")
    db.close()
    assert "cannot be loaded again" in refused(copy, "--from", "third")
    with sqlite3.connect(copy / CHECKPOINT_FILE) as db:
        db.execute("DELETE FROM checkpoint")
        db.execute("UPDATE run SET value = 'null' WHERE key = 'ended'")
    db.close()
    assert "before its first checkpoint" in refused(copy)
    assert not (tmp_path / "x").exists()
    assert os.listdir(copy) == [CHECKPOINT_FILE] or set(os.listdir(copy)) <= {
        CHECKPOINT_FILE,
        f"{CHECKPOINT_FILE}-wal",
        f"{CHECKPOINT_FILE}-shm",
    }
