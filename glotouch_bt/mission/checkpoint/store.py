"""checkpoint.sqlite: a row for each skill that ended, with all that is needed to go on from there.

SQLite in WAL mode, one transaction a row: a process that is killed leaves every row it had written. What a row holds
is MessagePack (`values`), compressed; `glotouch resume` reads it, and so does any tool that reads SQLite:

    sqlite3 checkpoint.sqlite 'SELECT number, stamp_s, node, status, length(state), length(world) FROM checkpoint'
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import zstandard

from glotouch_bt.mission.checkpoint.codec import decode
from glotouch_bt.robot import BadInput, GlotouchError

FILE = "checkpoint.sqlite"
FORMAT = 2
_MARK = 0x474C4F54  # "GLOT", SQLite's application_id
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
class Row:
    """One checkpoint without its content.

    Attributes:
        number: 0 is before the first tick.
        stamp_s: Robot clock.
        node: Path of the skill that ended, or empty.
        status: How it ended.
        begun: Paths of the nodes that began since the row before.
        lacking: What could not be kept, and why.
        record_bytes: Length of the record up to here, or None.
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
        BadInput: It is none, or of another format.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        if not path.is_file():
            raise BadInput(f"{path.parent}: no checkpoint here ({path.name} is missing)")
        with self._errors():
            self._db = _connect(path)
        try:
            with self._errors():
                mark, version = (
                    self._db.execute(f"PRAGMA {p}").fetchone()[0] for p in ("application_id", "user_version")
                )
            if mark != _MARK:
                raise BadInput(f"{path}: is not a checkpoint file")
            if version != FORMAT:
                raise BadInput(f"{path}: its format is {version}; this version reads and writes format {FORMAT}")
        except BaseException:
            self._db.close()
            raise

    @classmethod
    def create(cls, path: Path, run: Mapping[str, object]) -> CheckpointFile:
        """A new file for a run described by JSON data; replaces what is there.

        Raises:
            GlotouchError: The disk refused.
        """
        for name in (path.name, f"{path.name}-wal", f"{path.name}-shm"):
            path.with_name(name).unlink(missing_ok=True)
        try:
            with closing(_connect(path)) as db, db:
                db.executescript(f"PRAGMA application_id = {_MARK}; PRAGMA user_version = {FORMAT}; {_TABLES}")
                db.executemany("INSERT INTO run VALUES (?, ?)", [(k, json.dumps(v)) for k, v in run.items()])
        except sqlite3.Error as e:
            raise GlotouchError(f"{path}: cannot be written ({e})") from e
        return cls(path)

    @property
    def run(self) -> dict[str, Any]:
        """What is known of the run."""
        with self._errors():
            return {k: json.loads(v) for k, v in self._db.execute("SELECT key, value FROM run")}

    def note(self, key: str, value: object) -> None:
        """Set one item of `run`; errors as in `add`."""
        with self._writing():
            self._db.execute("INSERT OR REPLACE INTO run VALUES (?, ?)", (key, json.dumps(value)))

    def add(self, row: Row, state: bytes, world: bytes | None) -> None:
        """Append a checkpoint, in one transaction.

        Raises:
            GlotouchError: The disk refused.
        """
        pack = zstandard.ZstdCompressor(level=1).compress
        values = (
            *(row.number, row.stamp_s, row.node, row.status, json.dumps(row.begun), json.dumps(dict(row.lacking))),
            *(row.record_bytes, pack(state), None if world is None else pack(world)),
        )
        with self._writing():
            self._db.execute("INSERT INTO checkpoint VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)", values)

    def rows(self) -> list[Row]:
        """All checkpoints, oldest first."""
        asked = "SELECT number, stamp_s, node, status, begun, lacking, record_bytes, world IS NOT NULL FROM checkpoint"
        with self._errors():
            return [
                Row(n, t, node, status, tuple(json.loads(begun)), json.loads(lacking), size, bool(world))
                for n, t, node, status, begun, lacking, size, world in self._db.execute(f"{asked} ORDER BY number")
            ]

    def state(self, number: int) -> dict[str, Any]:
        """The state of one checkpoint.

        Raises:
            BadInput: It cannot be read, or is of another version.
        """
        found = self._content("state", number)
        if not isinstance(found, dict):
            raise BadInput(f"{self.path}: checkpoint {number} is damaged")
        return found

    def world(self, number: int) -> Mapping[str, Any] | None:
        """The simulated world of one checkpoint, or None; errors as for `state`."""
        found = self._content("world", number)
        if not (found is None or isinstance(found, dict)):
            raise BadInput(f"{self.path}: checkpoint {number} is damaged")
        return found

    def drop_after(self, number: int) -> None:
        """Forget every later checkpoint; errors as in `add`."""
        with self._writing():
            self._db.execute("DELETE FROM checkpoint WHERE number > ?", (number,))

    def copy_to(self, path: Path) -> None:
        """A copy with all that has been written, in one file."""
        with self._errors(), closing(sqlite3.connect(path)) as target:
            self._db.backup(target)

    def close(self) -> None:
        """Fold the write-ahead log into the file, so that the file alone is the whole; idempotent."""
        self._db.close()

    def _content(self, column: str, number: int) -> object:
        with self._errors():
            found = self._db.execute(f"SELECT {column} FROM checkpoint WHERE number = ?", (number,)).fetchone()
            if found is None:
                raise BadInput(f"{self.path}: there is no checkpoint {number}")
            if found[0] is None:
                return None
            try:
                return decode(zstandard.ZstdDecompressor().decompress(found[0]))
            except zstandard.ZstdError as e:
                raise BadInput(f"{self.path}: checkpoint {number} is damaged ({e})") from e
            except BadInput as e:
                raise BadInput(f"{self.path}: checkpoint {number}: {e}") from e

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """One transaction."""
        try:
            with self._db:
                yield
        except sqlite3.Error as e:
            raise GlotouchError(f"{self.path}: cannot be written ({e})") from e

    @contextmanager
    def _errors(self) -> Iterator[None]:
        try:
            yield
        except (sqlite3.Error, ValueError, TypeError) as e:
            raise BadInput(f"{self.path}: cannot be read ({e})") from e


def _connect(path: Path) -> sqlite3.Connection:
    """WAL with `synchronous=NORMAL`: a killed process loses no transaction; a power cut may lose the newest, never the
    file. No checkpoint of the log in between: that would wait for the disk within a tick."""
    db = sqlite3.connect(path, timeout=5.0)
    try:
        for pragma in ("journal_mode = WAL", "synchronous = NORMAL", "wal_autocheckpoint = 0"):
            db.execute(f"PRAGMA {pragma}")
    except sqlite3.Error:
        db.close()
        raise
    return db
