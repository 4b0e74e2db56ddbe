"""Corrupt documents: as data before serialisation, and as bytes afterwards."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from copy import deepcopy
from typing import Any

import numpy as np
import yaml

from glotouch_bt.validation.fuzz.documents import Document, pick
from glotouch_bt.validation.fuzz.watch import CANARY

Rng = np.random.Generator

ODD_VALUES: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 2**31, -(2**63), 10**30, 10**400, 0.0, -0.0, 1e308, 1e-320, float("nan"), float("inf"),
    "", " ", "nan", "$", "$n", "$missing", "$$n", "${n}", "{{ 7 * 7 }}", "../../../../etc/passwd", "/dev/zero",
    "/dev/stdin", "/proc/self/mem", "/proc/self/fd/0", ".", "/", "x" * 5000, "Ünï\u202e\u0000".replace("\u0000", ""),
    "\U0001f9be", "a.b", "a/b", "__class__", "__import__('os')", f"__import__('os').system('touch {CANARY}')",
    "on", "null", "12 parsecs", "1e3 mm", "-0 N", "1_000", "0x10", "08", [], {}, [[]], [1, [2, [3]]], {"do": "squeeze"},
    ["squeeze"] * 3, {"a": {"b": {"c": None}}}, "2026-11-21", "1:30", "=", "<<",
)  # fmt: skip

ODD_TEXTS: tuple[str, ...] = (
    "!!python/object/apply:os.system ['touch {canary}']", "!!python/name:os.system", "!!python/module:{canary}",
    "!!python/object/new:os.system [x]", "!!binary aGVsbG8=", "!!set {{a}}", "!!timestamp 2026-11-21", "!!float nan",
    "!<tag:x> y", "&a [*a, *a]", "*a", "&a", "<<: *a", "- - - - - -", "? complex\n: key", "%YAML 1.1", "---", "...",
    "|\n  text", ">-", "\t", "\x00", "\ufeff", "\u2028", "\x85", "\r\n", "'", '"', "{{", "}}", "[", "]", ": ", "#", ",",
    "@", "`", "\\x41", '"\\ud800"', "\U0010ffff", "0" * 400, "9" * 5000, "1e999", ".nan", "-.inf", "~", "=", "!!str",
    "!", "|+99", ">0",
)  # fmt: skip


def corrupt_data(document: Document, rng: Rng) -> Document:
    """Make a few random changes to the data, in place."""
    holder = {"": document}
    for _ in range(int(rng.integers(1, 4))):
        places = list(_places(holder))
        _CHANGES[int(rng.integers(len(_CHANGES)))](pick(rng, places), places, rng)
    return holder[""]


Place = tuple[Any, Any]


def _places(value: Any) -> Iterator[Place]:
    """Yield every (container, key) of nested data."""
    stack = [value]
    while stack:
        here = stack.pop()
        for key, below in list(here.items() if isinstance(here, dict) else enumerate(here)):
            yield here, key
            if isinstance(below, (dict, list)):
                stack.append(below)


def _replace(place: Place, places: list[Place], rng: Rng) -> None:
    place[0][place[1]] = deepcopy(pick(rng, ODD_VALUES))  # the next change may happen inside it


def _delete(place: Place, places: list[Place], rng: Rng) -> None:
    if place[1] != "":
        del place[0][place[1]]


def _rename(place: Place, places: list[Place], rng: Rng) -> None:
    holder, key = place
    if isinstance(holder, dict) and key != "":
        names = [str(k) for h, k in places if isinstance(h, dict)]
        names += ["tree", "do", "in", "out", "subtree", "", "<<", "é"]
        text = str(key)
        typo = text[: int(rng.integers(len(text) + 1))] + text[int(rng.integers(len(text) + 1)) :]
        holder[pick(rng, (pick(rng, names), typo, None, 7, True))] = holder.pop(key)


def _move(place: Place, places: list[Place], rng: Rng) -> None:
    """Copy one part over another, never into itself: a document is a tree."""
    other = pick(rng, places)
    part = other[0][other[1]]
    if not isinstance(part, (dict, list)):
        place[0][place[1]] = part
    else:
        place[0][place[1]] = yaml.safe_load(yaml.safe_dump(part)) if _small(part) else None


def _small(part: Any) -> bool:
    return sum(1 for _ in _places(part)) < 300


def _nest(place: Place, places: list[Place], rng: Rng) -> None:
    value = place[0][place[1]]
    deep = int(pick(rng, (3, 30, 70, 500)))
    name = pick(rng, ("sequence", "invert", "retry", "do", "selector"))
    for _ in range(deep):
        value = [value] if rng.random() < 0.5 else {name: value}
    place[0][place[1]] = value


def _widen(place: Place, places: list[Place], rng: Rng) -> None:
    value = place[0][place[1]]
    if not isinstance(value, (dict, list)):
        place[0][place[1]] = [value] * int(pick(rng, (2, 40, 400)))


def _subtree(place: Place, places: list[Place], rng: Rng) -> None:
    files = ("m.yaml", "subtrees/take_probe.yaml", "missing.yaml", "..", "/dev/zero", "/etc/passwd", "", "self.yaml",
             "pipe")  # fmt: skip
    place[0][place[1]] = {"subtree": {"file": pick(rng, files), "ports": pick(rng, ({}, {"tool": "tool"}, {"x": "Y"}))}}


_CHANGES: tuple[Callable[[Place, list[Place], Rng], None], ...] = (
    _replace, _replace, _replace, _delete, _rename, _move, _nest, _widen, _subtree,
)  # fmt: skip


def levels_of(document: Any) -> int:
    """Return how deep lists and mappings are nested."""
    levels, layer = 0, [document]
    while layer:
        parts = [v for v in layer if isinstance(v, dict | list)]
        layer = [c for v in parts for c in (v.values() if isinstance(v, dict) else v)]
        levels += bool(parts)
    return levels


def as_text(document: Any, rng: Rng) -> bytes:
    """Serialise the document as YAML in a random style."""
    style = pick(rng, (None, False, False, True))
    options: dict[str, Any] = {"default_flow_style": style, "sort_keys": bool(rng.random() < 0.2)}
    options |= {"allow_unicode": bool(rng.random() < 0.8), "width": int(pick(rng, (40, 110, 1000)))}
    return str(yaml.dump(document, Dumper=_Dumper, **options)).encode("utf-8", "surrogatepass")


class _Dumper(yaml.SafeDumper):
    """YAML dumper without anchors; only `ODD_TEXTS` adds them."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def corrupt_bytes(text: bytes, rng: Rng) -> bytes:
    """Make a few random changes to the bytes."""
    for _ in range(int(rng.integers(1, 5))):
        text = pick(rng, _TEXT_CHANGES)(text, rng)
    return text


def _flip(text: bytes, rng: Rng) -> bytes:
    data = bytearray(text)
    for _ in range(int(rng.integers(1, 9))):
        if data:
            data[int(rng.integers(len(data)))] = int(rng.integers(256))
    return bytes(data)


def _insert(text: bytes, rng: Rng) -> bytes:
    at = int(rng.integers(len(text) + 1))
    return text[:at] + _odd_text(rng) + text[at:]


def _odd_text(rng: Rng) -> bytes:
    word = pick(rng, ODD_TEXTS).replace("{canary}", CANARY).replace("{{", "{").replace("}}", "}")
    return word.encode("utf-8", "surrogatepass")


def _after_colon(text: bytes, rng: Rng) -> bytes:
    """Replace a value by an odd text."""
    places = [i for i in range(len(text)) if text[i : i + 2] == b": "]
    if not places:
        return _insert(text, rng)
    at = pick(rng, places) + 2
    end = text.find(b"\n", at)
    return text[:at] + _odd_text(rng) + text[end if end >= 0 else len(text) :]


def _cut(text: bytes, rng: Rng) -> bytes:
    start, end = sorted(int(v) for v in rng.integers(0, len(text) + 1, 2))
    return text[:start] if rng.random() < 0.3 else text[:start] + text[end:]


def _lines(text: bytes, rng: Rng) -> bytes:
    """Duplicate, delete, move or re-indent a line."""
    lines = text.split(b"\n")
    i = int(rng.integers(len(lines)))
    line = lines[i]
    what = int(rng.integers(4))
    if what == 0:
        lines.insert(i, line)
    elif what == 1:
        del lines[i]
    elif what == 2:
        lines.insert(int(rng.integers(len(lines))), lines.pop(i))
    else:
        lines[i] = pick(rng, (b" ", b"  ", b"\t", b"", b"    ")) + line.lstrip()
    return b"\n".join(lines)


def _encode(text: bytes, rng: Rng) -> bytes:
    decoded = text.decode("utf-8", "replace")
    return pick(rng, (decoded.encode("utf-16"), decoded.encode("utf-8-sig"), text.replace(b"\n", b"\r\n"),
                      decoded.encode("latin-1", "replace"), text * 3, b""))  # fmt: skip


_TEXT_CHANGES: tuple[Callable[[bytes, Rng], bytes], ...] = (_flip, _insert, _after_colon, _cut, _lines, _lines, _encode)
