"""JSON text of results, with null in place of the numbers that JSON lacks."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from typing import Any


def json_text(data: object, default: Callable[[Any], Any] | None = None) -> str:
    """Return indented JSON that ends with a newline; NaN and infinities become null.

    Args:
        data: Mappings, lists, tuples, text, numbers, None.
        default: Converts values of other types, as in `json.dumps`.
    """
    return json.dumps(finite(data), indent=2, allow_nan=False, default=default) + "\n"


def finite(value: Any) -> Any:
    """Return a copy in which None replaces NaN and infinities, at any depth of mappings, lists and tuples."""
    if isinstance(value, Mapping):
        return {k: finite(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [finite(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
