"""Describe skills, node kinds and missions as JSON data: parameters with units and ranges, typed ports."""

from __future__ import annotations

import inspect
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel

from glotouch_bt.mission.nodes import NODES, ConditionSettings
from glotouch_bt.mission.read import (
    Scope,
    SkillRegistry,
    limits_of,
    parse_tree,
    read_named_yaml,
    read_parameters,
    read_yaml,
    shown,
    substitute,
    unit_of,
)
from glotouch_bt.mission.spec import Findings, Wire, plain
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
    return {**_head(file, source), "world": source.get("world", "")}


def describe_subtree(file: Path) -> dict[str, Any]:
    """Return a shipped subtree as JSON data: name, description, parameters, and the keys that a mission can share.

    `reads`: keys that it reads and never writes; `writes`: keys that it writes.
    """
    source = read_named_yaml(file, shown(file), "tree")
    findings = Findings()
    parameters = read_parameters(source.get("parameters"), {}, findings, None)
    tree = source.get("tree")
    assert tree is not None
    spec = parse_tree(substitute(tree, parameters, findings), Scope(SkillRegistry(), findings, file))
    nodes = list(spec.walk())
    writes = _own_keys(w for n in nodes for w in n.writes.values())
    reads = _own_keys(w for n in nodes for w in n.reads.values())
    return {**_head(file, plain(source)), "reads": sorted(reads - writes), "writes": sorted(writes)}


def _own_keys(wires: Iterable[Wire]) -> set[str]:
    """Return the keys that belong to the file itself: not to subtrees inside it, and not to constants."""
    return {w.key for w in wires if "/" not in w.key and "@" not in w.key}


def _head(file: Path, source: Any) -> dict[str, Any]:
    declared = source.get("parameters") or {}
    keys = {"type": "", "unit": "", "default": None, "range": None, "description": ""}
    return {
        "name": file.stem,
        "description": source.get("description", ""),
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
    if get_origin(annotation) is Annotated:
        return _type_in_words(options[0])
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
