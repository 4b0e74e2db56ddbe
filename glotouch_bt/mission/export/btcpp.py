"""Write a mission's tree as BehaviorTree.CPP 4 XML: for that library, for editors of its format, for Groot2.

Composites and decorators are BehaviorTree.CPP's own where it has them (its `Sequence` and `Fallback` remember their
running child, as ours do). A skill is an `Action`. The node kinds that BehaviorTree.CPP lacks (`ForEach`,
`RepeatUntil`, `PortCondition`) and skills are declared in the `TreeNodesModel`, with all their ports.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin

from glotouch_bt.escaped_text import xml_text
from glotouch_bt.mission.load import Mission
from glotouch_bt.mission.nodes import NODES, BtcppForm, btcpp_value, kind_of
from glotouch_bt.mission.spec import NodeSpec

_TYPES = {bool: "bool", int: "int", float: "double", str: "std::string", dict: "std::string"}
_FORBIDDEN = re.compile(r"""[\s<>&"'/\\:*?|.]""")
"""Characters that the name of a tree may not have. Source: BehaviorTree.CPP 4.10, `findForbiddenChar`."""
_RESERVED = ("name", "ID")
"""Attributes that cannot be ports. Source: BehaviorTree.CPP 4.10, `IsReservedAttribute`."""
_MODELS = {"none": "Condition", "one": "Decorator", "many": "Control"}
"""Element that declares a node kind, by the number of its children; that of a skill is `Action`."""


@dataclass(frozen=True)
class MonitoredTree:
    """A tree as a monitor of BehaviorTree.CPP asks for it.

    Attributes:
        name: Name of the tree and of its blackboard.
        xml: The tree; its nodes have numbers (`_uid`).
        uids: The number of each node, by its path in the record.
    """

    name: str
    xml: str
    uids: dict[str, int]


def as_btcpp(mission: Mission) -> str:
    """Return the tree as one XML document, subtrees in place."""
    return _TreeWriter(mission, numbered=False).xml


def as_monitored(mission: Mission) -> MonitoredTree:
    """Return the tree with numbered nodes, and with the models of BehaviorTree.CPP's own nodes in it."""
    made = _TreeWriter(mission, numbered=True)
    return MonitoredTree(made.name, made.xml, made.uids)


class _TreeWriter:
    def __init__(self, mission: Mission, *, numbered: bool) -> None:
        self.uids: dict[str, int] = {}
        self._numbered = numbered
        self._models: dict[str, ET.Element] = {}
        tree = ET.Element("BehaviorTree")
        self._add(tree, mission.spec, mission.name)
        self.name = _tree_name(mission.name, {*self._models, *(kind.btcpp for kind in NODES.values())})
        tree.set("ID", self.name)
        if numbered:
            tree.set("_fullpath", "")
        root = ET.Element("root", BTCPP_format="4", main_tree_to_execute=self.name)
        model = ET.Element("TreeNodesModel")
        model.extend(self._models[name] for name in sorted(self._models))
        root.extend((tree, model))
        ET.indent(root)
        self.xml = ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n"

    def _add(self, above: ET.Element, node: NodeSpec, path: str) -> None:
        path = f"{path}/{node.name}"
        form = kind_of(node).btcpp_form(node)
        made = above
        if form is not None:  # else its children stand in its place
            self.uids[path] = len(self.uids) + 1
            given = {"name": node.name, **({"_uid": str(self.uids[path])} if self._numbered else {})}
            given |= {_port_name(name): value for name, value in form.attributes.items()}
            made = ET.SubElement(above, form.tag, {name: xml_text(value) for name, value in given.items()})
            if form.tag not in self._models and (self._numbered or form.settings is not None):
                self._models[form.tag] = _model(node, form)
        for child in node.children:
            self._add(made, child, path)


def _tree_name(name: str, taken: set[str]) -> str:
    """Return a mission's name as BehaviorTree.CPP accepts it: no forbidden character, not the name of a node."""
    name = _FORBIDDEN.sub("_", xml_text(name))
    return f"{name}_mission" if name in taken or name.lower() == "root" else name


def _port_name(name: str) -> str:
    return f"{name}_" if name in _RESERVED else name


def _model(node: NodeSpec, form: BtcppForm) -> ET.Element:
    """Return the declaration of a node: the ports of its skill, then its settings or parameters."""
    skill = node.skill_type
    model = ET.Element(_MODELS[kind_of(node).children] if skill is None else "Action", ID=form.tag)
    if form.settings is None:
        for name in form.attributes:
            ET.SubElement(model, "input_port", name=name)
        return model
    if skill is not None:
        for name, info in {**skill.INPUT_PORTS, **skill.OUTPUT_PORTS}.items():
            way = "output" if name not in skill.INPUT_PORTS else "inout" if name in skill.OUTPUT_PORTS else "input"
            _declare(model, f"{way}_port", name, _type(info.data_type)).text = xml_text(info.description)
    for name, field in form.settings.items():
        is_key = skill is None and form.attributes.get(name, "").startswith("{")
        way = "output" if is_key and name in node.writes else "input"
        port = _declare(model, f"{way}_port", name, "" if is_key else _type(field.annotation))
        default = None if field.is_required() else field.get_default(call_default_factory=True)
        if default not in (None, {}):
            port.set("default", xml_text(btcpp_value(default)))
        port.text = xml_text(field.description or "")
    return model


def _declare(model: ET.Element, tag: str, name: str, kind: str) -> ET.Element:
    return ET.SubElement(model, tag, {"name": _port_name(name), **({"type": kind} if kind else {})})


def _type(annotation: Any) -> str:
    """Return a type as BehaviorTree.CPP writes it; a class of ours keeps its name; "" if there are several."""
    if get_origin(annotation) is Literal:
        return "std::string"
    is_union = get_origin(annotation) in (Union, UnionType)
    options = [o for o in get_args(annotation) if o is not NoneType] if is_union else [annotation]
    kind = get_origin(options[0]) or options[0]
    return _TYPES.get(kind, getattr(kind, "__name__", "")) if len(options) == 1 else ""
