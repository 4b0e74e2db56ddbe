"""Stand-in values made from types, for ports that a test does not name.

Only conditions and the order of a `for_each` use them in a scripted mission, so a value needs only its type and fields.
If a class rejects the stand-in's fields, the object is created without calling `__init__`.
"""

from __future__ import annotations

import dataclasses
import enum
import types
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from glotouch_bt.robot import ParamError

T = TypeVar("T")
MAX_DEPTH = 6

_PLAIN: dict[Any, Any] = {bool: True, int: 1, float: 1.0, str: "stand-in", bytes: b"", Path: Path("stand-in")}


def stand_in(kind: type[T], **fields: object) -> T:
    """Return a value of a type: flags are true, numbers 1, tuples hold one item; `fields` of a class as given.

    Raises:
        ParamError: The class has no such field.
    """
    if not fields:
        made: T = _value(kind, object, 0)
        return made
    if not dataclasses.is_dataclass(kind):
        raise ParamError("stand_in", kind, "a dataclass, to set fields of it")
    known = [f.name for f in dataclasses.fields(kind)]
    for name in fields:
        if name not in known:
            raise ParamError(f"stand_in({kind.__name__}).{name}", fields[name], f"one of its fields {', '.join(known)}")
    instance: T = _instance(kind, fields, 0)
    return instance


@lru_cache(maxsize=512)
def port_value(data_type: Any, element: Any) -> object:
    """Return a value for a port; `element` is the type of a tuple's items (None: unknown)."""
    return _value(data_type, object if element is None else element, 0)


def _value(kind: Any, element: Any, depth: int) -> Any:
    if kind in _PLAIN:
        return _PLAIN[kind]
    origin, args = get_origin(kind), get_args(kind)
    if origin is Literal:
        return args[0]
    if origin in (Union, types.UnionType):
        first = next((a for a in args if a is not type(None)), None)
        return None if first is None else _value(first, object, depth)
    if kind is tuple or origin is tuple:
        return _tuple(args, element, depth)
    if origin is np.ndarray or kind is np.ndarray:
        return np.zeros(3)
    if origin is not None:
        return origin() if isinstance(origin, type) and issubclass(origin, (list, dict, set, frozenset)) else None
    if not isinstance(kind, type) or depth > MAX_DEPTH:
        return None
    if issubclass(kind, enum.Enum):
        return next(iter(kind))
    return _instance(kind, {}, depth)


def _tuple(args: tuple[Any, ...], element: Any, depth: int) -> tuple[Any, ...]:
    if not args:
        return (_value(element, object, depth + 1),)
    if len(args) == 2 and args[1] is Ellipsis:
        return (_value(args[0], object, depth + 1),)
    return tuple(_value(a, object, depth + 1) for a in args)


def _instance(kind: type, fields: dict[str, Any], depth: int) -> Any:
    values = dict(fields)
    if dataclasses.is_dataclass(kind):
        hints = _hints(kind)
        for field in dataclasses.fields(kind):
            if field.name in values:
                continue
            if field.default is not dataclasses.MISSING:
                values[field.name] = field.default
            elif field.default_factory is not dataclasses.MISSING:
                values[field.name] = field.default_factory()
            else:
                values[field.name] = _value(hints.get(field.name, object), object, depth + 1)
    try:
        return kind(**values)
    except Exception:
        return _without_init(kind, values)


def _without_init(kind: type, values: dict[str, Any]) -> Any:
    try:
        made: Any = object.__new__(kind)
        for name, value in values.items():
            object.__setattr__(made, name, value)
    except (TypeError, AttributeError) as e:
        raise ParamError("stand_in", kind, "a class of which an object can be made: give the port a value") from e
    return made


def _hints(kind: type) -> dict[str, Any]:
    try:
        return get_type_hints(kind)
    except Exception:
        return {}
