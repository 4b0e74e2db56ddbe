"""Convert any value that a skill records to strict JSON: no NaN, no arrays, no memory addresses."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping, Set
from enum import Enum
from pathlib import PurePath

import numpy as np
from pydantic import BaseModel

from glotouch_bt.robot import Pose

Json = None | bool | int | float | str | list["Json"] | dict[str, "Json"]

DECIMALS = 9
"""Decimals kept in small arrays."""
LARGE_DECIMALS = 6
"""Decimals kept in large arrays."""
LARGE = 64
"""An array with more elements than this is large."""
_MAX_DEPTH = 24


def to_json(value: object, *, summarise: bool = False, depth: int = 0) -> Json:
    """Return `value` as plain JSON data.

    Dataclasses and pydantic models become objects of their fields, poses {position_m, quat}, arrays nested lists
    (rounded to 1e-9, large arrays such as depth maps to 1e-6). Numbers that are not finite become null. A value without
    a JSON form becomes "<name of its type>".

    Args:
        value: Any value.
        summarise: Write large arrays as {shape, min, max} only.
        depth: Nesting depth of `value`.
    """
    if value is None or isinstance(value, bool | str):
        return value
    if isinstance(value, Enum):
        return to_json(value.value)
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, np.bool_):
        return bool(value)
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, np.ndarray):
        return _array(value, summarise)
    if depth >= _MAX_DEPTH:
        return f"<{type(value).__name__}>"
    if isinstance(value, Pose):
        return {"position_m": _array(value.position_m, False), "quat": _array(value.quat, False)}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        names = [f.name for f in dataclasses.fields(value)]
        return {n: to_json(getattr(value, n), summarise=summarise, depth=depth + 1) for n in names}
    if isinstance(value, BaseModel):
        return to_json(value.model_dump(), summarise=summarise, depth=depth + 1)
    if isinstance(value, Mapping):
        return {str(k): to_json(v, summarise=summarise, depth=depth + 1) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [to_json(v, summarise=summarise, depth=depth + 1) for v in value]
    if isinstance(value, Set):
        return [to_json(v, summarise=summarise, depth=depth + 1) for v in sorted(value, key=str)]
    if isinstance(value, PurePath):
        return str(value)
    return f"<{type(value).__name__}>"


def dumps(value: object, *, summarise: bool = False) -> bytes:
    """Return `to_json(value)` as compact UTF-8 text."""
    return dumps_plain(to_json(value, summarise=summarise))


def dumps_plain(plain: Json) -> bytes:
    """Return the result of `to_json` as compact UTF-8 text."""
    return json.dumps(plain, separators=(",", ":"), allow_nan=False).encode()


def _array(a: np.ndarray[tuple[int, ...], np.dtype[np.generic]], summarise: bool) -> Json:
    if a.dtype.kind in "iub":
        if summarise and a.size > LARGE:
            return {"shape": list(a.shape), "min": int(a.min()), "max": int(a.max())}
        listed: Json = a.tolist()
        return listed
    if a.dtype.kind != "f":
        return [to_json(v) for v in a.tolist()]
    x = a.astype(np.float64)
    finite = np.isfinite(x)
    if summarise and a.size > LARGE:
        inside = x[finite]
        low, high = (float(inside.min()), float(inside.max())) if inside.size else (None, None)
        return {"shape": list(a.shape), "min": low, "max": high}
    x = np.round(x, DECIMALS if a.size <= LARGE else LARGE_DECIMALS)
    if finite.all():
        listed = x.tolist()
        return listed
    with_null = x.astype(object)
    with_null[~finite] = None
    listed = with_null.tolist()
    return listed
