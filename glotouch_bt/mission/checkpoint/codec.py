"""Values to bytes and back, for checkpoints: what skills write to ports, and what a robot says of its state.

Plain data, tuples, mappings, sets, numpy arrays and generators, enums and dataclasses, as MessagePack. Reading runs no
code of the file: it can only name dataclasses and enums, and only those of `known_packages`; they are made without
their `__init__`, so that not one bit of a kept value is normalised again. What was one object stays one object
(values compared by identity go on doing so), and arrays keep dtype, order and whether they may be written to.
"""

from __future__ import annotations

import dataclasses
import importlib
from collections import deque
from collections.abc import Callable, Mapping
from enum import Enum
from functools import lru_cache
from importlib.metadata import entry_points
from typing import Any, Literal

import msgspec
import numpy as np

from glotouch_bt.robot import BadInput, GlotouchError

OWN_PACKAGES = ("glotouch_bt", "glotouch_skills", "glotouch_backends")
GROUPS = ("glotouch_bt.skills", "glotouch_bt.backends")
DEEPEST = 200
"""Nesting that is refused: no value of a mission is that deep, a value that contains itself is."""
_SMALLEST, _LARGEST = -(2**63), 2**64 - 1
# One-letter marks of what is not plain; every non-plain value is a list [mark, ...].
_TUPLE, _LIST, _MAP, _SET, _FROZENSET, _DEQUE = "t", "l", "m", "s", "f", "q"
_ARRAY, _NUMBER, _BIG, _GENERATOR = "a", "n", "i", "g"
_ENUM, _DATA, _AGAIN = "e", "d", "r"
_DTYPES = "biufc"


class CannotKeep(GlotouchError):
    """A value of a kind that a checkpoint cannot hold."""


@lru_cache(maxsize=1)
def known_packages() -> frozenset[str]:
    """Top-level packages whose dataclasses and enums may be named: ours, and those that provide a skill or backend."""
    provided = {e.module.partition(".")[0] for group in GROUPS for e in entry_points(group=group)}
    return frozenset(provided | set(OWN_PACKAGES))


_DAMAGED = (
    msgspec.MsgspecError, ValueError, TypeError, KeyError, IndexError, AttributeError, RecursionError, OverflowError,
)  # fmt: skip
"""What reading damaged bytes can raise."""


def encode(value: object) -> bytes:
    """A value as bytes.

    Raises:
        CannotKeep: It holds something that cannot be kept; the message says what, and where in it.
    """
    return msgspec.msgpack.encode(Encoder().plain(value))


def decode(data: bytes) -> Any:
    """What `encode` was given.

    Raises:
        BadInput: Not from `encode`, from another version of a class, or of a class of a package not known here.
    """
    try:
        return _Decoder().value(msgspec.msgpack.decode(data))
    except BadInput:
        raise
    except _DAMAGED as e:
        raise BadInput(f"kept values cannot be read ({type(e).__name__}: {e})") from e


def encode_parts(parts: Mapping[str, object]) -> tuple[bytes, dict[str, str]]:
    """A mapping as bytes, less what cannot be kept; and of that, by name, why.

    What one part shares with another stays one object.
    """
    encoder, kept, lacking = Encoder(), [], {}
    encoder.reserve()
    for name, value in parts.items():
        try:
            kept.append([name, encoder.plain(value, name)])
        except CannotKeep as e:
            lacking[name] = str(e)
    return msgspec.msgpack.encode([_MAP, *kept]), lacking


class Encoder:
    """One message: objects met again within it become references."""

    def __init__(self) -> None:
        self._seen: dict[int, int] = {}
        self._kept: list[object] = []  # keeps the objects alive, so that an id means one object

    def reserve(self) -> None:
        """Count an object that the caller writes itself, round those to come."""
        self._kept.append(self)

    def plain(self, value: object, where: str = "value") -> Any:
        """`value` as what MessagePack holds.

        A value that cannot be kept leaves nothing behind: the next one may be tried.

        Raises:
            CannotKeep: See `encode`.
        """
        before = len(self._kept)
        try:
            return self._plain(value, where, 0)
        except CannotKeep:
            for lost in self._kept[before:]:
                del self._seen[id(lost)]
            del self._kept[before:]
            raise

    def _plain(self, value: Any, where: str, depth: int) -> Any:
        kind = type(value)
        if value is None or kind in (bool, str, bytes, float):
            return value
        if kind is int:
            return value if _SMALLEST <= value <= _LARGEST else [_BIG, str(value)]
        if depth > DEEPEST:
            raise CannotKeep(f"{where}: nested deeper than {DEEPEST}")
        number = self._seen.get(id(value))
        if number is not None:
            return [_AGAIN, number]
        if isinstance(value, np.generic):
            return [_NUMBER, _dtype(value.dtype, where), value.tobytes()]
        if isinstance(value, Enum):
            return [_ENUM, _class_name(kind, where), value.name]
        self._seen[id(value)] = len(self._kept)
        self._kept.append(value)
        return self._compound(value, kind, where, depth + 1)

    def _compound(self, value: Any, kind: type, where: str, depth: int) -> Any:
        if kind is np.ndarray:
            return _array(value, where)
        if kind is tuple:
            return [_TUPLE, *(self._plain(v, f"{where}[{i}]", depth) for i, v in enumerate(value))]
        if kind is list:
            return [_LIST, *(self._plain(v, f"{where}[{i}]", depth) for i, v in enumerate(value))]
        if kind is deque:
            items = [self._plain(v, f"{where}[{i}]", depth) for i, v in enumerate(value)]
            return [_DEQUE, value.maxlen, *items]
        if kind in (set, frozenset):
            ordered = sorted(value, key=repr)  # so that equal sets give equal bytes
            mark = _SET if kind is set else _FROZENSET
            return [mark, *(self._plain(v, f"{where}{{}}", depth) for v in ordered)]
        if dataclasses.is_dataclass(kind):
            name = _class_name(kind, where)
            names = [f.name for f in dataclasses.fields(kind)]
            parts = [[n, self._plain(getattr(value, n), f"{where}.{n}", depth)] for n in names]
            return [_DATA, name, *parts]
        if isinstance(value, Mapping):
            pairs = [
                [self._plain(k, f"{where} key", depth), self._plain(v, f"{where}[{k!r}]", depth)]
                for k, v in value.items()
            ]
            return [_MAP, *pairs]
        if kind is np.random.Generator:
            bits = value.bit_generator
            return [_GENERATOR, type(bits).__name__, self._plain(bits.state, f"{where} state", depth)]
        raise CannotKeep(f"{where} is a {kind.__module__}.{kind.__qualname__}, which cannot be kept")


def _array(value: np.ndarray[Any, Any], where: str) -> list[Any]:
    dtype = _dtype(value.dtype, where)
    order: Literal["C", "F"] = "F" if value.flags.f_contiguous and not value.flags.c_contiguous else "C"
    return [_ARRAY, dtype, list(value.shape), order, bool(value.flags.writeable), value.tobytes(order)]


def _dtype(dtype: np.dtype[Any], where: str) -> str:
    if dtype.kind not in _DTYPES:
        raise CannotKeep(f"{where} is an array of {dtype}, which cannot be kept")
    return dtype.str


def _class_name(kind: type, where: str) -> str:
    if kind.__module__.partition(".")[0] not in known_packages() or "<locals>" in kind.__qualname__:
        raise CannotKeep(f"{where} is a {kind.__module__}.{kind.__qualname__}: of no package that provides a skill")
    return f"{kind.__module__}:{kind.__qualname__}"


@lru_cache(maxsize=512)
def _named_class(name: str) -> type:
    """A dataclass or enum of a known package.

    Raises:
        BadInput: No such class here, or one that a file may not name.
    """
    module, _, qualname = name.partition(":")
    if module.partition(".")[0] not in known_packages():
        raise BadInput(f"kept values name {name}, of a package that provides no skill or backend here")
    try:
        found: Any = importlib.import_module(module)
        for part in qualname.split("."):
            found = vars(found)[part]
    except (ImportError, KeyError, TypeError, ValueError, AttributeError) as e:
        raise BadInput(f"kept values name {name}, which does not exist here: they are of another version") from e
    if not (isinstance(found, type) and (dataclasses.is_dataclass(found) or issubclass(found, Enum))):
        raise BadInput(f"kept values name {name}, which is neither a dataclass nor an enum")
    return found


class _Decoder:
    def __init__(self) -> None:
        self._made: list[Any] = []
        self._read: dict[str, Callable[[list[Any]], Any]] = {
            _TUPLE: self._tuple,
            _LIST: self._list,
            _MAP: self._map,
            _SET: self._set,
            _FROZENSET: self._frozenset,
            _DEQUE: self._deque,
            _ARRAY: self._array,
            _GENERATOR: self._generator,
            _DATA: self._data,
        }

    def value(self, plain: Any) -> Any:
        if not isinstance(plain, list):
            if isinstance(plain, dict):
                raise BadInput("kept values cannot be read (an unmarked mapping)")
            return plain
        mark, *rest = plain
        if mark == _AGAIN:
            return self._made[rest[0]]
        if mark == _BIG:
            return int(rest[0])
        if mark == _NUMBER:
            return np.frombuffer(rest[1], _known_dtype(rest[0]))[0]
        if mark == _ENUM:
            kind = _named_class(rest[0])
            if not issubclass(kind, Enum) or rest[1] not in kind.__members__:
                raise BadInput(f"kept values name {rest[0]}.{rest[1]}, which does not exist here")
            return kind.__members__[rest[1]]
        number = len(self._made)
        self._made.append(None)  # the place of this object; what is inside comes after it
        made = self._read[mark](rest)
        self._made[number] = made
        return made

    def _tuple(self, rest: list[Any]) -> Any:
        return tuple(self.value(v) for v in rest)

    def _list(self, rest: list[Any]) -> Any:
        return [self.value(v) for v in rest]

    def _map(self, rest: list[Any]) -> Any:
        return {self.value(k): self.value(v) for k, v in rest}

    def _set(self, rest: list[Any]) -> Any:
        return {self.value(v) for v in rest}

    def _frozenset(self, rest: list[Any]) -> Any:
        return frozenset(self.value(v) for v in rest)

    def _deque(self, rest: list[Any]) -> Any:
        return deque([self.value(v) for v in rest[1:]], maxlen=rest[0])

    def _array(self, rest: list[Any]) -> Any:
        name, shape, order, writeable, data = rest
        flat = np.frombuffer(data, _known_dtype(name))
        array = flat.reshape(tuple(shape), order="F" if order == "F" else "C").copy(order="K")
        array.setflags(write=bool(writeable))
        return array

    def _generator(self, rest: list[Any]) -> Any:
        if rest[0] not in ("PCG64", "PCG64DXSM", "MT19937", "Philox", "SFC64"):
            raise BadInput(f"kept values name the bit generator {rest[0]!r}, which is not known")
        bits = getattr(np.random, rest[0])()
        bits.state = self.value(rest[1])
        return np.random.Generator(bits)

    def _data(self, rest: list[Any]) -> Any:
        kind = _named_class(rest[0])
        if not dataclasses.is_dataclass(kind):
            raise BadInput(f"kept values name {rest[0]} as a dataclass; it is none")
        given, known = [n for n, _ in rest[1:]], [f.name for f in dataclasses.fields(kind)]
        if given != known:
            raise BadInput(
                f"kept values have {rest[0]} with fields {', '.join(given)}; here it has {', '.join(known)}: "
                "they are of another version"
            )
        made = object.__new__(kind)
        for name, plain in rest[1:]:
            object.__setattr__(made, name, self.value(plain))
        return made


def _known_dtype(name: object) -> np.dtype[Any]:
    dtype = np.dtype(str(name))
    if dtype.kind not in _DTYPES or dtype.names is not None:
        raise BadInput(f"kept values have an array of {name!r}, which is not read")
    return dtype
