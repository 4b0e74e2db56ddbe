"""Disk cache of target models, memory-mapped.

One file per model, named by the hash of mesh geometry, pad and table version: a JSON header, then the raw tables. Files
are moved into place atomically. A file is believed only if its axes are those of the mesh and its tables lie within the
mesh; otherwise the model is built anew. An unwritable folder is ignored.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import tempfile
import zlib
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from glotouch_bt.perception.recognition.model import (
    TIP_RADIUS_M,
    VERSION,
    PadSpec,
    TargetModel,
    from_parts,
    table_axes,
    to_parts,
)
from glotouch_bt.robot import BadInput
from glotouch_bt.robot.scene import Mesh
from glotouch_bt.untrusted import open_file, parse_json

MAGIC = b"glotouch-model-1\n"
"""First bytes of a cache file."""
ALIGN = 64
"""Alignment of the tables, bytes."""
MAX_FILE_BYTES, MAX_HEADER_BYTES = 1_000_000_000, 1_000_000
"""Largest file and header that are read. Source: four times those of the largest object, 0.3 m."""
ROUNDING_M = 1e-5
"""Largest distance of a table's value beyond the mesh, by rounding to 32 bit."""
MAPPED_DTYPES = ("<f4",)
"""Types of the tables."""
MAX_SECTION = 10.0
"""Largest number in the table of a section: distances are below a metre, slopes mostly below 1."""
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
    else:
        model = _read(path, mesh.name)
        if model is None or not _is_of(model, mesh, pad):
            model = TargetModel.from_mesh(mesh, pad)
            _write(path, model)
        _mapped[path] = replace(model, mesh=mesh)
    while len(_mapped) > MAX_MAPPED:
        _mapped.popitem(last=False)
    model = _mapped[path]
    return model if model.name == mesh.name else replace(model, name=mesh.name)  # the cache knows shapes, not names


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
        with open_file(path, MAX_FILE_BYTES) as file:
            raw = np.memmap(file, dtype=np.uint8, mode="r")
        size = len(MAGIC) + 16
        head = bytes(raw[:size])
        if head[: len(MAGIC)] != MAGIC or not 0 < int(head[len(MAGIC) :]) <= MAX_HEADER_BYTES:
            return None
        start = size + int(head[len(MAGIC) :])
        content = parse_json(bytes(raw[size:start]), str(path))
        if len(raw) != start + content["bytes"]:
            return None
        arrays = {str(key): _table(raw[start:], t) for key, t in content["tables"].items()}
        return from_parts(name, content["facts"], arrays)
    except (BadInput, OSError, ValueError, LookupError, TypeError, AttributeError, OverflowError):
        return None


def _table(raw: npt.NDArray[np.uint8], t: Mapping[str, Any]) -> npt.NDArray[Any]:
    """Return one mapped table.

    Raises:
        ValueError, LookupError, TypeError: It is damaged.
    """
    shape, at = tuple(int(n) for n in t["shape"]), int(t["offset"])
    if t["dtype"] not in MAPPED_DTYPES or at < 0 or len(shape) > 4 or min(shape, default=0) < 1:
        raise ValueError(f"a table of {t['dtype']} {shape} at {at}")
    dtype = np.dtype(t["dtype"])
    piece = raw[at : at + math.prod(shape) * dtype.itemsize]
    if zlib.crc32(piece.data) != t["crc"]:
        raise ValueError("a damaged table")
    table: npt.NDArray[Any] = piece.view(dtype).reshape(shape).view(np.ndarray)
    return table


def _is_of(model: TargetModel, mesh: Mesh, pad: PadSpec) -> bool:
    """Return True if a cached model can be that of a mesh: its axes are the mesh's, its tables lie within the mesh."""
    if (model.digest, model.pad) != (mesh.digest, pad):
        return False
    axes = table_axes(mesh, pad)
    same = (
        (model.phi_rad, axes.phi_rad), (model.l_m, axes.l_m), (model.z_m, axes.z_m), (model.centre_m, axes.centre_m),
        ([model.height_m, model.anisotropy], [axes.height_m, axes.anisotropy]),
        (model.fine_m.shape, (len(axes.phi_rad), len(axes.fine_l_m), len(axes.fine_z_m))),
    )  # fmt: skip
    if not all(np.array_equal(np.asarray(a), np.asarray(b)) for a, b in same):
        return False
    reach, fine = model.reach_m, model.fine_m
    if np.isinf(reach).any() or np.isnan(fine).any() or not np.isfinite(reach).any():
        return False
    largest_m = axes.radius_m + ROUNDING_M
    tables = all(np.abs(t[np.isfinite(t)]).max(initial=0.0) <= largest_m for t in (reach, fine))
    images = np.isfinite(model.images_by_place).all()
    section = model.section is None or np.abs(model.section.table).max() < MAX_SECTION  # NaN is not
    return bool(tables and images and section and _is_within(model, 4.0 * largest_m + TIP_RADIUS_M))


def _is_within(model: TargetModel, largest_m: float) -> bool:
    """Return True if the numbers of a model are finite, and the lengths of its outline at most `largest_m`."""
    outlines = (model.outline, *model.components)
    fits = [f for o in outlines for f in (o.as_round, o.as_box)]
    lengths = [*model.tops_m, *(v for f in fits for v in (*f.centre_m, *f.size_m, *f.size_sd_m, f.centre_sd_m))]
    others = [model.rho, model.rho_sd, model.normal_dispersion, *(v for f in fits for v in (f.yaw_rad, f.yaw_sd_rad))]
    finite = bool(np.isfinite([*lengths, *others]).all())
    return finite and max(map(abs, lengths)) <= largest_m and all(0.0 <= o.p_box <= 1.0 for o in outlines)
