"""The file checkpoint.sqlite: one row per finished skill, with everything needed to continue from there.

SQLite in WAL mode, one transaction a row: a killed process leaves every row it has written. The content of a row is
compressed MessagePack (`codec`). The file may come from a stranger: it is read only if it holds exactly our two tables
and is of bounded size. `glotouch resume` reads the file, and so does any SQLite tool:

    sqlite3 checkpoint.sqlite 'SELECT number, stamp_s, node, status, length(state), length(world) FROM checkpoint'
"""

from __future__ import annotations

import json
import math
import sqlite3
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import zstandard

from glotouch_bt.mission.checkpoint.codec import decode
from glotouch_bt.robot import BadInput, GlotouchError
from glotouch_bt.untrusted import (
    create_file,
    open_file,
    parse_json,
    read_start,
    require_plain,
    require_type,
    unpack_zstd,
)

CHECKPOINT_FILE = "checkpoint.sqlite"
FORMAT = 2
_MARK = 0x474C4F54  # "GLOT", SQLite's application_id
_MARK_AT = 68
"""Offset of the application_id in an SQLite file, bytes."""
MAX_FILE_BYTES = 2_000_000_000
"""Largest file, and largest write-ahead log. Source: 10,000 checkpoints as this program writes them."""
MAX_ROWS = 100_000
"""Maximum number of checkpoints, and of items of `run`."""
MAX_VALUE_BYTES = 16_000_000
"""Largest value of a column. Source: 80 times the largest state this program writes."""
MAX_UNPACKED_BYTES = 64_000_000
"""Largest unpacked state or world. Source: 100 times the largest measured."""
MAX_OPEN_S = 20.0
"""Longest time for the checks of an existing file; a file of the largest size takes 5 s."""
_TABLES = """
CREATE TABLE run (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE checkpoint (
    number INTEGER PRIMARY KEY,  -- 0: before the first tick
    stamp_s REAL NOT NULL,       -- robot clock
    node TEXT NOT NULL,          -- path of the skill that ended
    status TEXT NOT NULL,        -- how
    begun TEXT NOT NULL,         -- JSON: nodes that began since the row before
    lacking TEXT NOT NULL,       -- JSON: {what: why it could not be kept}
    record_bytes INTEGER,        -- length of run.mcap up to here
    state BLOB NOT NULL,         -- tree, ports, arm, summary, reasons
    world BLOB                   -- the simulated world, or NULL
);
"""


@dataclass(frozen=True)
class CheckpointRow:
    """One checkpoint without its content.

    Attributes:
        number: Its number; 0 was taken before the first tick.
        stamp_s: Robot clock.
        node: Path of the skill that ended, or empty.
        status: Status it ended with.
        begun: Paths of the nodes that started since the previous row.
        lacking: Values that could not be saved, with the reason.
        record_bytes: Length of the record at that time, or None.
        has_world: It holds the state of a simulated world.
    """

    number: int
    stamp_s: float
    node: str
    status: str
    begun: tuple[str, ...]
    lacking: Mapping[str, str]
    record_bytes: int | None
    has_world: bool


class CheckpointFile:
    """The checkpoints of one run.

    Args:
        path: An existing file; `create` makes one.

    Raises:
        BadInput: It is not a checkpoint file, or of another format.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        log, journal = f"{path.name}-wal", f"{path.name}-journal"
        require_plain(path.parent, (path.name, log, f"{path.name}-shm", journal))
        if not path.is_file():
            raise BadInput(f"{path.parent}: no checkpoint here ({path.name} is missing)")
        if path.with_name(journal).exists():  # SQLite would delete the file that a journal names
            raise BadInput(
                f"{path.with_name(journal)}: this program leaves no such file beside a checkpoint; remove it"
            )
        for name in (path.name, log):
            if path.with_name(name).exists():
                open_file(path.with_name(name), MAX_FILE_BYTES, what="a checkpoint file").close()
        with self._errors():
            self._db = sqlite3.connect(path, timeout=5.0)
        try:
            with self._errors():
                self._require_ours()
                _configure(self._db)
        except BaseException:
            self._db.close()
            raise

    @staticmethod
    def is_one(path: Path) -> bool:
        """Return True if a file bears the mark of a checkpoint file."""
        return read_start(path, _MARK_AT + 4)[_MARK_AT:] == _MARK.to_bytes(4, "big")

    @classmethod
    def create(cls, path: Path, run: Mapping[str, object]) -> CheckpointFile:
        """Create the file of a run that JSON data describe; replace an existing one.

        Raises:
            GlotouchError: The file cannot be written.
        """
        try:
            for name in (f"{path.name}-wal", f"{path.name}-shm", f"{path.name}-journal"):
                path.with_name(name).unlink(missing_ok=True)
            create_file(path).close()
            with closing(sqlite3.connect(path, timeout=5.0)) as db, db:
                _configure(db)
                db.executescript(f"PRAGMA application_id = {_MARK}; PRAGMA user_version = {FORMAT}; {_TABLES}")
                db.executemany("INSERT INTO run VALUES (?, ?)", [(k, json.dumps(v)) for k, v in run.items()])
        except (sqlite3.Error, OSError) as e:
            raise GlotouchError(f"{path}: cannot be written ({e})") from e
        return cls(path)

    @property
    def run(self) -> dict[str, Any]:
        """The run's description and end, as written by `create` and `note`."""
        with self._errors():
            items = self._db.execute("SELECT key, value FROM run").fetchmany(MAX_ROWS)
            return {str(k): parse_json(v, f"{self.path}: {k}") for k, v in items}

    def note(self, key: str, value: object) -> None:
        """Set one item of `run`; raises as `add`."""
        with self._writing():
            self._note(key, value)

    def _note(self, key: str, value: object) -> None:
        self._db.execute("INSERT OR REPLACE INTO run VALUES (?, ?)", (key, json.dumps(value)))

    def add(self, row: CheckpointRow, state: bytes, world: bytes | None) -> None:
        """Append a checkpoint in one transaction.

        Raises:
            GlotouchError: The file cannot be written.
        """
        pack = zstandard.ZstdCompressor(level=1).compress
        values = (
            *(row.number, row.stamp_s, row.node, row.status, json.dumps(row.begun), json.dumps(dict(row.lacking))),
            *(row.record_bytes, pack(state), None if world is None else pack(world)),
        )
        with self._writing():
            self._db.execute("INSERT INTO checkpoint VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)", values)

    def rows(self) -> list[CheckpointRow]:
        """Return all checkpoints, oldest first.

        Raises:
            BadInput: The file is damaged.
        """
        query = "SELECT number, stamp_s, node, status, begun, lacking, record_bytes, world IS NOT NULL FROM checkpoint"
        with self._errors():
            found = self._db.execute(f"{query} ORDER BY number").fetchmany(MAX_ROWS)
            return [self._row(values) for values in found]

    def _row(self, values: Sequence[Any]) -> CheckpointRow:
        number, stamp_s, node, status, begun, lacking, record_bytes, has_world = values
        where = f"{self.path}: checkpoint {number}"
        begun, lacking = (parse_json(text, where) for text in (begun, lacking))
        for value, hint in (
            (stamp_s, float), (node, str), (status, str), (begun, list[str]), (lacking, dict[str, str]),
            (record_bytes, int | None),
        ):  # fmt: skip
            require_type(value, hint, where)
        if number < 0 or not math.isfinite(stamp_s) or (record_bytes or 0) < 0:
            raise BadInput(f"{where}: its time or its numbers are impossible")
        return CheckpointRow(number, float(stamp_s), node, status, tuple(begun), lacking, record_bytes, bool(has_world))

    def state(self, number: int) -> dict[str, Any]:
        """Return the state of one checkpoint.

        Raises:
            BadInput: It cannot be read, or is of another version.
        """
        found = self._content("state", number)
        require_type(found, dict[str, Any], f"{self.path}: checkpoint {number}")
        assert isinstance(found, dict)
        return found

    def world(self, number: int) -> Mapping[str, Any] | None:
        """Return the simulated world of one checkpoint, or None; raises as `state`."""
        found = self._content("world", number)
        require_type(found, dict[str, Any] | None, f"{self.path}: the world of checkpoint {number}")
        assert found is None or isinstance(found, dict)
        return found

    def begin_again(self, number: int, resumed: Sequence[object]) -> None:
        """Delete every checkpoint after `number` and the run's end, note the resumptions, all at once.

        A process that is killed before or after leaves a run that can be resumed. Raises as `add`.
        """
        with self._writing():
            self._db.execute("DELETE FROM checkpoint WHERE number > ?", (number,))
            self._note("resumed", resumed)
            self._note("ended", None)

    def copy_to(self, path: Path) -> None:
        """Write a copy with all committed rows, as one file."""
        with self._errors():
            create_file(path).close()
            with closing(sqlite3.connect(path)) as target:
                self._db.backup(target)

    def close(self) -> None:
        """Merge the write-ahead log into the file and close it; idempotent."""
        self._db.close()

    def _content(self, column: str, number: int) -> object:
        with self._errors():
            found = self._db.execute(f"SELECT {column} FROM checkpoint WHERE number = ?", (number,)).fetchone()
            if found is None:
                raise BadInput(f"{self.path}: there is no checkpoint {number}")
            if found[0] is None:
                return None
            where = f"{self.path}: checkpoint {number}"
            require_type(found[0], bytes, where)
            packed = unpack_zstd(found[0], MAX_UNPACKED_BYTES, where)
            try:
                return decode(packed)
            except BadInput as e:
                raise BadInput(f"{where}: {e}") from e

    def _require_ours(self) -> None:
        """Require our mark, our format, exactly our tables, and sound pages; called before any other query.

        A stranger's view, trigger, generated column or page that is its own child would run in our queries.
        """
        db, until_s = self._db, time.monotonic() + MAX_OPEN_S
        db.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MAX_VALUE_BYTES)
        db.setlimit(sqlite3.SQLITE_LIMIT_ATTACHED, 1)  # `backup` and VACUUM need one
        db.set_progress_handler(lambda: time.monotonic() > until_s, 100_000)
        for pragma in ("trusted_schema = OFF", "cell_size_check = ON", "mmap_size = 0"):
            db.execute(f"PRAGMA {pragma}")
        mark, version = (db.execute(f"PRAGMA {p}").fetchone()[0] for p in ("application_id", "user_version"))
        if mark != _MARK:
            raise BadInput(f"{self.path}: is not a checkpoint file")
        if version != FORMAT:
            raise BadInput(f"{self.path}: its format is {version}; this version reads and writes format {FORMAT}")
        if _schema_of(db) != _our_schema():
            raise BadInput(
                f"{self.path}: holds other tables than a checkpoint file; it was not written by this program"
            )
        sound = db.execute("PRAGMA quick_check(1)").fetchone()
        if sound != ("ok",):
            raise BadInput(f"{self.path}: is damaged ({sound})")
        db.set_progress_handler(None, 0)

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Run the block in one transaction."""
        try:
            with self._db:
                yield
        except sqlite3.Error as e:
            raise GlotouchError(f"{self.path}: cannot be written ({e})") from e

    @contextmanager
    def _errors(self) -> Iterator[None]:
        try:
            yield
        except (sqlite3.Error, OSError, ValueError, TypeError, OverflowError, MemoryError) as e:
            raise BadInput(f"{self.path}: cannot be read ({e})") from e


def _configure(db: sqlite3.Connection) -> None:
    """Set WAL mode with `synchronous=NORMAL`.

    A killed process loses no transaction; a power cut may lose the newest ones but does not corrupt the file. The log
    is not merged while running, because a merge would wait for the disk within a tick.
    """
    for pragma in ("journal_mode = WAL", "synchronous = NORMAL", "wal_autocheckpoint = 0"):
        db.execute(f"PRAGMA {pragma}")


@lru_cache(maxsize=1)
def _our_schema() -> list[tuple[Any, ...]]:
    with closing(sqlite3.connect(":memory:")) as db:
        db.executescript(_TABLES)
        return _schema_of(db)


def _schema_of(db: sqlite3.Connection) -> list[tuple[Any, ...]]:
    return db.execute("SELECT type, name, tbl_name, sql FROM sqlite_master").fetchmany(10)
