"""Read a constant that a mission writes for an input port instead of a key: a number, a flag, or a dataclass's fields.

    grasp: {in: {plan: {position_K_m: [0.1, 0, 0.04], yaw_rad: 30 deg, ...}}}

Field names carry their unit as a suffix, so that `30 deg` is understood for `yaw_rad`.
"""

from __future__ import annotations

import dataclasses
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

from glotouch_bt.mission.spec import Findings, Map, Node, Scalar, Seq, convert, split_quantity, unit_of_name, units_for
from glotouch_bt.robot import ParamError


class _Unusable(Exception):
    """Reported already."""


def is_literal(node: Node) -> bool:
    """Return True for a value, False for the name of a key."""
    if not isinstance(node, Scalar) or not isinstance(node.value, str) or node.origin:
        return True
    return split_quantity(node.value) is not None  # no key begins with a digit


def read_literal(node: Node, data_type: Any, port: str, findings: Findings) -> object | None:
    """Return the value for a port of `data_type`; None if that gave findings."""
    try:
        if dataclasses.is_dataclass(data_type) and isinstance(data_type, type) and isinstance(node, Map):
            return _dataclass(node, data_type, port, findings)
        if data_type in (int, float, bool, str, tuple):
            made: object = _value(node, data_type, port, findings)
            return made
    except _Unusable:
        return None
    kind = getattr(data_type, "__name__", str(data_type))
    findings.add(node.place, "wrong_type", f"port {port!r} takes a {kind}: wire it to a key, or write its fields")
    return None


def _dataclass(node: Map, kind: type, port: str, findings: Findings) -> object:
    fields = {f.name: f for f in dataclasses.fields(kind) if f.init}
    hints = get_type_hints(kind)
    values: dict[str, Any] = {}
    faulty = False
    for key, below in node.entries:
        name = str(key.value)
        if name not in fields:
            findings.unknown(key.place, "unknown_field", f"field of {kind.__name__}:", name, fields)
            faulty = True
            continue
        try:
            values[name] = _value(below, hints[name], name, findings)
        except _Unusable:
            faulty = True
            values[name] = None
    for name, f in fields.items():
        required = f.default is dataclasses.MISSING and f.default_factory is dataclasses.MISSING
        if required and name not in values:
            findings.add(node.place, "missing_parameter", f"port {port!r}: a {kind.__name__} needs {name!r}")
            faulty = True
    if faulty:
        raise _Unusable
    try:
        return kind(**values)
    except (ParamError, TypeError, ValueError) as e:
        at = (node.get(e.name) if isinstance(e, ParamError) else None) or node
        findings.add(at.place, "wrong_value", f"port {port!r}: {e}")
        raise _Unusable from e


def _value(node: Node, kind: Any, name: str, findings: Findings) -> Any:
    if get_origin(kind) is np.ndarray:
        return np.array(_numbers(node, name, findings), dtype=np.float64)
    if kind is tuple or get_origin(kind) is tuple:
        numbers = _numbers(node, name, findings)
        wanted = [a for a in get_args(kind) if a is not Ellipsis]
        if not set(wanted) <= {int, float}:
            return _wrong(node, name, "left out: its items cannot be written in a mission", findings)
        if wanted and Ellipsis not in get_args(kind) and len(numbers) != len(wanted):
            return _wrong(node, name, f"a list of {len(wanted)} numbers", findings)
        return tuple(numbers)
    if kind is float:
        return _number(node, name, findings)
    if kind in (int, bool, str) and isinstance(node, Scalar) and not node.poisoned and type(node.value) is kind:
        return node.value
    if isinstance(node, Scalar) and node.poisoned:
        raise _Unusable
    return _wrong(
        node, name, {int: "a whole number", bool: "true or false", str: "text"}.get(kind, str(kind)), findings
    )


def _numbers(node: Node, name: str, findings: Findings) -> list[float]:
    if not isinstance(node, Seq):
        _wrong(node, name, "a list of numbers", findings)
        return []
    return [_number(i, name, findings) for i in node.items]


def _number(node: Node, name: str, findings: Findings) -> float:
    if not isinstance(node, Scalar):
        return float(_wrong(node, name, "a number", findings))
    if node.poisoned:
        raise _Unusable
    value, unit = node.value, node.unit
    if isinstance(value, str) and (found := split_quantity(value)):
        value, unit = found
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return float(_wrong(node, name, "a number", findings))
    expected = unit_of_name(name)
    if not unit:
        return float(value)
    try:
        return convert(value, unit, expected)
    except ValueError as e:
        findings.add(
            node.place,
            "wrong_unit",
            f"{name} is in {expected or 'no unit'}, not {unit!r}",
            valid=", ".join(units_for(expected)),
        )
        raise _Unusable from e


def _wrong(node: Node, name: str, rule: str, findings: Findings) -> Any:
    shown = f" = {node.value!r}" if isinstance(node, Scalar) else ""
    findings.add(node.place, "wrong_type", f"{name}{shown}: must be {rule}")
    raise _Unusable
