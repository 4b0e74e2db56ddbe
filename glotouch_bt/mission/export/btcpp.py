"""Write a mission's tree as BehaviorTree.CPP 4 XML, for Groot2 and other editors of that format.

Composites and decorators are BehaviorTree.CPP's own where it has them (its `Sequence` and `Fallback` remember their
running child, as ours do). A skill is an `Action` with its ports and parameters. A node kind that BehaviorTree.CPP
lacks is a `Decorator` defined here. Actions and these decorators stand in the `TreeNodesModel`. `is_set(key)`
is an extension, too.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

from glotouch_bt.escaped_text import xml_text
from glotouch_bt.mission.load import Mission
from glotouch_bt.mission.nodes import btcpp_value, kind_of
from glotouch_bt.mission.spec import NodeSpec


def as_btcpp(mission: Mission) -> str:
    """Return the tree as one XML document, subtrees in place."""
    root = ET.Element("root", BTCPP_format="4", main_tree_to_execute=mission.name)
    tree = ET.SubElement(root, "BehaviorTree", ID=mission.name)
    models: dict[str, ET.Element] = {}
    _add(tree, mission.spec, models)
    model = ET.SubElement(root, "TreeNodesModel")
    model.extend(models[name] for name in sorted(models))
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _add(above: ET.Element, node: NodeSpec, models: dict[str, ET.Element]) -> None:
    form = kind_of(node).btcpp_form(node)
    if form is None:
        for child in node.children:
            _add(above, child, models)
        return
    attributes = {"name": node.name, **form.attributes}
    made = ET.SubElement(above, form.tag, {name: xml_text(value) for name, value in attributes.items()})
    if form.custom:
        models.setdefault(form.tag, _model(node, form.tag))
    for child in node.children:
        _add(made, child, models)


def _model(node: NodeSpec, tag: str) -> ET.Element:
    skill = node.skill_type
    if skill is None:
        return ET.Element("Decorator", ID=tag)
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
            made.set("default", btcpp_value(field.default))
        made.text = field.description
    return model
