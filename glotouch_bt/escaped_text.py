"""Escape text once, where it leaves the program: for a terminal, HTML, XML or JSON.

Names and messages may hold what a stranger wrote. Inside the program they are plain; only these functions escape them.
"""

from __future__ import annotations

import html
import json
import math
import re
from collections.abc import Callable, Mapping
from typing import Any

_INVISIBLE = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f"  # control characters: a terminal obeys them, and XML has none of them
    "\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069"  # marks that reorder or break a line
    "\ud800-\udfff\ufeff\ufffe\uffff]"  # halves of characters (of names that are not UTF-8), and no characters
)
_BREAK = re.compile("[\t\n]")


def visible(text: str) -> str:
    """Return text in which every character can be seen: others become escapes such as \\x1b. Line breaks stay."""
    return _INVISIBLE.sub(lambda found: found[0].encode("unicode_escape").decode(), text)


def fault_of_name(name: str) -> str:
    """Return why a text cannot name something (a node, an object, a plan), or nothing."""
    if not name.strip():
        return "is empty"
    if _BREAK.search(name):
        return "has a line break or a tab in it"
    return fault_of_text(name)


def fault_of_text(text: str) -> str:
    """Return why a text is not plain text of a file, or nothing. It may have line breaks."""
    found = _INVISIBLE.search(text)
    return "" if found is None else f"has a control character in it (U+{ord(found[0]):04X})"


def html_text(value: object) -> str:
    """Return text for HTML and SVG, attributes included."""
    return html.escape(visible(str(value)), quote=True)


def xml_text(text: str) -> str:
    """Return text that an XML writer may take, which escapes the rest itself."""
    return visible(text)


def json_text(data: object, default: Callable[[Any], Any] | None = None) -> str:
    """Return indented JSON of ASCII characters that ends with a newline; NaN and infinities become null.

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
