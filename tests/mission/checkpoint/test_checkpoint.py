"""checkpoint.sqlite: what is written is read back, survives kill -9, and nothing else is taken for it."""

from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zstandard

from glotouch_bt.mission.checkpoint.codec import encode
from glotouch_bt.mission.checkpoint.store import CHECKPOINT_FILE, CheckpointFile, CheckpointRow
from glotouch_bt.mission.record.mcap_chunks import read_chunks
from glotouch_bt.mission.record.recorder import Recorder
from glotouch_bt.report.run_record import read_run
from glotouch_bt.robot import HOLD, BadInput, GlotouchError, GripperState, Observation


def row(number: int, **fields: Any) -> CheckpointRow:
    given = {"stamp_s": 1.5 * number, "node": f"m/step {number}", "status": "SUCCESS", "begun": ("m/a", "m/b")}
    given |= {"lacking": {}, "record_bytes": 100 * number, "has_world": False} | fields
    return CheckpointRow(number, **given)


@pytest.fixture
def file(tmp_path: Path) -> CheckpointFile:
    return CheckpointFile.create(tmp_path / CHECKPOINT_FILE, {"seed": 3, "request": {"mission": "m"}})


def test_rows_states_and_worlds_come_back(file: CheckpointFile) -> None:
    state, world = {"port x": np.arange(3.0), "ticks": 4}, {"data": {"qpos": np.ones(2)}}
    rows = [row(0), row(1, has_world=True, lacking={"port y": "a reason"}, record_bytes=None)]
    file.add(rows[0], encode(state), None)
    file.add(rows[1], encode({}), encode(world))
    file.note("ended", "success")
    file.close()
    again = CheckpointFile(file.path)
    assert again.rows() == rows
    assert again.run == {"seed": 3, "request": {"mission": "m"}, "ended": "success"}
    assert np.array_equal(again.state(0)["port x"], state["port x"])
    assert again.world(0) is None
    assert np.array_equal(again.world(1)["data"]["qpos"], np.ones(2))  # type: ignore[index]
    again.begin_again(0, [])
    assert again.rows() == rows[:1]
    again.close()


def test_a_closed_file_is_the_whole_and_a_copy_of_an_open_one_too(file: CheckpointFile, tmp_path: Path) -> None:
    file.add(row(0), encode({"ticks": 1}), None)
    file.copy_to(tmp_path / "copy.sqlite")
    file.close()
    assert not file.path.with_name(f"{CHECKPOINT_FILE}-wal").exists()
    for path in (file.path, tmp_path / "copy.sqlite"):
        again = CheckpointFile(path)
        assert again.state(0) == {"ticks": 1}
        again.close()


def test_a_killed_writer_leaves_every_row_it_had_written(tmp_path: Path) -> None:
    """kill -9 right after the last transaction; the file is also written to again afterwards."""
    script = f"""
        import os, signal
        from pathlib import Path
        from glotouch_bt.mission.checkpoint import CheckpointFile, CheckpointRow
        from glotouch_bt.mission.checkpoint import encode
        file = CheckpointFile.create(Path({str(tmp_path / CHECKPOINT_FILE)!r}), {{}})
        for n in range(7):
            row = CheckpointRow(n, 0.1 * n, "", "", (), {{}}, None, False)
            file.add(row, encode({{"n": n, "x": b"x" * 20000}}), None)
        os.kill(os.getpid(), signal.SIGKILL)
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], check=False)
    assert done.returncode == -signal.SIGKILL
    file = CheckpointFile(tmp_path / CHECKPOINT_FILE)
    assert [r.number for r in file.rows()] == list(range(7))
    assert file.state(6)["n"] == 6
    file.add(row(7), encode({}), None)
    assert len(file.rows()) == 8
    file.close()


@pytest.mark.parametrize("content", [b"", b"not a database", b"SQLite format 3\0" + b"\0" * 200])
def test_what_is_no_checkpoint_is_said_to_be_none(tmp_path: Path, content: bytes) -> None:
    (tmp_path / CHECKPOINT_FILE).write_bytes(content)
    with pytest.raises(BadInput, match=CHECKPOINT_FILE):
        CheckpointFile(tmp_path / CHECKPOINT_FILE)
    with pytest.raises(BadInput, match="no checkpoint here"):
        CheckpointFile(tmp_path / "nowhere" / CHECKPOINT_FILE)


def test_another_format_is_said_to_be_one(file: CheckpointFile) -> None:
    file.close()
    with sqlite3.connect(file.path) as db:
        db.execute("PRAGMA user_version = 99")
    db.close()
    with pytest.raises(BadInput, match="format is 99"):
        CheckpointFile(file.path)


@pytest.mark.parametrize("blob", [b"", b"rubbish", zstandard.compress(b"rubbish"), zstandard.compress(encode([1]))])
def test_a_damaged_row_is_refused_and_names_the_file(file: CheckpointFile, blob: bytes) -> None:
    file.add(row(0), encode({}), None)
    file.close()
    with sqlite3.connect(file.path) as db:
        db.execute("UPDATE checkpoint SET state = ?", (blob,))
    db.close()
    again = CheckpointFile(file.path)
    with pytest.raises(BadInput, match=CHECKPOINT_FILE):
        again.state(0)
    with pytest.raises(BadInput, match="no checkpoint 5"):
        again.state(5)
    again.close()


def test_a_folder_that_is_not_there_is_one_message(tmp_path: Path) -> None:
    with pytest.raises(GlotouchError, match="cannot be written"):
        CheckpointFile.create(tmp_path / "none" / CHECKPOINT_FILE, {})


def observation(now_s: float) -> Observation:
    rng = np.random.default_rng(round(now_s * 100))
    n = np.ones((10, 1))
    return Observation(
        stamp_s=now_s + 0.001 * np.arange(-9, 1),
        q=rng.random((10, 7)),
        dq=0.1 * n @ np.ones((1, 7)),
        position_B_P=rng.random((10, 3)),
        quat_B_P=np.tile([1.0, 0.0, 0.0, 0.0], (10, 1)),
        wrench_S=rng.random((10, 6)),
        gripper=GripperState(now_s, 0.03, 0.0, False),
    )


def write(recorder: Recorder, first: int, last: int, flushed: dict[int, tuple[int, dict[str, int]]]) -> None:
    """Cycles first..last with an event now and then; at every 70th a checkpoint flushes."""
    for k in range(first, last):
        now_s = 0.01 * (k + 1)
        recorder.block(observation(now_s), HOLD)
        if k % 13 == 0:
            recorder.event("note", now_s, {"text": f"cycle {k}"})
        if k % 70 == 69:
            flushed[k] = (recorder.flush(), recorder.state())


def test_a_record_that_goes_on_is_the_one_that_was_never_broken_off(tmp_path: Path) -> None:
    """Byte for byte; the first was cut off somewhere beyond the checkpoint."""
    run = {"mission": "m", "seed": 1}
    flushed: dict[int, tuple[int, dict[str, int]]] = {}
    with Recorder(tmp_path / "whole.mcap", run, batch_cycles=50) as whole:
        write(whole, 0, 400, flushed)
    data = (tmp_path / "whole.mcap").read_bytes()
    length, state = flushed[209]
    (tmp_path / "cut.mcap").write_bytes(data[: length + 1234])
    with Recorder(tmp_path / "again.mcap", run, batch_cycles=50) as again:
        again.continue_from(read_chunks(tmp_path / "cut.mcap", length), state)
        write(again, 210, 400, {})
    assert (tmp_path / "again.mcap").read_bytes() == data
    assert read_run(tmp_path / "again.mcap").complete
    with pytest.raises(BadInput, match="bytes"):
        list(read_chunks(tmp_path / "cut.mcap", length + 99_999))
    (tmp_path / "bad.mcap").write_bytes(data[:100] + b"\xff" * 300 + data[400:])
    with pytest.raises(BadInput):
        list(read_chunks(tmp_path / "bad.mcap", length))


def test_a_record_cut_off_at_any_byte_is_read_up_to_there(tmp_path: Path) -> None:
    with Recorder(tmp_path / "run.mcap", {"mission": "m"}, batch_cycles=50) as recorder:
        write(recorder, 0, 200, {})
    data = (tmp_path / "run.mcap").read_bytes()
    whole = read_run(tmp_path / "run.mcap")
    before = -1
    for size in sorted(np.random.default_rng(0).integers(100, len(data), 40).tolist()):
        (tmp_path / "cut.mcap").write_bytes(data[:size])
        cut = read_run(tmp_path / "cut.mcap")
        n = len(cut.samples.get("stamp_s", ()))
        assert n >= before, "never less than a shorter file gave"
        before = n
        assert not cut.complete
        if n:
            assert cut.samples["q"].tobytes() == whole.samples["q"][:n].tobytes()
    assert os.path.getsize(tmp_path / "cut.mcap")
