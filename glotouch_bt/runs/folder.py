"""The folder of a run: checked for writing before anything moves, its files written atomically."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path

from glotouch_bt.robot import BadInput, GlotouchError

FILES = ("mission.yaml", "run.mcap", "result.json", "truth.json", "report.html", "checkpoint.sqlite")
LEFT_BY_SQLITE = ("checkpoint.sqlite-wal", "checkpoint.sqlite-shm")


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Lock a folder for this process until the block or the process ends.

    Raises:
        BadInput: Another run is under way in the folder, or the system has no such locks.
    """
    try:
        import fcntl
    except ImportError as e:
        raise BadInput("runs need Linux or macOS; on Windows, use WSL 2 or Docker") from e
    handle = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as e:
            raise BadInput(f"{folder}: a run is under way in this folder") from e
        yield
    finally:
        os.close(handle)


class RunFolder:
    """The folder of one run.

    Args:
        path: The folder; in an existing one this run's files replace those of an earlier run.

    Raises:
        BadInput: It cannot be created or written to.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._made: Path | None = _first_missing(path)
        try:
            path.mkdir(parents=True, exist_ok=True)
            trial = path / ".writable"
            trial.write_bytes(b"")
            trial.unlink()
        except OSError as e:
            self.discard()
            raise BadInput(f"{path}: a run's folder cannot be written here ({e.strerror})") from e

    @classmethod
    def timestamped(cls, mission: str, seed: int, runs: Path = Path("runs")) -> RunFolder:
        """Create a folder `runs/<time>-<mission>-s<seed>`."""
        stem = f"{datetime.now():%Y%m%d-%H%M%S}-{mission}-s{seed}"
        path, n = runs / stem, 2
        while path.exists():
            path, n = runs / f"{stem}-{n}", n + 1
        return cls(path)

    def check_free(self, overwrite: bool) -> None:
        """Check that a new run may use the folder: it is empty, or holds an earlier run that may be replaced.

        Raises:
            BadInput: It holds other files, or a run that must be kept.
        """
        present = {p.name for p in self.path.iterdir()}
        if present and present.isdisjoint(FILES):
            raise BadInput(f"{self.path}: is not empty and holds no run; give a new or an empty folder")
        if present and not overwrite:
            raise BadInput(f"{self.path}: holds an earlier run; give another folder, or --overwrite to replace it")

    def clear(self) -> None:
        """Remove the files of an earlier run; call when this run is certain to start."""
        for name in (*FILES, *LEFT_BY_SQLITE):
            (self.path / name).unlink(missing_ok=True)
        shutil.rmtree(self.path / "earlier", ignore_errors=True)

    def discard(self) -> None:
        """Remove the folders that were created for this run, because it does not start."""
        if self._made is not None:
            shutil.rmtree(self._made, ignore_errors=True)

    def write_text(self, name: str, text: str) -> None:
        """Write a file atomically.

        Raises:
            GlotouchError: The file cannot be written.
        """
        target, part = self.path / name, self.path / f".{name}.part"
        try:
            with part.open("w", encoding="utf-8", newline="\n") as f:
                f.write(text)
                f.flush()
                os.fsync(f.fileno())
            part.replace(target)
        except OSError as e:
            part.unlink(missing_ok=True)
            raise GlotouchError(f"{target}: cannot be written ({e.strerror})") from e

    def write_json(self, name: str, data: Mapping[str, object]) -> None:
        """Write JSON atomically; raises as `write_text`."""
        self.write_text(name, json.dumps(data, indent=2, allow_nan=False) + "\n")


def _first_missing(path: Path) -> Path | None:
    """Return the topmost folder that `mkdir(parents=True)` would create, or None."""
    missing: Path | None = None
    for folder in (path, *path.parents):
        if os.path.exists(folder):  # unlike Path.exists, false for names that no folder can have
            break
        missing = folder
    return missing
