"""Parse JSON and unpack Zstandard frames within bounds."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import zstandard

from glotouch_bt.errors import BadInput
from glotouch_bt.untrusted.files import read_file

MAX_JSON_BYTES = 32_000_000
"""Largest JSON text. Source: 20 times the largest result that is written; as Python data it takes up to 0.8 GB."""
MAX_LEVELS = 64
"""Maximum nesting of JSON. Source: ours; results have 6 levels, and code that walks them may recurse."""
MAX_DIGITS = 20
"""Maximum number of characters of an integer; 2^64 has 20 digits."""


class TooLarge(BadInput):
    """Something unpacks to more than is allowed."""


def parse_json(data: bytes | str, shown: str, max_bytes: int = MAX_JSON_BYTES) -> Any:
    """Parse JSON text; NaN, infinities and whole numbers beyond 64 bit are not JSON here.

    Args:
        data: The text.
        shown: Its place, for messages.
        max_bytes: Largest size.

    Raises:
        BadInput: It is too large, nested too deep or not JSON.
    """
    if len(data) > max_bytes:
        raise BadInput(f"{shown}: is larger than {max_bytes} bytes")
    try:
        value = json.loads(data, parse_constant=_no_number, parse_int=_whole)
    except RecursionError as e:
        raise BadInput(f"{shown}: is nested too deep") from e
    except ValueError as e:  # also UnicodeDecodeError
        raise BadInput(f"{shown}: is not JSON ({e})") from e
    opened = data.count("[") + data.count("{") if isinstance(data, str) else data.count(b"[") + data.count(b"{")
    if opened > MAX_LEVELS and _is_deep(value):
        raise BadInput(f"{shown}: is nested deeper than {MAX_LEVELS} levels")
    return value


def _is_deep(value: Any) -> bool:
    """Return True if a JSON value has more than `MAX_LEVELS` levels."""
    level = [value]
    for _ in range(MAX_LEVELS):
        level = [
            v
            for container in level
            if isinstance(container, dict | list)
            for v in (container.values() if isinstance(container, dict) else container)
        ]
        if not level:
            return False
    return any(isinstance(v, dict | list) for v in level)


def read_json(path: Path, max_bytes: int = MAX_JSON_BYTES) -> Any:
    """Read a JSON file, never through a link; errors as for `read_file` and `parse_json`."""
    return parse_json(read_file(path, max_bytes, what="a JSON file"), str(path), max_bytes)


def unpack_zstd(data: bytes, max_bytes: int, shown: str) -> bytes:
    """Unpack one Zstandard frame that states its size, as our writers do.

    Raises:
        TooLarge: It unpacks to more than `max_bytes`.
        BadInput: It is damaged, or does not state its size.
    """
    try:
        size = zstandard.frame_content_size(data)
        if size < 0:
            raise BadInput(f"{shown}: does not state its unpacked size")
        if size > max_bytes:
            raise TooLarge(f"{shown}: unpacks to {size} bytes; at most {max_bytes} are allowed")
        return bytes(zstandard.ZstdDecompressor().decompress(data))
    except (zstandard.ZstdError, ValueError, MemoryError) as e:
        raise BadInput(f"{shown}: is damaged ({e})") from e


def _no_number(word: str) -> float:
    raise ValueError(f"{word} is not a number of JSON")


def _whole(digits: str) -> int:
    if len(digits) > MAX_DIGITS:
        raise ValueError(f"a whole number of {len(digits)} characters")
    return int(digits)
