"""The file checkpoint.sqlite: one row per finished skill, with everything needed to continue from there.

SQLite in WAL mode, one transaction a row: a killed process leaves every row it has written. The content of a row is
compressed MessagePack (`codec`). `glotouch resume` reads the file, and so does any SQLite tool:

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

CHECKPOINT_FILE = "checkpoint.sqlite"
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
        """Create the file of a run that JSON data describe; replace an existing one.

        Raises:
            GlotouchError: The file cannot be written.
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
        """The run's description and end, as written by `create` and `note`."""
        with self._errors():
            return {k: json.loads(v) for k, v in self._db.execute("SELECT key, value FROM run")}

    def note(self, key: str, value: object) -> None:
        """Set one item of `run`; raises as `add`."""
        with self._writing():
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
        """Return all checkpoints, oldest first."""
        query = "SELECT number, stamp_s, node, status, begun, lacking, record_bytes, world IS NOT NULL FROM checkpoint"
        with self._errors():
            return [
                CheckpointRow(n, t, node, status, tuple(json.loads(begun)), json.loads(lacking), size, bool(world))
                for n, t, node, status, begun, lacking, size, world in self._db.execute(f"{query} ORDER BY number")
            ]

    def state(self, number: int) -> dict[str, Any]:
        """Return the state of one checkpoint.

        Raises:
            BadInput: It cannot be read, or is of another version.
        """
        found = self._content("state", number)
        if not isinstance(found, dict):
            raise BadInput(f"{self.path}: checkpoint {number} is damaged")
        return found

    def world(self, number: int) -> Mapping[str, Any] | None:
        """Return the simulated world of one checkpoint, or None; raises as `state`."""
        found = self._content("world", number)
        if not (found is None or isinstance(found, dict)):
            raise BadInput(f"{self.path}: checkpoint {number} is damaged")
        return found

    def drop_after(self, number: int) -> None:
        """Delete every later checkpoint; raises as `add`."""
        with self._writing():
            self._db.execute("DELETE FROM checkpoint WHERE number > ?", (number,))

    def copy_to(self, path: Path) -> None:
        """Write a copy with all committed rows, as one file."""
        with self._errors(), closing(sqlite3.connect(path)) as target:
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
            try:
                return decode(zstandard.ZstdDecompressor().decompress(found[0]))
            except zstandard.ZstdError as e:
                raise BadInput(f"{self.path}: checkpoint {number} is damaged ({e})") from e
            except BadInput as e:
                raise BadInput(f"{self.path}: checkpoint {number}: {e}") from e

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
        except (sqlite3.Error, ValueError, TypeError) as e:
            raise BadInput(f"{self.path}: cannot be read ({e})") from e


def _connect(path: Path) -> sqlite3.Connection:
    """Connect in WAL mode with `synchronous=NORMAL`.

    A killed process loses no transaction; a power cut may lose the newest ones but does not corrupt the file. The log
    is not merged while running, because a merge would wait for the disk within a tick.
    """
    db = sqlite3.connect(path, timeout=5.0)
    try:
        for pragma in ("journal_mode = WAL", "synchronous = NORMAL", "wal_autocheckpoint = 0"):
            db.execute(f"PRAGMA {pragma}")
    except sqlite3.Error:
        db.close()
        raise
    return db
