"""The folder of a run: checked for writing before anything moves, its files written atomically."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path

from glotouch_bt.mission.checkpoint import CHECKPOINT_FILE, CheckpointFile
from glotouch_bt.mission.record import MCAP_MAGIC
from glotouch_bt.report import FILM_NAME as FILM
from glotouch_bt.robot import BadInput, GlotouchError
from glotouch_bt.untrusted import read_json, read_start, require_plain, write_file

FILES = ("mission.yaml", "run.mcap", "result.json", "truth.json", "report.html", FILM, CHECKPOINT_FILE)
LEFT_BY_SQLITE = (f"{CHECKPOINT_FILE}-wal", f"{CHECKPOINT_FILE}-shm")
PARTS = tuple(f".{name}.part" for name in FILES)
"""Names of files that are being written; a killed process leaves one."""
EARLIER = "earlier"
"""Subfolder of a run's folder for the files that a resumed run replaces, one numbered folder per resumption."""
MODELS = "models"
"""Subfolder for the wrong models of a fault plan."""
OWN_FILES = (*FILES, *LEFT_BY_SQLITE, *PARTS)


def require_run_folder(folder: Path) -> None:
    """Require that a folder holds no links, devices or pipes under the names that a run uses.

    Raises:
        BadInput: It does. A stranger's link would make this program read, replace or extend another file.
    """
    require_plain(folder, (*OWN_FILES, f"{CHECKPOINT_FILE}-journal", EARLIER, MODELS))


def holds_run(folder: Path) -> bool:
    """Return True if a folder holds a record, checkpoints or a result that a run of this program wrote."""
    return (
        read_start(folder / "run.mcap", len(MCAP_MAGIC)) == MCAP_MAGIC
        or CheckpointFile.is_one(folder / CHECKPOINT_FILE)
        or _is_result(folder / "result.json")
    )


def _is_result(path: Path) -> bool:
    try:
        found = read_json(path)
    except BadInput:
        return False
    return isinstance(found, dict) and {"mission", "backend", "seed", "status", "versions"} <= found.keys()


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
        BadInput: It cannot be created or written to, or holds links under the names of a run's files.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._made: Path | None = _first_missing(path)
        try:
            path.mkdir(parents=True, exist_ok=True)
            with tempfile.NamedTemporaryFile(dir=path, prefix=".writable-"):
                pass
        except OSError as e:
            self.discard()
            raise BadInput(f"{path}: a run's folder cannot be written here ({e.strerror})") from e
        require_run_folder(path)

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

        Hidden files do not count: a campaign keeps the claim of a trial there.

        Raises:
            BadInput: It holds other files, or a run that must be kept.
        """
        if all(p.name.startswith(".") for p in self.path.iterdir()):
            return
        if not holds_run(self.path):
            raise BadInput(f"{self.path}: is not empty and holds no run; give a new or an empty folder")
        if not overwrite:
            resumable = not (self.path / "result.json").exists() and CheckpointFile.is_one(self.path / CHECKPOINT_FILE)
            what = "a run that did not end" if resumable else "an earlier run"
            go_on = f"; `glotouch resume {self.path}` goes on with it" if resumable else ""
            raise BadInput(f"{self.path}: holds {what}; give another folder, or --overwrite to replace it{go_on}")

    def clear(self) -> None:
        """Remove the files of an earlier run, and nothing else; call when this run is certain to start."""
        _remove(self.path, OWN_FILES)
        for number in _folders_in(self.path / EARLIER):
            _remove(number, OWN_FILES)
            _remove_empty(number)
        _remove_empty(self.path / EARLIER)

    def discard(self) -> None:
        """Remove the folders that were created for this run, because it does not start."""
        if self._made is None:
            return
        self.clear()
        models = self.path / MODELS
        _remove(models, [p.name for p in models.glob("*.stl")])
        for folder in (models, self.path, *self.path.parents):
            _remove_empty(folder)
            if folder == self._made:
                return

    def write_text(self, name: str, text: str) -> None:
        """Write a file atomically.

        Raises:
            GlotouchError: The file cannot be written.
        """
        try:
            write_file(self.path / name, text.encode(), durable=True)
        except OSError as e:
            raise GlotouchError(f"{self.path / name}: cannot be written ({e.strerror})") from e

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


def _folders_in(folder: Path) -> list[Path]:
    """Return the folders inside a folder that are no links; none if it is itself a link or does not exist."""
    if folder.is_symlink() or not folder.is_dir():
        return []
    return [p for p in folder.iterdir() if p.is_dir() and not p.is_symlink()]


def _remove(folder: Path, names: Iterable[str]) -> None:
    """Remove files of these names, if they exist and are regular files."""
    for name in names:
        path = folder / name
        if path.is_file() and not path.is_symlink():
            path.unlink(missing_ok=True)


def _remove_empty(folder: Path) -> None:
    with suppress(OSError):
        folder.rmdir()
