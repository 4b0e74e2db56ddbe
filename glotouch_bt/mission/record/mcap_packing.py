"""Pack columns of numbers into a compact binary message that describes its own layout: the full-rate data of a record.

A column is rounded to a given step, differenced along time, and written byte plane by byte plane, so that the chunk
compression of the file finds mostly zeros. The message is a Protocol Buffers message of one schema
(`PACKED_DESCRIPTOR`), so any MCAP tool can open it; docs/reference/record.md explains how to unpack it by hand.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import numpy.typing as npt

from glotouch_bt.compiled import compiled
from glotouch_bt.robot import Array, GlotouchError

PACKED_NAME = "glotouch.Packed"
_NAN = -(2**31)
"""Steps that stand for a number that is not finite."""
MAX_ORDER, MAX_COLUMNS, MAX_DIMENSIONS = 2, 64, 4
"""Largest layout that is read: differences along time, columns, dimensions of a row."""


@dataclass(frozen=True)
class Column:
    """The layout of one packed quantity.

    Attributes:
        name: Name with unit and frame.
        shape: Shape of one row; () for a number.
        step: Rounding step, in the unit of the name.
        order: Number of differences along time (0 for white noise, 1 for steps, 2 for smooth motion).
    """

    name: str
    shape: tuple[int, ...]
    step: float
    order: int

    @cached_property
    def width(self) -> int:
        """Count of numbers in one row."""
        return math.prod(self.shape)

    def __str__(self) -> str:
        return f"{self.name}:{'x'.join(map(str, self.shape)) or '1'}:{self.step:g}:{self.order}"

    @classmethod
    def parse(cls, text: str) -> Column:
        """Return the column that one word of a layout describes.

        Raises:
            ValueError: It describes none, or one beyond the limits.
        """
        name, shape, step, order = text.split(":")
        column = cls(name, () if shape == "1" else tuple(int(s) for s in shape.split("x")), float(step), int(order))
        fits = len(column.shape) <= MAX_DIMENSIONS and all(1 <= n < 2**24 for n in column.shape)
        if not (fits and 0.0 < column.step < 1e6 and 0 <= column.order <= MAX_ORDER):
            raise ValueError(f"a column {text!r}")
        return column


@compiled("given f8[:, :]", "f8", "i8")
def _steps(values: Array, per_step: float, order: int) -> npt.NDArray[np.int32]:
    """Return values (rows, width) in steps, differenced `order` times along time, as (width, rows)."""
    rows, width = values.shape
    out = np.zeros((width, rows), dtype=np.int32)
    for j in range(width):
        for i in range(rows):
            scaled = np.rint(values[i, j] * per_step)
            if np.isfinite(scaled):
                out[j, i] = np.int32(min(max(scaled, _NAN + 1.0), -_NAN - 1.0))
            else:
                out[j, i] = _NAN
        for _ in range(order):
            for i in range(rows - 1, 0, -1):
                out[j, i] -= out[j, i - 1]  # may wrap modulo 2^32; the sum wraps back
    return out


@compiled("given u1[:, :, :]", "i8", "f8")
def _values(planes: npt.NDArray[np.uint8], order: int, step: float) -> Array:
    """Return the values (rows, width) of byte planes (width, 4, rows): the inverse of `_steps`."""
    width, _, rows = planes.shape
    out = np.zeros((rows, width))
    steps = np.zeros(rows, dtype=np.int32)
    for j in range(width):
        for i in range(rows):
            number = np.int64(0)
            for byte in range(4):
                number |= np.int64(planes[j, byte, i]) << (8 * byte)
            steps[i] = np.int32(number)
        for _ in range(order):
            for i in range(1, rows):
                steps[i] += steps[i - 1]
        for i in range(rows):
            out[i, j] = np.nan if steps[i] == _NAN else steps[i] * step
    return out


def pack(start_ns: int, columns: Sequence[Column], values: Sequence[npt.ArrayLike]) -> bytes:
    """Return one packed message.

    Args:
        start_ns: Robot clock of the first row, ns.
        columns: Layout of each quantity.
        values: One array (rows, *shape) for each column, all of equal length. Infinities are read back as NaN.
    """
    blocks: list[bytes] = []
    rows = 0
    for column, value in zip(columns, values, strict=True):
        a = np.asarray(value, dtype=np.float64)
        rows = len(a)
        a = a.reshape(rows, column.width)
        steps = _steps(a, 1.0 / column.step, column.order)
        planes = steps.astype("<i4", copy=False).view(np.uint8).reshape(column.width, rows, 4)
        blocks.append(planes.transpose(0, 2, 1).tobytes())
    layout = " ".join(map(str, columns)).encode()
    data = b"".join(blocks)
    head = _tag(1, 0) + _varint(start_ns & (2**64 - 1)) + _tag(2, 0) + _varint(rows)
    return b"".join((head, _field(3, layout), _field(4, data)))


def unpack(message: bytes | memoryview) -> tuple[int, dict[str, Array]]:
    """Return the start stamp in ns and the columns (rows, *shape) of a packed message.

    Raises:
        GlotouchError: The bytes are not a packed message.
    """
    start_ns, rows, layout, data = 0, 0, b"", b""
    at = 0
    try:
        while at < len(message):
            key, at = _read_varint(message, at)
            if key & 7 == 0:
                number, at = _read_varint(message, at)
                start_ns, rows = (number, rows) if key >> 3 == 1 else (start_ns, number)
            elif key & 7 == 2:
                size, at = _read_varint(message, at)
                chunk, at = bytes(message[at : at + size]), at + size
                layout, data = (chunk, data) if key >> 3 == 3 else (layout, chunk)
            else:
                raise GlotouchError(f"not a {PACKED_NAME} message (wire type {key & 7})")
        columns = _columns(layout)
        if rows < 1 or not columns or len(data) != 4 * rows * sum(c.width for c in columns):
            raise GlotouchError(f"{PACKED_NAME}: {len(data)} bytes do not hold {rows} rows of {layout.decode()!r}")
    except (IndexError, ValueError) as e:
        raise GlotouchError(f"not a {PACKED_NAME} message ({e})") from e
    out: dict[str, Array] = {}
    at = 0
    for c in columns:
        size = 4 * rows * c.width
        planes = np.frombuffer(data, np.uint8, size, at).reshape(c.width, 4, rows)
        at += size
        out[c.name] = _values(planes, c.order, c.step).reshape(rows, *c.shape)
    return start_ns - 2**64 if start_ns >= 2**63 else start_ns, out


@lru_cache(maxsize=64)
def _columns(layout: bytes) -> tuple[Column, ...]:
    """Return the columns of a layout; raises as `Column.parse`."""
    return tuple(Column.parse(word) for word in layout.decode().split(None, MAX_COLUMNS))


def join(parts: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    """Concatenate the unpacked messages of one channel."""
    if not parts:
        return {}
    return {name: np.concatenate([p[name] for p in parts]) for name in parts[0]}


def _varint(n: int) -> bytes:
    out = bytearray()
    while n > 0x7F:
        out.append(n & 0x7F | 0x80)
        n >>= 7
    out.append(n)
    return bytes(out)


def _read_varint(data: bytes | memoryview, at: int) -> tuple[int, int]:
    n = shift = 0
    while True:
        byte = data[at]
        at += 1
        n |= (byte & 0x7F) << shift
        if byte < 0x80:
            return n, at
        shift += 7
        if shift > 63:
            raise ValueError("a number of more than 64 bit")


def _tag(number: int, wire: int) -> bytes:
    return _varint(number << 3 | wire)


def _field(number: int, data: bytes) -> bytes:
    return _tag(number, 2) + _varint(len(data)) + data


def _packed_descriptor() -> bytes:
    """Return the schema as a serialised FileDescriptorSet, as MCAP requires (field numbers of descriptor.proto)."""
    package, name = PACKED_NAME.split(".")
    optional, int64, uint32, string, raw = 1, 3, 13, 9, 12
    fields = b""
    for number, (field, kind) in enumerate(
        (("start_ns", int64), ("rows", uint32), ("layout", string), ("data", raw)), start=1
    ):
        numbers = ((3, number), (4, optional), (5, kind))
        fields += _field(2, _field(1, field.encode()) + b"".join(_tag(n, 0) + _varint(v) for n, v in numbers))
    message = _field(1, name.encode()) + fields
    file = (
        _field(1, b"glotouch/packed.proto") + _field(2, package.encode()) + _field(4, message) + _field(12, b"proto3")
    )
    return _field(1, file)


PACKED_DESCRIPTOR = _packed_descriptor()
