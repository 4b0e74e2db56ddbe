"""Disk cache of target models, memory-mapped.

One file per model, named by the hash of mesh geometry, pad and table version: a JSON header, then the raw tables. Files
are moved into place atomically. A damaged file is rebuilt; an unwritable folder is ignored.
"""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
import zlib
from collections import OrderedDict
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from glotouch_bt.perception.recognition.model import VERSION, PadSpec, TargetModel, from_parts, to_parts
from glotouch_bt.robot import ParamError
from glotouch_bt.robot.scene import Mesh

MAGIC = b"glotouch-model-1\n"
"""First bytes of a cache file."""
ALIGN = 64
"""Alignment of the tables, bytes."""
MAX_MAPPED = 32
"""Maximum number of models mapped in this process."""
_mapped: OrderedDict[Path, TargetModel] = OrderedDict()


def cache_folder() -> Path:
    """Return $XDG_CACHE_HOME/glotouch/models, or ~/.cache/glotouch/models."""
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "glotouch" / "models"


def target_model(mesh: Mesh, pad: PadSpec | None = None, folder: Path | None = None) -> TargetModel:
    """Return the model of a mesh for a pad: from the cache (a few ms), or built and cached (below a second).

    Args:
        mesh: The target.
        pad: The pad; default `PadSpec()`.
        folder: Cache folder; default `cache_folder()`.

    Raises:
        ParamError: The mesh is too low for probe and pads.
    """
    pad = pad or PadSpec()
    path = (folder or cache_folder()) / f"{model_key(mesh, pad)}.model"
    if path in _mapped:
        _mapped.move_to_end(path)
        return _mapped[path]
    model = _read(path, mesh.name)
    if model is None or model.digest != mesh.digest or model.pad != pad:
        model = TargetModel.from_mesh(mesh, pad)
        _write(path, model)
    _mapped[path] = model
    while len(_mapped) > MAX_MAPPED:
        _mapped.popitem(last=False)
    return model


def model_key(mesh: Mesh, pad: PadSpec) -> str:
    """Return the hash of all inputs of the tables."""
    what = json.dumps([VERSION, mesh.digest, asdict(pad)], sort_keys=True)
    return hashlib.sha256(what.encode()).hexdigest()[:32]


def _write(path: Path, model: TargetModel) -> None:
    facts, arrays = to_parts(model)
    tables: dict[str, Any] = {}
    offset = 0
    blobs = []
    for name, array in arrays.items():
        blob = np.ascontiguousarray(array).tobytes()
        tables[name] = {
            "dtype": array.dtype.str, "shape": list(array.shape), "offset": offset, "crc": zlib.crc32(blob),
        }  # fmt: skip
        padding = -len(blob) % ALIGN
        blobs += [blob, b"\0" * padding]
        offset += len(blob) + padding
    header = json.dumps({"facts": facts, "tables": tables, "bytes": offset}).encode()
    start = len(MAGIC) + 16 + len(header)
    header += b" " * (-start % ALIGN)
    head = MAGIC + f"{len(header):015d}\n".encode() + header
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, part = tempfile.mkstemp(dir=path.parent, suffix=".part")
        try:
            with os.fdopen(handle, "wb") as f:
                f.writelines([head, *blobs])
            os.replace(part, path)
        except BaseException:
            Path(part).unlink(missing_ok=True)
            raise
    except OSError:
        return  # disk full or not writable: use the model in memory


def _read(path: Path, name: str) -> TargetModel | None:
    """Return the cached model, or None if it is missing or damaged."""
    try:
        raw = np.memmap(path, dtype=np.uint8, mode="r")
        size = len(MAGIC) + 16
        head = bytes(raw[:size])
        if head[: len(MAGIC)] != MAGIC:
            return None
        start = size + int(head[len(MAGIC) :])
        content = json.loads(bytes(raw[size:start]))
        if len(raw) != start + content["bytes"]:
            return None
        arrays = {}
        for key, t in content["tables"].items():
            dtype, shape = np.dtype(t["dtype"]), tuple(t["shape"])
            at = start + t["offset"]
            piece = raw[at : at + int(np.prod(shape)) * dtype.itemsize]
            if zlib.crc32(piece.data) != t["crc"]:
                return None
            arrays[key] = piece.view(dtype).reshape(shape).view(np.ndarray)
        return from_parts(name, content["facts"], arrays)
    except (OSError, ValueError, KeyError, TypeError, ParamError):
        return None
