"""A mission's tree as BehaviorTree.CPP 4 XML, for editors and people that know that format (Groot2 opens it).

Composites and decorators are its own where it has them (its `Sequence` and `Fallback` remember where they are, as ours
do). A skill is an `Action` with its ports and parameters; what it lacks, a loop over a list of objects and a repetition
until a key is true, are `Decorator`s of ours. All of these stand in the `TreeNodesModel`. `is_set(key)` is ours, too.
"""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from typing import Any

from glotouch_bt.mission.load import Mission
from glotouch_bt.mission.spec import (
    KINDS,
    ConditionSettings,
    ForEachSettings,
    NodeSpec,
    ParallelSettings,
    RepeatSettings,
    RetrySettings,
    TimeoutSettings,
)

_SIGNS = (("equals", "=="), ("at_least", ">="), ("at_most", "<="))


def as_btcpp(mission: Mission) -> str:
    """The tree as one XML document, subtrees in place."""
    root = ET.Element("root", BTCPP_format="4", main_tree_to_execute=mission.name)
    tree = ET.SubElement(root, "BehaviorTree", ID=mission.name)
    models: dict[str, ET.Element] = {}
    _add(tree, mission.tree, models)
    model = ET.SubElement(root, "TreeNodesModel")
    model.extend(models[name] for name in sorted(models))
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _key(name: str) -> str:
    """A key as BehaviorTree.CPP writes it; private keys of subtrees keep their prefix, in letters it takes."""
    return "{" + name.replace("/", ".").replace("@", "_") + "}"


def _add(above: ET.Element, node: NodeSpec, models: dict[str, ET.Element]) -> None:
    tag, attributes = _written(node)
    if tag is None:
        for child in node.children:
            _add(above, child, models)
        return
    made = ET.SubElement(above, tag, {"name": node.name, **attributes})
    if node.skill_type is not None:
        models.setdefault(tag, _model(node))
    elif tag in ("ForEach", "RepeatUntil"):
        models.setdefault(tag, ET.Element("Decorator", ID=tag))
    for child in node.children:
        _add(made, child, models)


def _written(node: NodeSpec) -> tuple[str | None, dict[str, str]]:
    """The tag and its attributes; no tag for what has none of its own."""
    settings = node.settings
    if node.skill_type is not None:
        return node.skill, _of_skill(node)
    if isinstance(settings, ParallelSettings):
        return "Parallel", {"success_count": "-1" if settings.policy == "all" else "1", "failure_count": "1"}
    if isinstance(settings, RetrySettings):
        return "RetryUntilSuccessful", {"num_attempts": str(settings.attempts)}
    if isinstance(settings, TimeoutSettings):
        return "Timeout", {"msec": str(round(1000 * settings.seconds))}
    if isinstance(settings, ConditionSettings):
        return "ScriptCondition", {"code": _code(settings, node.reads["port"].key)}
    if isinstance(settings, RepeatSettings):
        if settings.until is None:
            return "Repeat", {"num_cycles": str(settings.times)}
        key = node.reads["until"].key
        code = _code(settings.until, key) if isinstance(settings.until, ConditionSettings) else _key(key)[1:-1]
        return "RepeatUntil", {"code": code, "limit": str(settings.limit)}
    if isinstance(settings, ForEachSettings):
        attributes = {"items": _key(node.reads["items"].key), "item": _key(node.writes["item"].key)}
        pairs = [(node.reads[p], w) for p, w in node.writes.items() if p in node.reads]
        if pairs:
            attributes["collect"] = ";".join(f"{_key(s.key)}:{_key(t.key)}" for s, t in pairs)
        return "ForEach", {**attributes, "on_failure": settings.on_failure}
    return (None if node.kind == "subtree" else KINDS[node.kind].btcpp), {}


def _code(settings: ConditionSettings, key: str) -> str:
    name = _key(key)[1:-1]
    for word, sign in _SIGNS:
        wanted = getattr(settings, word)
        if wanted is not None:
            shown = f"'{wanted}'" if isinstance(wanted, str) else json.dumps(wanted)
            return f"{name} {sign} {shown}"
    return f"{'' if settings.is_set else '!'}is_set({name})"


def _of_skill(node: NodeSpec) -> dict[str, str]:
    wires = {p: str(node.constants[p]) if p in node.constants else _key(w.key) for p, w in node.reads.items()}
    written = {p: _key(w.key) for p, w in node.writes.items()}
    values: Mapping[str, Any] = node.params.model_dump(exclude_defaults=True) if node.params is not None else {}
    return {**wires, **written, **{n: _plain(v) for n, v in values.items()}}


def _plain(value: object) -> str:
    return value if isinstance(value, str) else json.dumps(value, default=str)


def _model(node: NodeSpec) -> ET.Element:
    skill = node.skill_type
    assert skill is not None
    model = ET.Element("Action", ID=node.skill)
    both = set(skill.INPUT_PORTS) & set(skill.OUTPUT_PORTS)
    for tag, ports in (("input_port", skill.INPUT_PORTS), ("output_port", skill.OUTPUT_PORTS)):
        for name, info in ports.items():
            kind = getattr(info.data_type, "__name__", str(info.data_type))
            made = ET.SubElement(model, "inout_port" if name in both else tag, name=name, type=kind)
            made.text = info.description
    for name, field in skill.Params.model_fields.items():
        made = ET.SubElement(model, "input_port", name=name)
        if not field.is_required():
            made.set("default", _plain(field.default))
        made.text = field.description
    return model
