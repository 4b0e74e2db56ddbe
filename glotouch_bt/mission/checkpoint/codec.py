"""Encode checkpoint values (port values, robot state) as MessagePack and decode them.

Supported: plain data, tuples, mappings, sets, deques, numpy arrays and generators, enums and dataclasses. Decoding runs
no code from the file: it can only name dataclasses and enums of `known_packages`, and their fields must fit their
annotations. They are created without `__init__`, so that values come back to the bit. Shared objects stay shared, and
arrays keep dtype, order and the writeable flag. The number of values is bounded before any is made (`bounds`).
"""

from __future__ import annotations

import dataclasses
import importlib
import sys
from collections import deque
from collections.abc import Callable, Mapping
from enum import Enum
from functools import lru_cache
from typing import Any, Literal

import msgspec
import numpy as np

from glotouch_bt.mission.checkpoint.bounds import MAX_VALUES, require_few_values
from glotouch_bt.plugins import plugins
from glotouch_bt.robot import BadInput, GlotouchError
from glotouch_bt.untrusted import field_types, require_type

OWN_PACKAGES = ("glotouch_bt", "glotouch_skills", "glotouch_backends")
GROUPS = ("glotouch_bt.skills", "glotouch_bt.backends")
MAX_DEPTH = 200
"""Deepest nesting that is encoded; only a value that contains itself is deeper."""
MAX_DIMENSIONS = 8
"""Maximum number of dimensions of an array."""
_MIN_INT, _MAX_INT = -(2**63), 2**64 - 1
# One-letter tags; every value that MessagePack has no type for is a list [tag, ...].
_TUPLE, _LIST, _MAP, _SET, _FROZENSET, _DEQUE = "t", "l", "m", "s", "f", "q"
_ARRAY, _NUMBER, _BIG, _GENERATOR = "a", "n", "i", "g"
_ENUM, _DATA, _AGAIN = "e", "d", "r"
_SEQUENCES = {tuple: _TUPLE, list: _LIST, deque: _DEQUE}
_DTYPES = "biufc"


class NotEncodable(GlotouchError):
    """A value of a type that a checkpoint cannot hold."""


@lru_cache(maxsize=1)
def known_packages() -> frozenset[str]:
    """Return the top-level packages whose classes a file may name: ours and those that provide skills or backends."""
    provided = {e.module.partition(".")[0] for group in GROUPS for e in plugins(group).values()}
    return frozenset(provided | set(OWN_PACKAGES))


_DAMAGED = (
    msgspec.MsgspecError, ValueError, TypeError, LookupError, AttributeError, RecursionError, OverflowError,
    MemoryError,
)  # fmt: skip
"""Errors that decoding damaged bytes can raise."""


def encode(value: object) -> bytes:
    """Return a value as bytes.

    Raises:
        NotEncodable: Some part of it cannot be encoded; the message names the part and its type.
    """
    return msgspec.msgpack.encode(Encoder().plain(value))


def decode(data: bytes) -> Any:
    """Return the value that `encode` was given.

    Raises:
        BadInput: The bytes are damaged, hold too many values, or name a class that is unknown here or of another
            version.
    """
    require_few_values(data)
    try:
        return _Decoder().value(msgspec.msgpack.decode(data))
    except BadInput:
        raise
    except _DAMAGED as e:
        raise BadInput(f"checkpoint values cannot be read ({type(e).__name__}: {e})") from e


def encode_parts(parts: Mapping[str, object]) -> tuple[bytes, dict[str, str]]:
    """Encode a mapping without the values that cannot be encoded; also return why, by name.

    Objects shared between the values stay shared.
    """
    encoder, encoded, lacking = Encoder(), [], {}
    encoder.reserve()
    for name, value in parts.items():
        try:
            encoded.append([name, encoder.plain(value, name)])
        except NotEncodable as e:
            lacking[name] = str(e)
    return msgspec.msgpack.encode([_MAP, *encoded]), lacking


class Encoder:
    """Encoder of one message; an object met again becomes a reference."""

    def __init__(self) -> None:
        self._numbers: dict[int, int] = {}  # by id
        self._objects: list[object] = []  # keeps them alive: an id then names one object

    def reserve(self) -> None:
        """Count an enclosing object that the caller writes itself."""
        self._objects.append(self)

    def plain(self, value: object, where: str = "value") -> Any:
        """Return `value` in the types of MessagePack. After an error the encoder can be used on.

        Raises:
            NotEncodable: See `encode`.
        """
        before = len(self._objects)
        try:
            return self._plain(value, where, 0)
        except NotEncodable:
            for dropped in self._objects[before:]:
                del self._numbers[id(dropped)]
            del self._objects[before:]
            raise

    def _plain(self, value: Any, where: str, depth: int) -> Any:
        kind = type(value)
        if value is None or kind in (bool, str, bytes, float):
            return value
        if kind is int:
            return value if _MIN_INT <= value <= _MAX_INT else [_BIG, str(value)]
        if depth > MAX_DEPTH:
            raise NotEncodable(f"{where}: nested deeper than {MAX_DEPTH}")
        number = self._numbers.get(id(value))
        if number is not None:
            return [_AGAIN, number]
        if isinstance(value, np.generic):
            return [_NUMBER, _dtype(value.dtype, where), value.tobytes()]
        if isinstance(value, Enum):
            return [_ENUM, _class_name(kind, where), value.name]
        self._numbers[id(value)] = len(self._objects)
        self._objects.append(value)
        return self._compound(value, kind, where, depth + 1)

    def _compound(self, value: Any, kind: type, where: str, depth: int) -> Any:
        if kind is np.ndarray:
            return _array(value, where)
        if kind in _SEQUENCES:
            head = [_DEQUE, value.maxlen] if kind is deque else [_SEQUENCES[kind]]
            return [*head, *(self._plain(v, f"{where}[{i}]", depth) for i, v in enumerate(value))]
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
        raise NotEncodable(f"{where} is a {kind.__module__}.{kind.__qualname__}, which a checkpoint cannot hold")


def _array(value: np.ndarray[Any, Any], where: str) -> list[Any]:
    dtype = _dtype(value.dtype, where)
    order: Literal["C", "F"] = "F" if value.flags.f_contiguous and not value.flags.c_contiguous else "C"
    return [_ARRAY, dtype, list(value.shape), order, bool(value.flags.writeable), value.tobytes(order)]


def _dtype(dtype: np.dtype[Any], where: str) -> str:
    if dtype.kind not in _DTYPES:
        raise NotEncodable(f"{where} is an array of {dtype}, which a checkpoint cannot hold")
    return dtype.str


def _class_name(kind: type, where: str) -> str:
    module, name = kind.__module__, kind.__qualname__
    if module.partition(".")[0] not in known_packages() or "<locals>" in name:
        raise NotEncodable(f"{where} is a {module}.{name}; its package provides no skill or backend")
    return f"{module}:{name}"


@lru_cache(maxsize=512)
def _named_class(name: str) -> type:
    """Return a dataclass or enum of a known package.

    Raises:
        BadInput: There is no such class, or a file may not name it.
    """
    module, _, qualname = name.partition(":")
    package = module.partition(".")[0]
    if package not in known_packages():
        raise BadInput(f"the checkpoint names {name}; its package provides no skill or backend here")
    if module not in sys.modules and (package not in OWN_PACKAGES or module.endswith("__main__")):
        raise BadInput(f"the checkpoint names {name}, and nothing here imports that module")
    try:
        found: Any = importlib.import_module(module)
        for part in qualname.split("."):
            found = vars(found)[part]
    except (ImportError, KeyError, TypeError, ValueError, AttributeError) as e:
        raise BadInput(f"the checkpoint names {name}, which does not exist here: it is of another version") from e
    if not (isinstance(found, type) and (dataclasses.is_dataclass(found) or issubclass(found, Enum))):
        raise BadInput(f"the checkpoint names {name}, which is neither a dataclass nor an enum")
    return found


class _Decoder:
    def __init__(self) -> None:
        self._made: list[Any] = []
        self._weights: list[int] = []  # values in each object, shared ones counted each time
        self._count = 0
        self._read: dict[str, Callable[[list[Any]], Any]] = {
            _TUPLE: lambda rest: tuple(self.value(v) for v in rest),
            _LIST: lambda rest: [self.value(v) for v in rest],
            _MAP: lambda rest: {self.value(k): self.value(v) for k, v in rest},
            _SET: lambda rest: {self.value(v) for v in rest},
            _FROZENSET: lambda rest: frozenset(self.value(v) for v in rest),
            _DEQUE: lambda rest: deque([self.value(v) for v in rest[1:]], maxlen=rest[0]),
            _ARRAY: self._array,
            _GENERATOR: self._generator,
            _DATA: self._data,
        }

    def value(self, plain: Any) -> Any:
        self._add(1)
        if not isinstance(plain, list):
            if isinstance(plain, dict):
                raise BadInput("checkpoint values cannot be read (a mapping without a tag)")
            return plain
        mark, *rest = plain
        if mark == _AGAIN:
            self._add(self._weights[rest[0]])
            return self._made[rest[0]]
        if mark == _BIG:
            return int(rest[0])
        if mark == _NUMBER:
            return np.frombuffer(rest[1], _known_dtype(rest[0]))[0]
        if mark == _ENUM:
            kind = _named_class(rest[0])
            if not issubclass(kind, Enum) or rest[1] not in kind.__members__:
                raise BadInput(f"the checkpoint names {rest[0]}.{rest[1]}, which does not exist here")
            return kind.__members__[rest[1]]
        number, before = len(self._made), self._count
        self._made.append(None)  # its number comes before those of the objects inside
        self._weights.append(MAX_VALUES)  # it must not contain itself
        made = self._read[mark](rest)
        self._made[number], self._weights[number] = made, self._count - before
        return made

    def _add(self, count: int) -> None:
        """Count values; a shared one each time, because whoever walks through the result meets it each time."""
        self._count += count
        if self._count > MAX_VALUES:
            raise BadInput(f"the checkpoint holds more than {MAX_VALUES} values, or one that contains itself")

    def _array(self, rest: list[Any]) -> Any:
        name, shape, order, writeable, data = rest
        if len(shape) > MAX_DIMENSIONS or not all(type(n) is int and 0 <= n < 2**31 for n in shape):
            raise BadInput(f"the checkpoint holds an array of shape {shape}")
        flat = np.frombuffer(data, _known_dtype(name))
        array = flat.reshape(tuple(shape), order="F" if order == "F" else "C").copy(order="K")
        array.setflags(write=bool(writeable))
        return array

    def _generator(self, rest: list[Any]) -> Any:
        if rest[0] not in ("PCG64", "PCG64DXSM", "MT19937", "Philox", "SFC64"):
            raise BadInput(f"the checkpoint names the bit generator {rest[0]!r}, which is unknown")
        bits = getattr(np.random, rest[0])()
        bits.state = self.value(rest[1])
        return np.random.Generator(bits)

    def _data(self, rest: list[Any]) -> Any:
        kind = _named_class(rest[0])
        if not dataclasses.is_dataclass(kind):
            raise BadInput(f"the checkpoint names {rest[0]} as a dataclass, which it is not")
        given, known = [n for n, _ in rest[1:]], [f.name for f in dataclasses.fields(kind)]
        if given != known:
            raise BadInput(
                f"the checkpoint has {rest[0]} with fields {', '.join(given)}; here it has {', '.join(known)}: "
                "it is of another version"
            )
        made, types = object.__new__(kind), field_types(kind)
        for name, plain in rest[1:]:
            value = self.value(plain)
            require_type(value, types.get(name, Any), f"{rest[0]}.{name}")
            object.__setattr__(made, name, value)
        _require_sound(made, kind)
        return made


def _require_sound(made: Any, kind: Any) -> None:
    """Raise what the dataclass raises for these values; the checked copy is dropped, as `__init__` may round."""
    if hasattr(kind, "__post_init__") and all(f.init for f in dataclasses.fields(kind)):
        kind(**{f.name: getattr(made, f.name) for f in dataclasses.fields(kind)})


def _known_dtype(name: object) -> np.dtype[Any]:
    dtype = np.dtype(str(name))
    if dtype.kind not in _DTYPES or dtype.names is not None:
        raise BadInput(f"the checkpoint holds an array of {name!r}, which is not supported")
    return dtype
