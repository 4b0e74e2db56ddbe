"""A TouchSet as one npz file.

A file holds columns, `<part>.<field>`: `candidate`, `contour`, `contact`, `sequence` and `layer` rows, in the order of
the TouchSet, plus `sequence.layers` (how many layers each sequence has) and `version`. Floats are stored as float64,
bit for bit; nothing is pickled. An optional array is a row of NaN where it is missing, and no column if it always is.
A field added by a later release becomes a new column; a file without it is read with the field's default.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, Field, fields, replace
from pathlib import Path
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

import numpy as np
import numpy.typing as npt

from glotouch_bt.perception.touch import BLOCKS, Candidate, Contact, Contour, Layer, TouchSequence, TouchSet
from glotouch_bt.robot import BadInput
from glotouch_bt.untrusted import write_file

VERSION = 1
SHAPES: Mapping[str, tuple[int | None, ...]] = {
    "contour.centre_K_m": (2,), "contour.size_m": (2,), "contour.residuals_m": (None,),
    "contour.covariance": (None, None), "contour.boundary_K_m": (None, 2),
    "contact.tip_K_m": (3,), "contact.approach_K": (3,), "contact.reaction_K": (3,), "contact.point_K_m": (2,),
    "contact.pushed_K_m": (2,), "sequence.position_K_m": (2,), "layer.position_K_m": (2,),
    "layer.left_m": (None, None), "layer.right_m": (None, None), "layer.noise_m": (2,),
    "layer.relief": (2, 2, *BLOCKS),
}  # fmt: skip
"""Shape of one row of an array field; None is any length. Other fields are scalars, strings, or arrays of any shape."""

Column = npt.NDArray[Any]
Columns = Mapping[str, Column]
T = TypeVar("T", Candidate, Contour, Contact, TouchSequence, Layer)


def save_touchset(path: Path, touchset: TouchSet) -> None:
    """Write a TouchSet; the folder must exist.

    Raises:
        BadInput: Rows of one field differ in shape (depth maps of two sensors), or the file cannot be written.
    """
    columns: dict[str, Column] = {"version": np.array(VERSION)}
    columns |= _columns("candidate", [touchset.candidate])
    columns |= _columns("contour", [touchset.candidate.contour])
    columns |= _columns("contact", touchset.candidate.contacts)
    columns |= _columns("sequence", touchset.sequences)
    columns |= _columns("layer", touchset.layers)
    columns["sequence.layers"] = np.array([len(s.layers) for s in touchset.sequences], dtype=np.int64)
    packed = io.BytesIO()
    np.savez_compressed(packed, **columns)  # type: ignore[arg-type]
    try:
        write_file(path, packed.getvalue())
    except OSError as e:
        raise BadInput(f"{path}: cannot be written ({e.strerror})") from e


def load_touchset(path: Path) -> TouchSet:
    """Read a TouchSet.

    Raises:
        BadInput: No such file, no npz, another version, or a column is missing or has the wrong type or shape.
    """
    try:
        with path.open("rb") as opened, np.load(opened, allow_pickle=False) as file:
            columns = {name: np.asarray(file[name]) for name in file.files}
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile, AttributeError, TypeError) as e:
        raise BadInput(f"{path}: is not a readable TouchSet file ({e})") from e
    try:
        return _touchset(columns)
    except BadInput as e:
        raise BadInput(f"{path}: {e}") from e


def _touchset(columns: Columns) -> TouchSet:
    version = columns.get("version")
    if version is None or version.shape != () or version.dtype.kind != "i":
        raise BadInput("is not a TouchSet file (it has no version)")
    if int(version) != VERSION:
        raise BadInput(f"is of version {int(version)}; this release reads version {VERSION}")
    count = columns.get("sequence.layers")
    if count is None or count.ndim != 1 or count.dtype.kind != "i" or (count < 0).any():
        raise BadInput("sequence.layers: must be one count a sequence")
    (contour,) = _rows(Contour, "contour", columns, 1)
    contacts = _rows(Contact, "contact", columns)
    (candidate,) = _rows(Candidate, "candidate", columns, 1, contour=contour, contacts=contacts)
    layers = _rows(Layer, "layer", columns, int(count.sum()))
    ends = np.cumsum(count)
    parts = [layers[end - n : end] for end, n in zip(ends.tolist(), count.tolist(), strict=True)]
    references = _rows(TouchSequence, "sequence", columns, len(count), layers=())
    return TouchSet(candidate, tuple(replace(s, layers=mine) for s, mine in zip(references, parts, strict=True)))


def _plain(cls: type[Any]) -> list[tuple[Field[Any], Any]]:
    """Return the fields stored as columns, with their types: all but nested values and tuples of them."""
    hints = get_type_hints(cls)
    nested = {"contour", "contacts", "layers", "rings"}
    return [(f, hints[f.name]) for f in fields(cls) if f.name not in nested]


def _columns(part: str, items: Sequence[Any]) -> dict[str, Column]:
    """Build one column a field."""
    out: dict[str, Column] = {}
    for field, hint in _plain(type(items[0])) if items else []:
        name = f"{part}.{field.name}"
        values = [getattr(item, field.name) for item in items]
        given = [v for v in values if v is not None]
        if not given:
            continue
        rows = [np.asarray(np.full_like(given[0], np.nan) if v is None else v) for v in values]
        if len({r.shape for r in rows}) > 1:
            raise BadInput(f"{name}: its rows differ in shape: {', '.join(sorted({str(r.shape) for r in rows}))}")
        column = np.stack(rows)
        column = column.astype(np.float64) if column.dtype.kind == "f" or hint is float else column
        _check(name, hint, column)
        out[name] = column
    return out


def _rows(cls: type[T], part: str, columns: Columns, count: int | None = None, **given: Any) -> tuple[T, ...]:
    """Build the values of one part: `count` of them if given, with the fields of `given` set."""
    present: dict[str, list[Any]] = {}
    for field, hint in _plain(cls):
        name = f"{part}.{field.name}"
        if name in columns:
            _check(name, hint, columns[name])
            present[field.name] = [_value(hint, row) for row in columns[name]]
    lengths = {len(rows) for rows in present.values()} or {0}
    if len(lengths) > 1 or (count is not None and lengths != {count}):
        wanted = f"{count} rows" if count is not None else "as many rows in every column"
        raise BadInput(f"{part}: must have {wanted}, has {', '.join(map(str, sorted(lengths)))}")
    (length,) = lengths
    for field, _ in _plain(cls):
        required = field.default is MISSING and field.default_factory is MISSING
        if length and required and field.name not in present:
            raise BadInput(f"{part}.{field.name}: is missing")
    return tuple(cls(**{k: rows[i] for k, rows in present.items()}, **given) for i in range(length))


def _check(name: str, hint: Any, column: Column) -> None:
    """Check that a column has one row a value, of the field's type and shape."""
    kinds = "f"
    if hint is bool:
        kinds = "b"
    elif hint is int:
        kinds = "i"
    elif _is_word(hint):
        kinds = "U"
    if column.ndim == 0 or column.dtype.kind not in kinds:
        raise BadInput(f"{name}: must be an array of {_KINDS[kinds]}, is {column.dtype} {column.shape}")
    row = column.shape[1:]
    wanted = SHAPES.get(name, None if _is_array(hint) else ())
    if wanted is None:
        return
    if len(row) != len(wanted) or any(w is not None and w != n for w, n in zip(wanted, row, strict=True)):
        shown = " x ".join("n" if w is None else str(w) for w in wanted) or "a single number or word"
        raise BadInput(
            f"{name}: every row must be {shown}, is {' x '.join(map(str, row)) or 'a single number or word'}"
        )


_KINDS = {"f": "floats", "b": "truth values", "i": "whole numbers", "U": "words"}


def _is_word(hint: Any) -> bool:
    """Return True for str, a Literal of strings, or an optional one."""
    options = [a for h in (get_args(hint) or (hint,)) for a in (get_args(h) or (h,)) if a is not type(None)]
    return all(o is str or isinstance(o, str) for o in options)


def _is_array(hint: Any) -> bool:
    return not (hint in (float, int, bool) or _is_word(hint) or get_origin(hint) is tuple)


def _value(hint: Any, row: Any) -> Any:
    """Convert a row to the field's own type."""
    if hint in (float, int, bool):
        return hint(row)
    if _is_word(hint):
        return str(row)
    if type(None) in get_args(hint) and np.isnan(row).all():
        return None
    return tuple(row.tolist()) if get_origin(hint) is tuple else np.array(row)
