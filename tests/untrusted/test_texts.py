"""JSON and Zstandard within bounds; values against annotations."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import pytest
import zstandard

from glotouch_bt.robot import BadInput, Pose
from glotouch_bt.untrusted import TooLarge, parse_json, read_json, require_type, unpack_zstd
from glotouch_bt.untrusted.texts import MAX_LEVELS


@pytest.mark.parametrize(
    "text", ["", "{", "[" * 100_000, '{"a": NaN}', "-Infinity", "9" * 5000, b"\xff", "[1] x", "1" * 21]
)
def test_what_is_no_json_is_refused(text: str | bytes) -> None:
    with pytest.raises(BadInput, match="here"):
        parse_json(text, "here")


def test_json_is_bounded(tmp_path: Path) -> None:
    assert parse_json('{"a": [1, 2.5, "x", null]}', "here") == {"a": [1, 2.5, "x", None]}
    with pytest.raises(BadInput, match="larger than 5"):
        parse_json("[1, 2]", "here", 5)
    (tmp_path / "a.json").write_text("[" + "1," * 100 + "1]")
    assert len(read_json(tmp_path / "a.json")) == 101
    with pytest.raises(BadInput, match="larger"):
        read_json(tmp_path / "a.json", 100)


def test_a_bomb_is_refused_before_it_is_unpacked() -> None:
    small = zstandard.compress(b"x" * 1000)
    assert unpack_zstd(small, 1000, "here") == b"x" * 1000
    with pytest.raises(TooLarge, match="unpacks to 1000 bytes; at most 999"):
        unpack_zstd(small, 999, "here")
    bomb = bytearray(zstandard.compress(bytes(300_000_000)))
    assert len(bomb) < 50_000
    with pytest.raises(TooLarge):
        unpack_zstd(bytes(bomb), 1_000_000, "here")
    stream = zstandard.ZstdCompressor(write_content_size=False).compress(b"x" * 1000)
    for damaged in (stream, b"", b"rubbish", small[:-4], small[:6] + b"\xff" + small[7:]):
        with pytest.raises(BadInput, match="here"):
            unpack_zstd(damaged, 10_000, "here")


FITTING: list[tuple[Any, Any]] = [
    (1.0, float), (1, float), (np.float64(1.0), float), (np.int64(1), int), (True, bool), ("a", str),
    (None, str | None), ((1, 2.0), tuple[int, float]),
    ((1, 2, 3), tuple[int, ...]), ((), tuple[int, ...]), ([1], list[int]),
    ({"a": 1}, Mapping[str, int]), ([1], Sequence[int]), (deque([1]), deque[int]), (frozenset("a"), frozenset[str]),
    (np.zeros(3), npt.NDArray[np.float64]), (np.zeros(3, bool), npt.NDArray[np.bool_]), ("a", Literal["a", "b"]),
    (Pose(np.zeros(3)), Pose), (3, Any), ([object()], Any),
]  # fmt: skip
UNFITTING: list[tuple[Any, Any]] = [
    ("1", float), (True, float), (1.0, int), (True, int), (1, bool), (None, str), (1, str | None),
    ((1,), tuple[int, int]), ((1, "a"), tuple[int, ...]), ([1], tuple[int, ...]), ((1,), list[int]),
    ({1: 1}, dict[str, int]), ({"a": "b"}, dict[str, int]),
    ([1], np.ndarray), (np.zeros(3, np.int64), npt.NDArray[np.float64]), ("c", Literal["a", "b"]), ("a", Pose),
]  # fmt: skip


@pytest.mark.parametrize(("value", "hint"), FITTING)
def test_values_that_fit(value: Any, hint: Any) -> None:
    require_type(value, hint, "here")


@pytest.mark.parametrize(("value", "hint"), UNFITTING)
def test_values_that_do_not_fit(value: Any, hint: Any) -> None:
    with pytest.raises(BadInput, match="here is a"):
        require_type(value, hint, "here")


@pytest.mark.parametrize("opening", ["[", '{"a":'])
def test_json_that_is_nested_deep_is_refused_before_anything_walks_it(opening: str) -> None:
    closing = "]" if opening == "[" else "}"
    for levels, refused in ((MAX_LEVELS, False), (MAX_LEVELS + 1, True), (300, True)):
        text = opening * levels + "1" + closing * levels
        for data in (text, text.encode(), text.encode("utf-16")):
            if refused:
                with pytest.raises(BadInput, match="nested"):
                    parse_json(data, "result.json")
            else:
                parse_json(data, "result.json")


def test_wide_json_is_read() -> None:
    assert len(parse_json("[" + ",".join(["[]"] * 10_000) + "]", "f")) == 10_000
