"""Run folders: a real run's files changed as data, as bytes and as links; listed, reported, replayed and resumed."""

from __future__ import annotations

import json
import os
import shutil
import sqlite3
import struct
import tempfile
from collections.abc import Callable
from contextlib import closing, suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import zstandard

from glotouch_bt.mission.checkpoint import CHECKPOINT_FILE, CheckpointFile
from glotouch_bt.mission.execution import Control
from glotouch_bt.report import write_report
from glotouch_bt.robot import BadInput, GlotouchError
from glotouch_bt.runs import RunRequest, launch, resume
from glotouch_bt.runs.replay import replay, replay_decisions
from glotouch_bt.validation.fuzz.corrupt import ODD_VALUES, corrupt_bytes, corrupt_data
from glotouch_bt.validation.fuzz.documents import pick
from glotouch_bt.validation.fuzz.kind import Class, FuzzKind, refused
from glotouch_bt.validation.fuzz.watch import CANARY

Rng = np.random.Generator
RUN, VICTIM = "run", "victim"
BACKENDS = ("fake", "fake", "fake", "mujoco")
"""Backends of the base runs; opening MuJoCo takes a second."""
BASE_CYCLES, RESUMED_CYCLES = 120, 5
"""Control periods of a base run and of a resumed one. A record has its observations in batches of 50."""
ODD_SETTINGS = ("python", "driver", "log", "keys", "devices", "robot", "layout", "trace", "")
ODD_NUMBERS = (0, 1, -1, 2**31 - 1, -(2**31), 2**63 - 1, 1e308, float("nan"), float("inf"), -0.0)
DAMAGED = (sqlite3.Error, OSError, LookupError, TypeError, ValueError, zstandard.ZstdError, msgspec.MsgspecError)
"""Errors of a second change of a file that the first one damaged."""
ODD_SQL = (
    "DROP TABLE run", "DELETE FROM run WHERE key = 'request'", "DELETE FROM checkpoint WHERE number = 0",
    "CREATE VIEW v AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c) SELECT x FROM c",
    "CREATE TRIGGER t AFTER DELETE ON checkpoint BEGIN DELETE FROM run; END",
    "ALTER TABLE run ADD COLUMN more TEXT", "PRAGMA user_version = 7", "PRAGMA application_id = 1",
    "UPDATE checkpoint SET state = zeroblob(100)", "UPDATE checkpoint SET begun = zeroblob(9)",
    "UPDATE run SET value = zeroblob(1000)",
)  # fmt: skip


class RunKind(FuzzKind):
    """The folder of a run that was stopped."""

    name = "runs"
    description = "run folders, listed, reported, replayed and resumed"
    writes = True

    def prepare(self, folder: Path) -> None:
        """Make the base runs."""
        _victim()
        for backend in set(BACKENDS):
            _base(backend)
            with suppress(GlotouchError):
                write_report(_base(backend))
                replay(_base(backend))

    def make(self, rng: Rng, folder: Path) -> str:
        """See `FuzzKind`."""
        run = folder / RUN
        shutil.rmtree(run, ignore_errors=True)
        shutil.copytree(_base(pick(rng, BACKENDS)), run)
        sorts = set()
        for _ in range(int(rng.integers(1, 3))):
            sort = pick(rng, tuple(CHANGES))
            with suppress(*DAMAGED):  # by the change before
                CHANGES[sort](run, rng)
            sorts.add(sort)
            if sort == "links":  # a change of a linked file would change what it points to
                break
        return min(sorts)

    def attempt(self, sort: str, folder: Path, rng: Rng) -> tuple[Class, str]:
        """See `FuzzKind`."""
        run = folder / RUN
        came: tuple[Class, str] = ("accepted", "")
        for command in (_list, write_report, replay, replay_decisions, _resume):
            try:
                command(run)
            except BadInput as e:
                came = refused(e)
            except GlotouchError as e:
                came = ("stopped by a fault", str(e))
            if came[0] == "traceback":
                return came
        if _victim().read_text() != VICTIM:
            _victim().write_text(VICTIM)
            return "code run", "a file outside was changed through a link"
        return came


@lru_cache(maxsize=2)
def _base(backend: str) -> Path:
    """Return the folder of a run that was stopped in its first cycles."""
    folder = Path(tempfile.mkdtemp(prefix="glotouch-fuzz-base-")) / RUN
    launch(RunRequest("calibrate", backend=backend, seed=1, out=folder), control=_StopsAfter(BASE_CYCLES))
    return folder


class _StopsAfter(Control):
    """Stops the mission after some control periods."""

    def __init__(self, periods: int) -> None:
        super().__init__()
        self._left = periods

    def wants_pause(self, ticks: int, now_s: float) -> bool:
        """Count the period (see `Control`)."""
        self._left -= 1
        if self._left <= 0:
            self.stop("enough")
        return False


@lru_cache(maxsize=1)
def _victim() -> Path:
    """Return a file outside of every run's folder."""
    path = Path(tempfile.mkdtemp(prefix="glotouch-fuzz-")) / VICTIM
    path.write_text(VICTIM)
    return path


def _list(run: Path) -> None:
    file = CheckpointFile(run / CHECKPOINT_FILE)
    with closing(file):
        file.rows()
        repr(file.run)


def _resume(run: Path) -> None:
    """Resume the run, and stop it after some periods.

    Raises:
        BadInput: It was refused.
        Exception: A tick raised what no restored state may make it raise.
    """
    done = resume(run, control=_StopsAfter(RESUMED_CYCLES))
    error = done.outcome.error
    if error is not None and not isinstance(error, GlotouchError):
        raise error


# -- changes -----------------------------------------------------------------------------------------------------------


def _change_bytes(name: str) -> Callable[[Path, Rng], None]:
    def change(run: Path, rng: Rng) -> None:
        path = run / name
        data = path.read_bytes()
        start = int(rng.integers(len(data) + 1)) if rng.random() < 0.8 else 0
        part = data[start : start + 200]
        path.write_bytes(data[:start] + corrupt_bytes(part, rng) + data[start + 200 :])

    return change


def _change_json(name: str) -> Callable[[Path, Rng], None]:
    def change(run: Path, rng: Rng) -> None:
        path = run / name
        path.write_text(
            _text(corrupt_data(json.loads(path.read_text()), rng)), encoding="utf-8", errors="surrogatepass"
        )

    return change


def _text(value: object) -> str:
    try:
        return json.dumps(value)
    except (TypeError, ValueError, RecursionError):
        return "[" * 5000


def _change_description(run: Path, rng: Rng) -> None:
    """Change the run's own description in its checkpoints: its request, mission, conditions."""
    with closing(sqlite3.connect(run / CHECKPOINT_FILE)) as db, db:
        found = {k: json.loads(v) for k, v in db.execute("SELECT key, value FROM run")}
        if rng.random() < 0.5:
            key = pick(rng, (*found["request"], "settings"))
            value = pick(rng, (*ODD_VALUES[:30], "/etc/shadow", "flexiv_xense", "../../x.yaml", CANARY))
            if key == "settings":
                value = {pick(rng, ODD_SETTINGS): str(value)}
            found["request"][key] = value
        else:
            found = corrupt_data(found, rng)
        if isinstance(found, dict):
            db.executemany("INSERT OR REPLACE INTO run VALUES (?, ?)", [(str(k), _text(v)) for k, v in found.items()])


def _change_row(run: Path, rng: Rng) -> None:
    """Put an odd value into a column of a checkpoint."""
    column = pick(rng, ("number", "stamp_s", "node", "status", "begun", "lacking", "record_bytes", "state", "world"))
    value = pick(rng, (*(v for v in ODD_VALUES if isinstance(v, (int, float, str)) and v != 10**400 and v != 10**30),
                       b"\xff", b"", '["a"]', "{}", '{"a": 1}', zstandard.compress(bytes(200_000_000))))  # fmt: skip
    with closing(sqlite3.connect(run / CHECKPOINT_FILE)) as db, db:
        db.execute(f"UPDATE checkpoint SET {column} = ? WHERE number = (SELECT max(number) FROM checkpoint)", (value,))


def _change_values(column: str) -> Callable[[Path, Rng], None]:
    """Change the encoded state of mission or world: as MessagePack data, or as its bytes."""

    def change(run: Path, rng: Rng) -> None:
        with closing(sqlite3.connect(run / CHECKPOINT_FILE)) as db, db:
            query = f"SELECT number, {column} FROM checkpoint WHERE {column} IS NOT NULL ORDER BY number DESC LIMIT 1"
            row = db.execute(query).fetchone()
            if row is None:
                return
            data = zstandard.decompress(row[1])
            if rng.random() < 0.2:
                at = int(rng.integers(len(data)))
                data = data[:at] + corrupt_bytes(data[at : at + 40], rng) + data[at + 40 :]
            else:
                plain = msgspec.msgpack.decode(data)
                for _ in range(int(rng.integers(1, 4))):
                    _change_place(plain, rng)
                data = msgspec.msgpack.encode(plain)
            db.execute(f"UPDATE checkpoint SET {column} = ? WHERE number = ?", (zstandard.compress(data), row[0]))

    return change


def _change_place(plain: Any, rng: Rng) -> None:
    """Change one value somewhere inside nested lists."""
    places = []
    stack = [plain]
    while stack:
        here = stack.pop()
        places += [(here, i) for i in range(len(here))]
        stack += [v for v in here if isinstance(v, list)]
    holder, i = pick(rng, places)
    value = holder[i]
    if isinstance(value, bytes) and len(value) >= 8 and rng.random() < 0.8:
        at = 8 * int(rng.integers(len(value) // 8))
        odd = struct.pack("<d", pick(rng, ODD_NUMBERS)) if rng.random() < 0.5 else struct.pack("<ii", *_two(rng))
        holder[i] = value[:at] + odd + value[at + 8 :]
    else:
        holder[i] = pick(rng, (None, True, "", "x", b"", [], ["r", 0], ["t"], ["l", ["r", 1]], *ODD_NUMBERS, value))
        if rng.random() < 0.2:
            del holder[i]


def _two(rng: Rng) -> tuple[int, int]:
    return pick(rng, (-(2**31), -2, 0, 5, 99_999, 2**31 - 1)), pick(rng, (-1, 1, 2**31 - 1))


def _change_chunks(run: Path, rng: Rng) -> None:
    """Change the content of one chunk of the record, or let it be a bomb; all lengths stay right."""
    data = (run / "run.mcap").read_bytes()
    chunks = []
    at = 8
    while at + 9 <= len(data):
        code, size = data[at], int.from_bytes(data[at + 1 : at + 9], "little")
        if code == 6 and at + 9 + size <= len(data):
            chunks.append((at, size))
        at += 9 + size
    if not chunks:
        return
    at, size = pick(rng, chunks)
    body = data[at + 9 : at + 9 + size]
    word = int.from_bytes(body[28:32], "little")
    inside = zstandard.decompress(body[32 + word + 8 :], max_output_size=10_000_000)
    if rng.random() < 0.1:
        inside = bytes(int(pick(rng, (0, 1000, 100_000_000))))
    else:
        start = int(rng.integers(len(inside) + 1))
        inside = inside[:start] + corrupt_bytes(inside[start : start + 60], rng) + inside[start + 60 :]
    packed = zstandard.compress(inside)
    stated = len(inside) if rng.random() < 0.9 else pick(rng, (0, 2**40, 2**63))
    body = (
        body[:16]
        + struct.pack("<Q", stated)
        + bytes(4)
        + body[28 : 32 + word]
        + struct.pack("<Q", len(packed))
        + packed
    )
    (run / "run.mcap").write_bytes(data[:at] + b"\x06" + struct.pack("<Q", len(body)) + body + data[at + 9 + size :])


def _change_tables(run: Path, rng: Rng) -> None:
    with closing(sqlite3.connect(run / CHECKPOINT_FILE)) as db, db:
        db.execute(pick(rng, ODD_SQL))


def _link(run: Path, rng: Rng) -> None:
    """Put a link, a pipe or a folder in place of a file."""
    names = [p.name for p in run.iterdir()]
    parts = [f".{n}.part" for n in names]
    name = pick(rng, (*names, *parts, "earlier", "models", f"{CHECKPOINT_FILE}-wal", f"{CHECKPOINT_FILE}-journal"))
    path = run / name
    path.unlink(missing_ok=True)
    how = rng.random()
    if how < 0.7:
        path.symlink_to(_victim() if name not in ("earlier", "models") else _victim().parent)
    elif how < 0.8:
        os.mkfifo(path)
    else:
        path.mkdir()


CHANGES: dict[str, Callable[[Path, Rng], None]] = {
    "checkpoint bytes": _change_bytes(CHECKPOINT_FILE),
    "description": _change_description,
    "links": _link,
    "mission": _change_bytes("mission.yaml"),
    "record": _change_bytes("run.mcap"),
    "record chunks": _change_chunks,
    "result": _change_json("result.json"),
    "result bytes": _change_bytes("result.json"),
    "row": _change_row,
    "state": _change_values("state"),
    "tables": _change_tables,
    "world": _change_values("world"),
}
