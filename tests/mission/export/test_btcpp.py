"""BehaviorTree.CPP XML: well formed, every node there, in order, every action described."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import pytest

from glotouch_bt.mission.export.btcpp import as_btcpp
from glotouch_bt.mission.load import load_mission
from glotouch_bt.mission.read.library import shipped


@pytest.mark.parametrize("name", shipped(""))
def test_every_node_is_there_in_order(name: str) -> None:
    mission = load_mission(name)
    root = ET.fromstring(as_btcpp(mission))
    clash = any(n.skill == mission.name for n in mission.spec.walk())  # a tree may not be named as an action
    main = f"{mission.name}_mission" if clash else mission.name
    assert root.attrib == {"BTCPP_format": "4", "main_tree_to_execute": main}
    tree, model = root
    wanted = [n.name for n in mission.spec.walk() if n.kind != "subtree"]
    assert [e.get("name") for e in tree.iter() if e is not tree] == wanted
    described = {e.get("ID") for e in model}
    assert {n.skill for n in mission.spec.walk() if n.kind == "skill"} <= described
    for action in model:
        ports = {p.get("name") for p in action}
        for used in tree.iter(str(action.get("ID"))):
            if action.tag == "Action":
                assert set(used.attrib) - {"name"} <= ports
