"""Parse YAML text into nodes with source positions. Tags and anchors are refused; scalars are those of YAML 1.2 core.

The event stream is read without recursion, so no file can exhaust the stack. Every limit is checked while reading.
"""

from __future__ import annotations

import codecs
import math
import re
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml

from glotouch_bt.escaped_text import fault_of_name, fault_of_text
from glotouch_bt.mission.spec import Map, Node, Place, Scalar, Seq
from glotouch_bt.robot import BadInput
from glotouch_bt.untrusted import read_file

MAX_BYTES = 1_000_000
"""Largest size of a YAML file (bytes)."""
KEPT_BYTES = 32_000
"""Largest file whose nodes are kept: a mission reads the same subtree for each of its places. Source: ours."""
MAX_DEPTH = 60
"""Largest depth of collections inside one another."""

_INT = re.compile(r"[-+]?[0-9]{1,18}")
_FLOAT = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def read_yaml(path: Path, shown: str | None = None) -> Node:
    """Read one YAML document from a file.

    Args:
        path: The file.
        shown: Name of the file in messages (default: the path).

    Raises:
        BadInput: The file is not readable, over a limit, not YAML, or has anchors, aliases, tags or a duplicate key.
    """
    shown = shown or str(path)
    data = read_file(path, MAX_BYTES, what="a YAML file", links=True, shown=shown)
    return _kept(data, shown) if len(data) <= KEPT_BYTES else parse_yaml(data, shown)


@lru_cache(maxsize=64)
def _kept(data: bytes, shown: str) -> Node:
    """Parse a document unless it was parsed lately; nodes cannot be changed."""
    return parse_yaml(data, shown)


def read_named_yaml(path: Path, shown: str, key: str) -> Map:
    """Read a mapping with a certain key from a file that another file names; no message quotes what it holds.

    Raises:
        BadInput: As `read_yaml`, or the file is something else.
    """
    try:
        node = read_yaml(path, shown)
    except YamlRefused as e:
        raise BadInput(e.unquoted) from e
    if not isinstance(node, Map) or key not in node:
        raise BadInput(f"{shown}: is something else: it must be a mapping with {key!r}")
    return node


def parse_yaml(data: bytes | str, shown: str) -> Node:
    """Parse one YAML document; errors as in `read_yaml`."""
    text = _decode(data, shown)
    loader = _Loader(text)
    try:
        return _build(loader, shown)
    except yaml.reader.ReaderError as e:
        raise Unreadable(_at(text, e.position, shown), f"a character that YAML does not allow ({e.reason})") from e
    except yaml.MarkedYAMLError as e:
        mark = e.problem_mark or e.context_mark
        place = Place(shown, mark.line + 1, mark.column + 1) if mark else Place(shown)
        raise Unreadable(place, f"not valid YAML: {_fault_of_syntax(e, text)}") from e
    except yaml.YAMLError as e:
        raise BadInput(f"{shown}: not valid YAML: {e}") from e
    finally:
        loader.dispose()


def _decode(data: bytes | str, shown: str) -> str:
    if len(data) > MAX_BYTES:
        raise BadInput(f"{shown}: is larger than {MAX_BYTES} bytes")
    if isinstance(data, str):
        return data
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as e:
        line, column = data[: e.start].count(b"\n") + 1, e.start - (data.rfind(b"\n", 0, e.start) + 1) + 1
        utf16 = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        found = "but UTF-16" if utf16 else f"(byte 0x{data[e.start]:02x})"
        raise Unreadable(Place(shown, line, column), f"not UTF-8 text {found}") from e


def _at(text: str, position: int, shown: str) -> Place:
    before = text[: max(position, 0)]
    return Place(shown, before.count("\n") + 1, len(before) - (before.rfind("\n") + 1) + 1)


def _fault_of_syntax(error: yaml.MarkedYAMLError, text: str) -> str:
    """Return what is wrong with the syntax; YAML's own words do not say that the indentation is."""
    mark, block = error.problem_mark or error.context_mark, error.context_mark
    words = str(error.problem or error.context)
    if mark is None:
        return words
    if text[mark.index : mark.index + 1] == "\t":
        return "a tab; indent with blanks"
    first = not text[mark.index - mark.column : mark.index].strip()
    if first and block is not None and "block" in str(error.context) and mark.column != block.column:
        return f"{words}; this line begins in another column than its neighbours"
    if "mapping values are not allowed" in words:
        return f"{words}; begin the line in the column of its neighbours, or quote a text that has ': ' in it"
    return words


class Unreadable(BadInput):
    """A document that cannot or may not be read.

    Attributes:
        place: Where.
        what: What is wrong.
    """

    def __init__(self, place: Place, what: str) -> None:
        super().__init__(f"{place}: {what}")
        self.place, self.what = place, what


class YamlRefused(Unreadable):
    """A document that may not be read.

    Args:
        place: Where.
        what: What is wrong; `{}` stands for a piece of the document.
        piece: That piece.

    Attributes:
        unquoted: The message without the piece, for a file that the user did not name.
    """

    def __init__(self, place: Place, what: str, piece: str) -> None:
        super().__init__(place, what.format(piece))
        self.unquoted = f"{place}: {what.format('...')}"


class _Open:
    """A collection under construction."""

    def __init__(self, place: Place, is_map: bool) -> None:
        self.place, self.is_map = place, is_map
        self.items: list[Node] = []
        self.seen: dict[str, Place] = {}

    def add(self, node: Node) -> None:
        if self.is_map and len(self.items) % 2 == 0:
            self._check_key(node)
        self.items.append(node)

    def _check_key(self, key: Node) -> None:
        if not isinstance(key, Scalar) or not isinstance(key.value, str):
            raise Unreadable(key.place, "a key must be a plain word")
        if key.value == "<<":
            raise Unreadable(key.place, "merge keys (<<) are not allowed")
        if key.value in self.seen:
            first = self.seen[key.value]
            raise YamlRefused(key.place, f"duplicate key {{}} (first at line {first.line})", repr(key.value))
        if key.value and (fault := fault_of_name(key.value)):
            raise Unreadable(key.place, f"this key {fault}")
        self.seen[key.value] = key.place

    def close(self) -> Node:
        if not self.is_map:
            return Seq(tuple(self.items), self.place)
        keys = [k for k in self.items[::2] if isinstance(k, Scalar)]
        return Map(tuple(zip(keys, self.items[1::2], strict=True)), self.place)


def _build(loader: Any, shown: str) -> Node:
    stack: list[_Open] = []
    root: Node | None = None
    while True:
        event = loader.get_event()
        if event is None or isinstance(event, yaml.StreamEndEvent):
            break
        if isinstance(event, (yaml.StreamStartEvent, yaml.DocumentStartEvent, yaml.DocumentEndEvent)):
            if isinstance(event, yaml.DocumentStartEvent) and root is not None:
                raise Unreadable(_place(event, shown), "a second document; a file holds one document")
            continue
        _refuse(event, shown)
        if isinstance(event, (yaml.MappingStartEvent, yaml.SequenceStartEvent)):
            if len(stack) >= MAX_DEPTH:
                raise Unreadable(_place(event, shown), f"nested deeper than {MAX_DEPTH} levels")
            stack.append(_Open(_place(event, shown), isinstance(event, yaml.MappingStartEvent)))
            continue
        node = _scalar(event, shown) if isinstance(event, yaml.ScalarEvent) else stack.pop().close()
        if stack:
            stack[-1].add(node)
        else:
            root = node
    if root is None:
        raise Unreadable(Place(shown), "holds no YAML document")
    return root


def _place(event: Any, shown: str) -> Place:
    return Place(shown, event.start_mark.line + 1, event.start_mark.column + 1)


def _refuse(event: Any, shown: str) -> None:
    place = _place(event, shown)
    if isinstance(event, yaml.AliasEvent):
        raise YamlRefused(place, "aliases (*{}) are not allowed; write the value out", str(event.anchor))
    if getattr(event, "anchor", None):
        raise YamlRefused(place, "anchors (&{}) are not allowed; write the value out", event.anchor)
    if getattr(event, "tag", None):
        raise YamlRefused(place, "tags ({}) are not allowed; only plain values, lists and mappings", event.tag)


def _scalar(event: Any, shown: str) -> Scalar:
    place, text = _place(event, shown), event.value
    if fault := fault_of_text(text):
        raise Unreadable(place, f"this text {fault}; a terminal would execute it")
    if event.style not in (None, ""):
        return Scalar(text, place)
    if text in ("", "~", "null", "Null", "NULL"):
        return Scalar(None, place)
    if text in ("true", "True", "TRUE", "false", "False", "FALSE"):
        return Scalar(text.lower() == "true", place)
    number = float("nan") if _NOT_FINITE.fullmatch(text) else number_of(text)
    if isinstance(number, float) and not math.isfinite(number):
        raise YamlRefused(place, "{} is not a finite number", text[:40])
    return Scalar(text if number is None else number, place)


def number_of(text: str) -> int | float | None:
    """Return the number that a text is, as in YAML and on the command line; None for other text (`1_0`, `0x10`)."""
    if _INT.fullmatch(text):
        return int(text)
    return float(text) if _FLOAT.fullmatch(text) else None
