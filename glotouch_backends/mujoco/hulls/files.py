"""The cache of convex parts: one small npz file a mesh, named by the mesh's digest."""

from __future__ import annotations

import io
import os
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path

import numpy as np

from glotouch_bt.robot import Array, BadInput
from glotouch_bt.untrusted import read_file, write_file

MEMBERS = ("vertices", "counts", "key", "note")
MAX_FILE_BYTES, MAX_UNPACKED_BYTES, MAX_NOTE = 4_000_000, 16_000_000, 1000
"""Largest file, its largest content, and the longest note. Source: 50 times the largest shipped file, 0.08 MB."""
MAX_PARTS = 1000
"""Maximum number of hulls of a mesh. `FINE` asks for 32, and for one for each closed surface."""
MAX_VERTICES = 256
"""Largest number of vertices of a hull. Source: measured; an apple's largest part misses its surface by 0.6 mm (p95)
with 64, by 0.1 mm with 256. The step does not get slower, because MuJoCo walks the hull's graph."""


@dataclass(frozen=True)
class Parts:
    """Convex parts of one mesh.

    Attributes:
        hulls: (k_i, 3) vertices of each, m.
        note: Warning for the user; empty if there is none.
    """

    hulls: tuple[Array, ...]
    note: str = ""


def package_file(name: str) -> Traversable:
    """Return a file of the shipped decompositions; it need not exist."""
    return resources.files("glotouch_missions").joinpath("hulls", name)


def user_folder() -> Path:
    """Return the user's cache folder (XDG base directory specification: a relative path is ignored)."""
    base = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return (base if base.is_absolute() else Path.home() / ".cache") / "glotouch-bt" / "hulls"


def encode(key: str, parts: Parts) -> bytes:
    """Return the file's bytes: concatenated float32 vertices, their counts, the key and the note. Deterministic."""
    buffer = io.BytesIO()
    np.savez_compressed(
        buffer,
        vertices=np.concatenate(parts.hulls).astype(np.float32),
        counts=np.array([len(h) for h in parts.hulls], dtype=np.int32),
        key=np.array(key),
        note=np.array(parts.note),
    )
    return buffer.getvalue()


def decode(content: bytes, key: str) -> Parts | None:
    """Return the parts in a file's bytes, or None if they are damaged, out of bounds, or were made with another key."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            items = archive.infolist()
        if len(items) != len(MEMBERS) or sum(i.file_size for i in items) > MAX_UNPACKED_BYTES:
            return None
        with np.load(io.BytesIO(content), allow_pickle=False) as data:
            if str(data["key"]) != key:
                return None
            vertices, counts, note = data["vertices"], data["counts"], str(data["note"])
    except (
        OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error, NotImplementedError, MemoryError,
        OverflowError, RuntimeError,
    ):  # fmt: skip
        return None
    if vertices.dtype.kind != "f" or vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
        return None
    if counts.dtype.kind != "i" or counts.ndim != 1 or not 0 < len(counts) <= MAX_PARTS or len(note) > MAX_NOTE:
        return None
    counts, vertices = counts.astype(np.int64), vertices.astype(np.float64)
    if counts.min() < 4 or counts.max() > MAX_VERTICES or counts.sum() != len(vertices):
        return None
    return Parts(tuple(np.split(vertices, np.cumsum(counts)[:-1])), note)


def read_parts(path: Traversable, key: str) -> Parts | None:
    """Return the parts in a file, or None if it does not exist, is damaged, or has another key."""
    try:
        if isinstance(path, Path):
            return decode(read_file(path, MAX_FILE_BYTES), key)
        return decode(path.read_bytes(), key)  # inside an installed archive
    except (BadInput, OSError):
        return None


def write_parts(path: Path, key: str, parts: Parts, say: Callable[[str], None]) -> Parts:
    """Write parts atomically, and return them as a later reader will see them.

    If the folder cannot be written, report it: the next run must compute the parts again.
    """
    content = encode(key, parts)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_file(path, content)
    except OSError as e:
        say(f"convex parts cannot be kept in {path.parent} ({e.strerror}); they will be computed again next time")
    kept = decode(content, key)
    assert kept is not None
    return kept


@contextmanager
def locked(path: Path, on_wait: Callable[[], None]) -> Iterator[None]:
    """Let one process at a time write a file; others wait, after calling `on_wait`. Without file locks nobody waits."""
    try:
        import fcntl

        path.parent.mkdir(parents=True, exist_ok=True)
        flags = os.O_WRONLY | os.O_CREAT | os.O_NOFOLLOW
        lock = open(os.open(path.with_name(f".{path.stem}.lock"), flags, 0o600), "w")  # noqa: SIM115
    except (ImportError, OSError):
        yield
        return
    with lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            on_wait()
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield
