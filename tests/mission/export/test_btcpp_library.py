"""The real BehaviorTree.CPP loads what is exported, and decides every comparison as the mission does.

Its Python bindings cannot register a node with ports. So a node that the library lacks is loaded as a subtree with the
same name and ports, whose model the library checks; one that has children stands before them in a sequence.
"""

from __future__ import annotations

import dataclasses
import random
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest

from glotouch_bt.mission.export.btcpp import as_btcpp, as_monitored
from glotouch_bt.mission.load import Mission, load_mission
from glotouch_bt.mission.nodes import ConditionSettings, btcpp_name, holds
from glotouch_bt.mission.nodes.base import in_code
from glotouch_bt.mission.read.library import shipped
from glotouch_bt.skill import Out, Skill, SkillParams, SkillRun, param
from tests.mission.conftest import REGISTRY
from tests.support.btcpp.installed import loaded

EVERY_KIND = """
mission: every_kind
world: container_five
tree:
  - find: {how_many: 2}
  - say: {ID: 7, weights: [1.0, 2.5], sizes: {long: 1.0}}
  - for_each: {items: items, item: item, on_failure: continue, collect: {mark: marks},
               do: {use: {force_N: 1 N}}}
  - judge
  - parallel: {policy: one, do: [act, {timeout: {seconds: 2.5, do: act}}]}
  - repeat: {times: 3, do: {succeed: act}}
  - succeed: {repeat: {until: {port: found, is_set: false}, limit: 7, do: {invert: {fail: find}}}}
  - repeat: {until: complete, do: find}
  - retry: {attempts: 2, do: act}
  - condition: {port: found, is_set: true}
  - selector:
      - condition: {port: found, at_least: 1.0e-7}
      - condition: {port: word, equals: "it's"}
      - condition: {port: word, equals: schön}
      - condition: {port: word, equals: 'a "plain" \\\\ text; no {key}'}
"""


class SayParams(SkillParams):
    ID: int = param("a name that the library keeps for itself", default=0)
    weights: tuple[float, ...] = param("a list", default=())
    sizes: dict[str, float] = param("a mapping", default={})


class Say(Skill):
    """Write a word."""

    Params = SayParams
    params: SayParams
    word = Out(str, "the word")

    def run(self) -> SkillRun:
        self.word = "word"
        return
        yield


@pytest.fixture(scope="module")
def every_kind(tmp_path_factory: pytest.TempPathFactory) -> Mission:
    path = tmp_path_factory.mktemp("mission") / "every_kind.yaml"
    path.write_text(EVERY_KIND)
    return load_mission(path, {}, skills={**REGISTRY, "say": Say})


def with_subtrees(xml: str) -> str:
    """The document with subtrees in the place of the nodes that the library lacks."""
    root = ET.fromstring(xml)
    tree, model = root
    lacking = {e.attrib["ID"]: e for e in model}
    for above in reversed(list(tree.iter())):
        for i, node in enumerate(list(above)):
            if node.tag in lacking:
                children = list(node)
                assert len(children) == (1 if lacking[node.tag].tag == "Decorator" else 0)
                subtree = ET.Element("SubTree", {"ID": node.tag, **node.attrib})
                above[i] = ET.Element("Sequence") if children else subtree
                above[i].extend([subtree, *children] if children else [])
    for name, declared in lacking.items():
        declared.tag = "SubTree"
        for port in declared:
            port.set("default", port.get("default") or "nothing")  # a subtree's port without one must be connected
        ET.SubElement(ET.SubElement(root, "BehaviorTree", ID=name), "AlwaysSuccess")
    return ET.tostring(root, encoding="unicode")


def undeclared(xml: str) -> list[str]:
    """Attributes that are no port of their node's model, which the library refuses."""
    tree, model = ET.fromstring(xml)
    ports = {e.attrib["ID"]: {"name", "_uid"} | {p.attrib["name"] for p in e} for e in model}
    return [f"{e.tag} {a}" for e in tree.iter() if e.tag in ports for a in set(e.attrib) - ports[e.tag]]


def test_the_library_loads_every_shipped_mission(tmp_path: Path) -> None:
    documents = [as_btcpp(load_mission(name)) for name in shipped("")]
    assert [undeclared(d) for d in documents] == [[]] * len(documents)
    found = loaded([{"xml": with_subtrees(d)} for d in documents], tmp_path)
    assert found == [{"status": "loaded"}] * len(documents)


def test_the_library_loads_every_kind_of_node(every_kind: Mission, tmp_path: Path) -> None:
    document = as_btcpp(every_kind)
    assert undeclared(document) == []
    assert loaded([{"xml": with_subtrees(document)}], tmp_path) == [{"status": "loaded"}]
    tree, model = ET.fromstring(document)
    (each,) = tree.iter("ForEach")
    assert {k: v for k, v in each.attrib.items() if k != "name"} == {
        "items": "{items}",
        "item": "{item}",
        "collect": "mark:marks",
        "on_failure": "continue",
    }
    assert [(p.tag, p.get("name")) for e in model if e.get("ID") == "ForEach" for p in e] == [
        ("input_port", "items"),
        ("output_port", "item"),
        ("input_port", "collect"),
        ("input_port", "on_failure"),
        ("input_port", "order_by"),
    ]
    (said,) = tree.iter("say")
    assert said.attrib == {
        "name": "say",
        "word": "{word}",
        "ID_": "7",
        "weights": "1.0;2.5",
        "sizes": 'json:{"long": 1.0}',
    }
    assert [e.attrib["code"] for e in tree.iter("ScriptCondition")] == [
        "found >= 1e-07",
        "word == 'a \"plain\" \\\\ text; no {key}'",
    ]
    assert [e.attrib.get("equals") for e in tree.iter("PortCondition")] == [None, "it's", "schön"]


@pytest.mark.parametrize("name", ["a b.c", "root", "Sequence", "find", "Sleep/now", 'say "hi"'])
def test_the_library_accepts_the_name_of_every_mission(name: str, every_kind: Mission, tmp_path: Path) -> None:
    document = as_btcpp(dataclasses.replace(every_kind, name=name))
    assert loaded([{"xml": with_subtrees(document)}], tmp_path) == [{"status": "loaded"}]


def scripted(rng: random.Random) -> tuple[ConditionSettings, Any]:
    """A random comparison, and a value of the type that its port must have."""
    kind = rng.choice(["bool", "number", "text"])
    if kind == "bool":
        return ConditionSettings(port="key", equals=rng.random() < 0.5), rng.random() < 0.5
    if kind == "text":
        words = ["", "a", "a b", "A", '"', "\\", "1", "true", "{key}", "a;b", "~!@#$%^&*()_+"]
        return ConditionSettings(port="key", equals=rng.choice(words)), rng.choice(words)
    numbers = [0.0, -1.0, 1.0, 2.0, 0.05, -1.5e-6, 1e-5, 3e20, 100.0]  # the library takes numbers 1e-7 apart as equal
    comparison = rng.choice(["equals", "at_least", "at_most"])
    return ConditionSettings(port="key", **{comparison: rng.choice(numbers)}), rng.choice(numbers)


def test_the_library_decides_as_the_mission(tmp_path: Path) -> None:
    rng, trees, wanted = random.Random(0), [], []
    for key in ("key", "part@1/sub_part@22/Zed__key"):
        for _ in range(150):
            comparison, value = scripted(rng)
            code = in_code(comparison, btcpp_name(key))
            assert code is not None
            root = ET.Element("root", BTCPP_format="4")
            ET.SubElement(ET.SubElement(root, "BehaviorTree", ID="T"), "ScriptCondition", code=code)
            text = ET.tostring(root, encoding="unicode")
            trees.append({"xml": text, "board": {btcpp_name(key): value}, "tick": True})
            wanted.append({"status": "SUCCESS" if holds(comparison, value) else "FAILURE"})
    assert loaded(trees, tmp_path) == wanted
    assert {"SUCCESS", "FAILURE"} == {w["status"] for w in wanted}


def test_no_two_keys_have_one_name() -> None:
    keys = [
        "a@1/b",
        "a_1__b",
        "a_1_Z_b",
        "a_1_b",
        "aZ",
        "aZZ",
        "a___b",
        "a__@1/b",
        "a_@1/b",
        "a@11/b",
        "a@1/bZ_b",
        "2@1/b",
    ]
    names = {btcpp_name(k) for k in [*keys, "a@1", "a_1", "a_Z1", "a@1/b@1", "a@1/b_1"]}
    assert len(names) == len(keys) + 5
    assert all(n.isidentifier() for n in names)


def test_a_monitored_tree_numbers_every_node(every_kind: Mission) -> None:
    made = as_monitored(every_kind)
    assert undeclared(made.xml) == []
    tree, model = ET.fromstring(made.xml)
    shown = [e for e in tree.iter() if e is not tree]
    assert [int(e.attrib["_uid"]) for e in shown] == list(range(1, len(shown) + 1)) == list(made.uids.values())
    assert [e.attrib["name"] for e in shown] == [path.rsplit("/", 1)[-1] for path in made.uids]
    assert {e.tag for e in shown} == {e.attrib["ID"] for e in model}
    assert {e.tag for e in model} == {"Action", "Condition", "Control", "Decorator"}
