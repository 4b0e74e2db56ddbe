"""Parsed YAML values with their positions in the file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, order=True)
class Place:
    """A position in a file; line and column count from 1. Line 0: the command line, not a file."""

    file: str
    line: int = 0
    column: int = 0

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}" if self.line else self.file


@dataclass(frozen=True)
class Scalar:
    """A single value: None, bool, int, float or str.

    Attributes:
        value: The value.
        place: Its position.
        unit: Unit of the number when it came from a mission parameter that declares one; else empty.
        origin: "$name" when it came from a mission parameter; else empty.
        span: Range of that parameter, in its unit; or None.
        poisoned: The value is unusable and already reported.
    """

    value: bool | int | float | str | None
    place: Place
    unit: str = ""
    origin: str = ""
    span: tuple[float, float] | None = None
    poisoned: bool = False


@dataclass(frozen=True)
class Seq:
    """A list."""

    items: tuple[Node, ...]
    place: Place


@dataclass(frozen=True)
class Map:
    """A mapping; keys are strings, without duplicates."""

    entries: tuple[tuple[Scalar, Node], ...]
    place: Place

    def get(self, key: str) -> Node | None:
        """Return the value of a key, or None."""
        return next((v for k, v in self.entries if k.value == key), None)

    def key_place(self, key: str) -> Place:
        """Return the position of a key (of the mapping if it has no such key)."""
        return next((k.place for k, _ in self.entries if k.value == key), self.place)

    def values(self) -> list[Node]:
        """Return all values, in order."""
        return [v for _, v in self.entries]

    def __contains__(self, key: str) -> bool:
        return self.get(key) is not None

    def keys(self) -> list[str]:
        """Return all keys, in order."""
        return [str(k.value) for k, _ in self.entries]


Node = Scalar | Seq | Map


def walk(node: Node) -> Iterator[Node]:
    """Yield a node and everything inside it, without recursion."""
    stack = [node]
    while stack:
        node = stack.pop()
        yield node
        stack.extend(node.items if isinstance(node, Seq) else node.values() if isinstance(node, Map) else ())


def plain(node: Node, renamed: Mapping[Place, str] | None = None) -> Any:
    """Return the node as dicts, lists and values; `renamed`: other text for the scalars at some positions."""
    if isinstance(node, Scalar):
        return renamed.get(node.place, node.value) if renamed else node.value
    if isinstance(node, Seq):
        return [plain(i, renamed) for i in node.items]
    return {str(k.value): plain(v, renamed) for k, v in node.entries}
