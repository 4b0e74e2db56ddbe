"""Mission parameters: declared with type, unit and range; overridden by `--set name=value`; used as `$name`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from os.path import isdir
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from glotouch_bt.mission.fields import validate
from glotouch_bt.mission.findings import Findings
from glotouch_bt.mission.library import shown
from glotouch_bt.mission.source import Map, Node, Place, Scalar, Seq, plain
from glotouch_bt.mission.units import UNITS, convert, split_quantity, units_for
from glotouch_bt.robot import BadInput
from glotouch_bt.robot.meshes import load_mesh

Value = bool | int | float | str
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_TRUE, _FALSE = ("true", "yes", "on", "1"), ("false", "no", "off", "0")


class Declaration(BaseModel):
    """One parameter as a mission declares it."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    type: Literal["int", "float", "str", "bool", "stl"] = Field(description="int, float, str, bool or stl (an object)")
    default: bool | int | float | str | None = Field(
        default=None, description="value unless --set gives one; none: required"
    )
    range: tuple[float, float] | None = Field(default=None, description="[lowest, highest] valid number")
    unit: str = Field(default="", description="unit of the number (SI when empty)")
    description: str = Field(default="", description="for people")


@dataclass(frozen=True)
class Parameter:
    """A declared parameter with its value.

    Attributes:
        name: As used in `$name`.
        declared: Its declaration.
        value: The value in the declared unit; None if unusable (already reported).
        place: Where the value came from.
    """

    name: str
    declared: Declaration
    value: Value | None
    place: Place


def read_parameters(
    node: Node | None, overrides: Mapping[str, str | Value], findings: Findings, folder: Path | None
) -> dict[str, Parameter]:
    """All parameters of a mission; faults go to `findings`.

    Args:
        node: The mission's `parameters` section, or None.
        overrides: Values of `--set` (text is read as the declared type); only declared names are looked at.
        findings: Where faults go.
        folder: The world's folder of STL files; None leaves stl parameters unchecked.
    """
    if node is None or (isinstance(node, Scalar) and node.value is None):
        return {}
    if not isinstance(node, Map):
        findings.add(node.place, "wrong_type", "parameters must be a mapping of name: {type, default, ...}")
        return {}
    parameters: dict[str, Parameter] = {}
    for key, body in node.entries:
        name = str(key.value)
        if not NAME.fullmatch(name):
            findings.add(key.place, "wrong_name", f"parameter name {name!r}", valid="letters, digits and _")
        if not isinstance(body, Map):
            findings.add(
                body.place, "wrong_type", f"parameter {name!r} must be a mapping", valid="type, default, range"
            )
            continue
        declared = validate(Declaration, body, f"parameter {name!r}", findings, where=key.place)
        if declared is None:
            # Keep the name known, so that each use of it does not become another finding.
            parameters[name] = Parameter(name, Declaration.model_construct(type="str"), None, key.place)
            continue
        if declared.unit and declared.unit not in UNITS:
            at = body.get("unit")
            findings.unknown(at.place if at else key.place, "wrong_unit", "unit", declared.unit, UNITS)
        parameters[name] = _valued(name, declared, body, key.place, overrides, findings, folder)
    return parameters


def _valued(
    name: str,
    declared: Declaration,
    body: Map,
    at: Place,
    overrides: Mapping[str, str | Value],
    findings: Findings,
    folder: Path | None,
) -> Parameter:
    default = body.get("default")
    place = default.place if default is not None else at
    given: Value | None = declared.default
    if name in overrides:
        place, given = Place(f"--set {name}"), _from_text(overrides[name], declared)
    elif given is None:
        findings.add(at, "missing_parameter", f"parameter {name!r} has no default: give it with --set {name}=...")
        return Parameter(name, declared, None, place)
    if unit := _wrong_unit(given, declared):
        valid = ", ".join(units_for(declared.unit))
        findings.add(place, "wrong_unit", f"{name} is in {declared.unit}, not {unit!r}", valid=valid)
        return Parameter(name, declared, None, place)
    fault = _fault(given, declared)
    if fault:
        findings.add(place, "wrong_value", f"{name} = {given!r}: {fault}", valid=_valid(declared))
        return Parameter(name, declared, None, place)
    if isinstance(given, int) and declared.type == "float":
        given = float(given)
    if declared.type == "stl" and folder is not None and not _stl_usable(str(given), folder, place, findings):
        return Parameter(name, declared, None, place)
    return Parameter(name, declared, given, place)


def _from_text(given: str | Value, declared: Declaration) -> Value:
    """Text of the command line as the declared type; text that does not fit stays text, and is then a fault."""
    if not isinstance(given, str) or declared.type in ("str", "stl"):
        return str(given) if declared.type in ("str", "stl") else given
    text = given.strip()
    if declared.type == "bool":
        return True if text.lower() in _TRUE else False if text.lower() in _FALSE else given
    try:
        if (quantity := split_quantity(text)) is not None and declared.unit:
            return convert(*quantity, declared.unit)
        return int(text) if declared.type == "int" else float(text)
    except ValueError:
        return given


def _wrong_unit(value: Value, declared: Declaration) -> str:
    """The unit of a number's text that measures something else than the parameter does, or empty."""
    if not isinstance(value, str) or declared.type not in ("int", "float") or not declared.unit:
        return ""
    quantity = split_quantity(value)
    return quantity[1] if quantity else ""


def _fault(value: Value, declared: Declaration) -> str:
    """Why a value does not fit its declaration, or empty."""
    kinds: dict[str, tuple[type, ...]] = {
        "int": (int,),
        "float": (int, float),
        "str": (str,),
        "bool": (bool,),
        "stl": (str,),
    }
    fits = isinstance(value, kinds[declared.type]) and isinstance(value, bool) == (declared.type == "bool")
    if not fits:
        return "must be " + {"int": "a whole number", "float": "a number", "bool": "true or false"}.get(
            declared.type, "text"
        )
    if isinstance(value, (int, float)) and declared.type in ("int", "float"):
        if value != value or value in (float("inf"), float("-inf")):
            return "must be finite"
        if declared.range and not declared.range[0] <= value <= declared.range[1]:
            lo, hi = declared.range
            return f"must be in [{lo:g}, {hi:g}]{' ' + declared.unit if declared.unit else ''}"
    return ""


def _valid(declared: Declaration) -> str:
    words = declared.type + (f" in {declared.unit}" if declared.unit else "")
    return words + (f", {declared.range[0]:g} to {declared.range[1]:g}" if declared.range else "")


def _stl_usable(name: str, folder: Path, place: Place, findings: Findings) -> bool:
    """An stl parameter names a file of the objects' folder, or is a path to one; it must be a good solid."""
    path = Path(name)
    if path.suffix.lower() != ".stl":
        files = {p.stem: p for p in sorted(folder.iterdir()) if p.suffix.lower() == ".stl"} if isdir(folder) else {}
        if name not in files:
            findings.unknown(place, "no_such_stl", f"object (in {shown(folder)})", name, files)
            return False
        path = files[name]
    try:
        load_mesh(path)
    except BadInput as e:
        findings.add(place, "unusable_stl", str(e))
        return False
    return True


def substitute(node: Node, parameters: Mapping[str, Parameter], findings: Findings) -> Node:
    """The node with every `$name` replaced by its parameter's value."""
    if isinstance(node, Seq):
        return replace(node, items=tuple(substitute(i, parameters, findings) for i in node.items))
    if isinstance(node, Map):
        return replace(node, entries=tuple((k, substitute(v, parameters, findings)) for k, v in node.entries))
    if not isinstance(node.value, str) or not node.value.startswith("$"):
        return node
    name = node.value[1:]
    found = parameters.get(name)
    if found is None:
        findings.unknown(node.place, "unknown_parameter", "mission parameter", name, parameters)
        return replace(node, poisoned=True)
    if found.value is None:
        return replace(node, poisoned=True)
    return replace(node, value=found.value, unit=found.declared.unit, origin=node.value, span=found.declared.range)


def check_used(section: Node | None, tree: Node, findings: Findings) -> None:
    """Report declared parameters that a tree does not use."""
    if not isinstance(section, Map):
        return
    used: set[str] = set()
    stack = [tree]
    while stack:
        node = stack.pop()
        if isinstance(node, Seq):
            stack.extend(node.items)
        elif isinstance(node, Map):
            stack.extend(v for _, v in node.entries)
        elif isinstance(node.value, str) and node.value.startswith("$"):
            used.add(node.value[1:])
    for key, _ in section.entries:
        if key.value not in used:
            findings.add(key.place, "unused_parameter", f"no node uses the parameter {key.value!r}")


def resolved(node: Node | None, parameters: Mapping[str, Parameter]) -> dict[str, object]:
    """The `parameters` section as plain data with the values in use as defaults."""
    if not isinstance(node, Map):
        return {}
    section = plain(node)
    for name, parameter in parameters.items():
        section[name]["default"] = parameter.value
    return dict(section)


__all__ = ["Declaration", "Parameter", "Value", "check_used", "read_parameters", "resolved", "substitute"]
