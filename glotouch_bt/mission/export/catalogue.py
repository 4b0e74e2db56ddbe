"""Describe skills, node kinds and missions as JSON data: parameters with units and ranges, typed ports."""

from __future__ import annotations

import inspect
from dataclasses import asdict
from pathlib import Path
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel

from glotouch_bt.mission.nodes import NODES, ConditionSettings
from glotouch_bt.mission.read import limits_of, read_yaml, shown, unit_of
from glotouch_bt.mission.spec import plain
from glotouch_bt.skill import Skill


def describe_skill(name: str, skill: type[Skill]) -> dict[str, Any]:
    """Return a skill as JSON data: name, description, parameters, inputs, outputs, states of resources, failures."""
    keys = skill.default_keys()
    return {
        "name": name,
        "description": inspect.cleandoc(skill.__doc__ or ""),
        "parameters": _fields(skill.Params),
        "inputs": [{**_port(p, info, keys), "required": bool(info.required)} for p, info in skill.INPUT_PORTS.items()],
        "outputs": [_port(p, info, keys) for p, info in skill.OUTPUT_PORTS.items()],
        "needs": {r: sorted(s) for r, s in skill.PRECONDITIONS.items()},
        "leaves": dict(skill.POSTCONDITIONS),
        "after_failure": {r: sorted(s) for r, s in skill.FAILURE_STATES.items()},
        "uses": sorted(skill.USES),
        "failures": [asdict(f) for f in skill.failures(general=True).values()],
        "pause": skill.PAUSE,
    }


def describe_nodes() -> list[dict[str, Any]]:
    """Return every node kind as JSON data: name, description, children (none, one, many), BT.CPP name, settings."""
    words = ("name", "description", "children", "btcpp")
    return [{w: getattr(kind, w) for w in words} | {"settings": _fields(kind.Settings)} for kind in NODES.values()]


def describe_mission(file: Path) -> dict[str, Any]:
    """Return a mission file's head as JSON data: name, description, world, parameters; the tree is not checked.

    Raises:
        BadInput: The file cannot be read.
    """
    source: Any = plain(read_yaml(file, shown(file)))
    declared = source.get("parameters") or {}
    keys = {"type": "", "unit": "", "default": None, "range": None, "description": ""}
    return {
        "name": file.stem,
        "description": source.get("description", ""),
        "world": source.get("world", ""),
        "file": str(file),
        "parameters": [{"name": n} | {k: p.get(k, empty) for k, empty in keys.items()} for n, p in declared.items()],
    }


def _fields(model: type[BaseModel]) -> list[dict[str, Any]]:
    """Return the fields of a model: name, type, unit, required, default, range, description."""
    found: list[dict[str, Any]] = []
    for name, field in model.model_fields.items():
        limits = [f"{sign} {limit:g}" for sign, limit, _ in limits_of(field)]
        found.append(
            {
                "name": name,
                "type": _type_in_words(field.annotation),
                "unit": unit_of(field),
                "required": field.is_required(),
                "default": None if field.is_required() else field.get_default(call_default_factory=True),
                "range": ", ".join(limits),
                "description": field.description or "",
            }
        )
    return found


def _type_in_words(annotation: Any) -> str:
    """Return a type as a mission's author writes it: `int`, `'all' or 'one'`, `mapping`."""
    options = get_args(annotation)
    if get_origin(annotation) is Literal:
        return " or ".join(repr(o) for o in options)
    if get_origin(annotation) is dict:
        return "mapping"
    if options and get_origin(annotation) in (Union, UnionType):
        return " or ".join(_type_in_words(o) for o in options if o is not type(None))
    if isinstance(annotation, type) and issubclass(annotation, ConditionSettings):
        return "condition"
    return getattr(annotation, "__name__", str(annotation))


def _port(name: str, info: Any, keys: dict[str, str]) -> dict[str, Any]:
    kind = getattr(info.data_type, "__name__", str(info.data_type))
    return {"name": name, "type": kind, "key": keys[name], "description": info.description}
