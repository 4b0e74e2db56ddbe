"""Argument checks of the vendor's bindings: a wrong type or length is a TypeError, a wrong value a ValueError.

NaN is accepted silently, as by the real ones.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from glotouch_bt.robot import Array


def numbers(name: str, value: object, length: int | None = None) -> Array:
    """Return a sequence of numbers as an array.

    Args:
        name: Argument's name, for the message.
        value: The given value.
        length: Fixed length, or None.

    Raises:
        TypeError: Not a sequence of numbers, or not of this length.
    """
    if isinstance(value, str) or not isinstance(value, Iterable):
        raise TypeError(f"incompatible function arguments: {name} = {value!r}")
    items = list(value)
    if any(isinstance(v, str | bytes) or not hasattr(v, "__float__") for v in items):
        raise TypeError(f"incompatible function arguments: {name} = {value!r}")
    if length is not None and len(items) != length:
        raise TypeError(f"incompatible function arguments: {name} has {len(items)} items, {length} are expected")
    return np.array([float(v) for v in items], dtype=np.float64)


def within(name: str, value: Array, low: float | Array, high: float | Array) -> Array:
    """Return `value` if no element is outside the range; NaN passes.

    Raises:
        ValueError: An element is.
    """
    if bool((value < low).any() or (value > high).any()):
        raise ValueError(f"[{name}] contains values outside the valid range")
    return value


def positive(name: str, value: Array) -> Array:
    """Return `value` if no element is zero or negative; NaN passes.

    Raises:
        ValueError: An element is.
    """
    if bool((value <= 0.0).any()):
        raise ValueError(f"[{name}] must be positive")
    return value
