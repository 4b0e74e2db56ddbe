"""The JSON Schema of mission files, for editors: every node, every skill with its parameters, ports and units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from glotouch_bt.mission.nodes import NODES
from glotouch_bt.mission.read import Declaration, WorldFile
from glotouch_bt.mission.spec import UNITS, units_for
from glotouch_bt.skill import Skill

_REFERENCE = {"type": "string", "pattern": r"^\$[A-Za-z][A-Za-z0-9_]*$", "description": "a mission parameter"}
_NODE = {"$ref": "#/$defs/node"}
_NODES = {"type": "array", "items": _NODE, "minItems": 1}
_NAME = {"type": "string", "description": "shown name"}


def mission_schema(skills: Mapping[str, type[Skill]]) -> dict[str, Any]:
    """The schema (draft 2020-12) of mission files written with these skills."""
    definitions: dict[str, Any] = {}
    nodes = {name: _kind(name, definitions) for name in NODES} | {
        name: _skill(name, skills[name], definitions) for name in skills
    }
    definitions["node"] = {
        "description": "a skill or node name, then its settings",
        "anyOf": [
            {"type": "string", "enum": list(nodes)},
            _NODES,
            {
                "type": "object",
                "minProperties": 1,
                "maxProperties": 1,
                "additionalProperties": False,
                "properties": nodes,
            },
        ],
    }
    declaration = _model(Declaration, definitions)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "GLoTouch-BT mission",
        "type": "object",
        "required": ["mission", "world", "tree"],
        "additionalProperties": False,
        "properties": {
            "mission": {"type": "string", "pattern": "^[A-Za-z0-9_-]+$"},
            "description": {"type": "string"},
            "world": {"anyOf": [{"type": "string"}, _model(WorldFile, definitions)]},
            "parameters": {"type": "object", "additionalProperties": declaration},
            "timeout_s": {"type": "number", "exclusiveMinimum": 0, "maximum": 86400},
            "leaves": {
                "type": "object",
                "description": "states in which a mission that succeeds leaves things: {hand: empty}",
                "additionalProperties": {"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]},
            },
            "subtrees": {
                "type": "object",
                "description": "subtrees that stand in the mission itself, used by `subtree: {file: NAME}`",
                "additionalProperties": {
                    "type": "object",
                    "required": ["tree"],
                    "properties": {
                        "subtree": {"type": "string"},
                        "description": {"type": "string"},
                        "parameters": {"type": "object", "additionalProperties": declaration},
                        "tree": _NODE,
                    },
                    "additionalProperties": False,
                },
            },
            "tree": _NODE,
        },
        "$defs": definitions,
    }


def _model(model: type[BaseModel], definitions: dict[str, Any], *, references: bool = False) -> dict[str, Any]:
    made = model.model_json_schema(ref_template="#/$defs/{model}")
    for name, below in made.pop("$defs", {}).items():
        definitions[name] = _opened(below, references)
    return _opened(made, references)


def _opened(made: dict[str, Any], references: bool) -> dict[str, Any]:
    """A model's schema with what may be written instead of its plain values: quantities, and mission parameters."""
    for name, body in made.get("properties", {}).items():
        unit = body.pop("unit", "")
        body.pop("names", "")
        body.pop("needs", "")
        units = units_for(unit) if unit else list(UNITS) if body.pop("any_unit", False) else []
        if unit:
            body["description"] = f"{body.get('description', name)}, {unit}"
        options = [body]
        if references:
            options.append(_REFERENCE)
        if units:
            words = "|".join(u.replace("/", r"\/") for u in units)
            options.append({"type": "string", "pattern": rf"^[-+0-9.eE]+ *({words})$"})
        if len(options) > 1:
            made["properties"][name] = {"description": body.get("description", name), "anyOf": options}
    return made


def _kind(name: str, definitions: dict[str, Any]) -> dict[str, Any]:
    kind = NODES[name]
    made = _model(kind.Settings, definitions, references=True)
    made["description"] = kind.description
    made.pop("title", None)
    properties = made.setdefault("properties", {})
    properties["name"] = _NAME
    if kind.children == "none":
        return made
    properties["do"] = _NODE
    made["required"] = [*made.get("required", []), "do"]
    if kind.children == "many":
        return {"description": kind.description, "anyOf": [_NODES, made]}
    return made if kind.Settings.model_fields else {"description": kind.description, "anyOf": [made, _NODE]}


def _skill(name: str, skill: type[Skill], definitions: dict[str, Any]) -> dict[str, Any]:
    made = _model(skill.Params, definitions, references=True)
    made["description"] = (skill.__doc__ or name).strip()
    made.pop("title", None)
    properties = made.setdefault("properties", {})
    properties["name"] = _NAME
    # An input may be a key or a value, a dataclass's fields for instance; an output is a key.
    for word, ports, kind in (("in", skill.INPUT_PORTS, {}), ("out", skill.OUTPUT_PORTS, {"type": "string"})):
        if ports:
            wires = {p: {**kind, "description": info.description} for p, info in ports.items()}
            properties[word] = {"type": "object", "additionalProperties": False, "properties": wires}
    if made.get("required"):
        return made
    return {"description": made["description"], "anyOf": [made, {"type": "null"}]}
