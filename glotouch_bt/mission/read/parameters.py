"""Mission parameters: declared with type, unit and range; overridden by `--set name=value`; used as `$name`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from os.path import isdir, isfile
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from glotouch_bt.mission.read.fields import validate
from glotouch_bt.mission.read.library import shown
from glotouch_bt.mission.read.yaml_source import number_of
from glotouch_bt.mission.spec import (
    UNITS,
    Findings,
    Map,
    Node,
    Place,
    Scalar,
    Seq,
    base_of,
    convert,
    measured,
    plain,
    units_for,
    walk,
)
from glotouch_bt.perception import read_touched, touched_name
from glotouch_bt.robot import BadInput, ObjectSet
from glotouch_bt.robot.scene import load_mesh, stl_files

Value = bool | int | float | str
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_KINDS: dict[str, tuple[Any, str]] = {
    "int": (int, "a whole number"),
    "float": (int | float, "a number"),
    "str": (str, "text"),
    "bool": (bool, "true or false"),
    "stl": (str, "text"),
    "count": (int, "a whole number or unknown"),
}
"""Type of each kind of parameter, and its name in messages."""
UNKNOWN = "unknown"
"""Value of a count that the user does not know."""
_TRUE, _FALSE = ("true", "yes", "on", "1"), ("false", "no", "off", "0")


class Declaration(BaseModel):
    """One parameter as a mission declares it."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    type: Literal["int", "float", "str", "bool", "stl", "count"] = Field(
        description="int, float, str, bool, stl (an object), count (of objects, or unknown; default: the world's)"
    )
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
        value: The value in its unit; None if unusable (already reported).
        unit: The declared unit; if none is declared, the SI unit of the value given.
    """

    name: str
    declared: Declaration
    value: Value | None
    unit: str = ""


def read_parameters(
    node: Node | None,
    overrides: Mapping[str, Scalar],
    findings: Findings,
    objects: ObjectSet | None,
    user: Place | None = None,
) -> dict[str, Parameter]:
    """Read all parameters of a mission or a subtree.

    Args:
        node: Its `parameters` section, or None.
        overrides: Values given from outside, with their places; undeclared names are ignored.
        findings: Where faults go.
        objects: The world's objects; None (the world is faulty) leaves parameters of type stl and count unchecked.
        user: The node that uses the subtree; None: a mission, whose user is on the command line.
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
            what = f"parameter name {name!r} has characters that are not allowed"
            findings.add(key.place, "wrong_name", what, valid="letters, digits and _, the first a letter")
        if not isinstance(body, Map):
            findings.add(
                body.place, "wrong_type", f"parameter {name!r} must be a mapping", valid="type, default, range"
            )
            continue
        declared = validate(Declaration, body, f"parameter {name!r}", findings, where=key.place)
        if declared is None or not _sound(declared, body, findings):
            # Keep the name known, so that each use of it does not become another finding.
            parameters[name] = Parameter(name, Declaration.model_construct(type="str"), None)
            continue
        default = body.get("default")
        given = overrides.get(name, default if isinstance(default, Scalar) else None)
        if given is None and declared.type == "count":
            if objects is None:
                parameters[name] = Parameter(name, declared, None)
                continue
            given = Scalar(count_objects(objects), Place(f"{objects.folder}"))
        if given is None or given.value is None:
            at, how = key.place, f"give it with --set {name}=..."
            if user is not None:
                at, how = user, f"give it with parameters: {{{name}: ...}}"
            findings.add(at, "missing_parameter", f"parameter {name!r} has no default: {how}")
            parameters[name] = Parameter(name, declared, None)
            continue
        parameters[name] = _valued(name, declared, given, findings, objects)
    return parameters


def _sound(declared: Declaration, body: Map, findings: Findings) -> bool:
    """Return True if a declaration is consistent; else it gave a finding."""
    if declared.unit and declared.unit not in UNITS:
        unit = body.get("unit") or body
        findings.unknown(unit.place, "wrong_unit", "unit", declared.unit, UNITS)
        return False
    if declared.range and declared.range[0] > declared.range[1]:
        lo, hi = declared.range
        place = (body.get("range") or body).place
        findings.add(place, "wrong_value", f"range = [{lo:g}, {hi:g}]: the range is empty", valid="[lowest, highest]")
        return False
    return True


def _valued(
    name: str, declared: Declaration, given: Scalar, findings: Findings, objects: ObjectSet | None
) -> Parameter:
    """Return the parameter with the given value; without a value if that gave findings."""
    lost = Parameter(name, declared, None)
    if given.poisoned:
        return lost
    value, place, unit = given.value, given.place, declared.unit
    if declared.type in ("int", "float", "count"):
        found = measured(given)
        if found.unit and found.unit not in UNITS:
            findings.unknown(place, "wrong_unit", "unit", found.unit, UNITS)
            return lost
        unit = unit or base_of(found.unit)
        try:
            value = _converted(found, unit, declared)
        except ValueError:
            source = f" (from {given.origin})" if given.origin else ""
            what = f"{name} is in {unit}, not {found.unit!r}{source}"
            findings.add(place, "wrong_unit", what, valid=", ".join(units_for(unit)))
            return lost
    assert value is not None
    if fault := _fault(value, declared):
        findings.add(place, "wrong_value", f"{name} = {value!r}: {fault}", valid=_valid(declared))
        return lost
    if declared.type == "float":
        value = float(value)
    named = declared.type == "stl" and not (value == "" and declared.default == "")  # empty: no object
    if named and not stl_usable(str(value), objects, place, findings):
        return lost
    _check_span(name, given, declared, unit, findings)
    return Parameter(name, declared, value, unit)


def _converted(given: Scalar, unit: str, declared: Declaration) -> Value | None:
    """Return the value in the parameter's unit; a whole number stays one.

    Raises:
        ValueError: It measures something else.
    """
    value = given.value
    if not given.unit or isinstance(value, bool) or not isinstance(value, (int, float)):
        return value
    made = convert(value, given.unit, unit)
    return int(made) if declared.type in ("int", "count") and float(made).is_integer() else made


def _check_span(name: str, given: Scalar, declared: Declaration, unit: str, findings: Findings) -> None:
    """Report a parameter whose range is wider than that of the parameter it is passed to."""
    if given.span is None or declared.range is None:
        return
    lo, hi = declared.range
    for end in given.span:
        if not lo <= convert(end, given.unit, unit) <= hi:
            said = f"{end:g} {given.unit}".strip()
            what = f"{given.origin} may be set to {said}, but {name} must be in [{lo:g}, {hi:g}] {unit}".rstrip()
            findings.add(given.place, "range_too_wide", what)


def from_command_line(name: str, given: str | Value, node: Node | None) -> Scalar:
    """Return a `--set` value with its text converted to the declared type; text that does not fit stays text."""
    body = node.get(name) if isinstance(node, Map) else None
    kind = body.get("type") if isinstance(body, Map) else None
    return Scalar(_from_text(given, str(kind.value) if isinstance(kind, Scalar) else ""), Place(f"--set {name}"))


def _from_text(given: str | Value, kind: str) -> Value:
    if kind in ("str", "stl"):
        return str(given)
    if not isinstance(given, str):
        return given
    text = given.strip()
    if kind == "bool":
        return True if text.lower() in _TRUE else False if text.lower() in _FALSE else given
    number = number_of(text)
    if number is None or kind not in ("int", "float", "count") or (kind != "float" and isinstance(number, float)):
        return given
    return float(number) if kind == "float" else number


def _fault(value: Value, declared: Declaration) -> str:
    """Return why a value does not fit its declaration, or empty."""
    if declared.type == "count" and value == UNKNOWN:
        return ""
    kind, words = _KINDS[declared.type]
    if not isinstance(value, kind) or isinstance(value, bool) != (kind is bool):
        return f"must be {words}"
    if isinstance(value, (int, float)) and declared.type in ("int", "float", "count"):
        if value != value or value in (float("inf"), float("-inf")):
            return "must be finite"
        if declared.range and not declared.range[0] <= value <= declared.range[1]:
            lo, hi = declared.range
            return f"must be in [{lo:g}, {hi:g}]{' ' + declared.unit if declared.unit else ''}"
    return ""


def _valid(declared: Declaration) -> str:
    words = ("int" if declared.type == "count" else declared.type) + (f" in {declared.unit}" if declared.unit else "")
    words += f", {declared.range[0]:g} to {declared.range[1]:g}" if declared.range else ""
    return words + (f", or {UNKNOWN}" if declared.type == "count" else "")


def stl_usable(name: str, objects: ObjectSet | None, place: Place, findings: Findings) -> bool:
    """Check an object: the name of a file in the objects' folder, or a path; the file must be a valid solid.

    An object that is known only by touch must have been remembered.
    """
    if touched := touched_name(name):
        try:
            read_touched(touched)
        except BadInput as e:
            findings.add(place, "not_remembered", str(e))
            return False
        return True
    if objects is None:
        return True
    path, folder = Path(name), objects.folder
    if path.suffix.lower() != ".stl":
        files = stl_files(folder) if isdir(folder) else {}
        if name not in files:
            findings.unknown(place, "no_such_stl", f"object (in {shown(folder)})", name, files)
            return False
        path = files[name]
    fault = fault_of_solid(path)
    if fault and not any(f.what == fault for f in findings.errors):  # of the world's folder, it is reported already
        findings.add(place, "unusable_stl", fault)
    return not fault


def fault_of_solid(path: Path) -> str:
    """Return why a file is not a valid solid, or empty; a file that has not changed is read once."""
    found = path.stat() if isfile(path) else None
    return _fault_of_solid(path, (found.st_mtime_ns, found.st_size) if found else None)


def count_objects(objects: ObjectSet) -> int:
    """Return the number of objects of a set whose folder can be read."""
    return len(objects.names or stl_files(objects.folder))


@lru_cache(maxsize=256)
def _fault_of_solid(path: Path, stamp: tuple[int, int] | None) -> str:
    """Return why a file is not a valid solid, or empty. `stamp`: its time and size, for the cache."""
    try:
        load_mesh(path)
    except BadInput as e:
        return str(e)
    return ""


def substitute(node: Node, parameters: Mapping[str, Parameter], findings: Findings) -> Node:
    """Return the node with every `$name` replaced by its parameter's value."""
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
    return replace(node, value=found.value, unit=found.unit, origin=node.value, span=found.declared.range)


def check_used(section: Node | None, tree: Node, findings: Findings) -> None:
    """Report declared parameters that a tree does not use."""
    if not isinstance(section, Map):
        return
    used = {node.value for node in walk(tree) if isinstance(node, Scalar)}
    for key, _ in section.entries:
        if f"${key.value}" not in used:
            findings.add(key.place, "unused_parameter", f"no node uses the parameter {key.value!r}")


def resolved(node: Node | None, parameters: Mapping[str, Parameter]) -> dict[str, object]:
    """Return the `parameters` section as plain data with the values in use as defaults."""
    if not isinstance(node, Map):
        return {}
    section = plain(node)
    for name, parameter in parameters.items():
        section[name]["default"] = parameter.value
    return dict(section)
