"""Backend options: a dataclass declares them, and the type of a field converts the value of `--set name=value`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args, get_origin, get_type_hints

from glotouch_bt.robot import ParamError, UnknownName

Layout = Mapping[str, tuple[float, float, float]]
MAX_COORDINATE = 1000.0
"""Largest number of a place in a layout, m or rad; refuses infinities and what is not a number."""


@dataclass(frozen=True, kw_only=True)
class WorldOptions:
    """Options of every backend with a simulated world.

    Attributes:
        layout: (x m, y m, yaw rad) in K of every object by name; None: random places.
        fixed: Bolt the objects to the floor, like a calibration artefact.
    """

    layout: Layout | None = None
    fixed: bool = False


def _layout(name: str, value: object) -> Layout:
    rule = "a mapping of object names to (x m, y m, yaw rad)"
    if not isinstance(value, Mapping):
        raise ParamError(name, value, rule)
    places: dict[str, tuple[float, float, float]] = {}
    for key, place in value.items():
        numbers = tuple(place) if isinstance(place, (list, tuple)) else ()
        if len(numbers) != 3 or not all(_is_coordinate(v) for v in numbers):
            raise ParamError(f"{name}[{key}]", place, rule)
        places[str(key)] = (float(numbers[0]), float(numbers[1]), float(numbers[2]))
    return places


def _is_coordinate(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= MAX_COORDINATE


def _switch(name: str, value: object) -> bool:
    words = {"true": True, "false": False}
    if str(value).lower() not in words:
        raise ParamError(name, value, "true or false")
    return words[str(value).lower()]


CONVERTERS: Mapping[object, Callable[[str, object], object]] = {
    bool: _switch,
    str: lambda _, value: str(value),
    tuple[str, ...]: lambda _, value: tuple(part.strip() for part in str(value).split(",") if part.strip()),
    Layout | None: _layout,
}
"""Conversion of a value by the type of its field; a `Literal` lists the valid words."""


def convert_options(backend: str, given: Mapping[str, object], *declared: type) -> dict[str, Any]:
    """Convert option values by the field types of the classes that declare them.

    Raises:
        UnknownName: No class declares the option; lists those that exist.
        ParamError: The value does not fit the field's type.
    """
    types: dict[str, Any] = {}
    for cls in declared:
        types |= get_type_hints(cls)
    converted: dict[str, Any] = {}
    for name, value in given.items():
        if name not in types:
            raise UnknownName(f"option of backend {backend}", name, types)
        hint = types[name]
        if get_origin(hint) is Literal:
            if str(value) not in get_args(hint):
                words = ", ".join(word for word in get_args(hint) if word)
                raise ParamError(f"option {name}", value, f"one of {words}")
            converted[name] = str(value)
        else:
            converted[name] = CONVERTERS[hint](f"option {name}", value)
    return converted
