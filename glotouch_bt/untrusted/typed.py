"""Check a value against a type annotation, as far as annotations say something at run time."""

from __future__ import annotations

import collections
import collections.abc as abc
import dataclasses
import types
import typing
from functools import lru_cache
from typing import Any

import numpy as np

from glotouch_bt.errors import BadInput

_SEQUENCES: dict[object, Any] = {
    list: list, collections.deque: collections.deque, set: set, frozenset: frozenset,
    abc.Sequence: (list, tuple), abc.Set: (set, frozenset), abc.Iterable: (list, tuple, set, frozenset),
    abc.Collection: (list, tuple, set, frozenset), abc.MutableSequence: list,
}  # fmt: skip
_MAPPINGS = (dict, abc.Mapping, abc.MutableMapping)


def require_type(value: object, hint: Any, where: str) -> None:
    """Require a value to fit a type annotation; annotations without a run-time meaning fit everything.

    A dataclass inside is checked for its class only, because whoever made it has checked its fields. An `int` fits
    `float`. Arrays are checked for the kind of their numbers, not for their shape.

    Raises:
        BadInput: It does not fit; the message names the place.
    """
    if not _fits(value, hint):
        raise BadInput(f"{where} is a {type(value).__name__}, which does not fit {_word(hint)}")


@lru_cache(maxsize=512)
def field_types(kind: type) -> dict[str, Any]:
    """Return the annotations of a dataclass's fields by name; empty if they cannot be resolved."""
    try:
        hints = typing.get_type_hints(kind)
    except (NameError, TypeError, AttributeError):  # names under TYPE_CHECKING only
        return {}
    return {f.name: hints[f.name] for f in dataclasses.fields(kind) if f.name in hints}


def _fits(value: Any, hint: Any) -> bool:
    if hint is Any:
        return True
    origin, inside = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        return any(_fits(value, option) for option in inside)
    if origin is typing.Literal:
        return any(type(value) is type(option) and value == option for option in inside)
    if origin is typing.Annotated:
        return _fits(value, inside[0])
    if origin is np.ndarray or hint is np.ndarray:
        return isinstance(value, np.ndarray) and _numbers_fit(value.dtype, inside)
    if origin is tuple or hint is tuple:
        return isinstance(value, tuple) and _items_fit(value, inside)
    if (origin or hint) in _MAPPINGS:
        if not isinstance(value, dict):
            return False
        return not inside or all(_fits(k, inside[0]) and _fits(v, inside[1]) for k, v in value.items())
    if (origin or hint) in _SEQUENCES:
        if not isinstance(value, _SEQUENCES[origin or hint]):
            return False
        return not inside or all(_fits(v, inside[0]) for v in value)
    if hint is None or hint is type(None):
        return value is None
    if not isinstance(hint, type) or getattr(hint, "_is_protocol", False) or origin is not None:
        return True
    if hint is float:
        return isinstance(value, (float, int, np.floating, np.integer)) and not isinstance(value, bool)
    if hint is int:
        return isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if hint is bool:
        return isinstance(value, (bool, np.bool_))
    return isinstance(value, hint)


def _items_fit(value: tuple[Any, ...], inside: tuple[Any, ...]) -> bool:
    if not inside or inside == ((),):
        return not inside or not value
    if len(inside) == 2 and inside[1] is Ellipsis:
        return all(_fits(v, inside[0]) for v in value)
    return len(value) == len(inside) and all(_fits(v, h) for v, h in zip(value, inside, strict=True))


def _numbers_fit(dtype: np.dtype[Any], inside: tuple[Any, ...]) -> bool:
    """Return True if the numbers of an array are of the annotated kind, such as NDArray[float64]."""
    kinds = [a for i in inside if typing.get_origin(i) is np.dtype for a in typing.get_args(i)]
    return not kinds or not isinstance(kinds[0], type) or kinds[0] is Any or issubclass(dtype.type, kinds[0])


def _word(hint: Any) -> str:
    return getattr(hint, "__name__", None) or str(hint)
