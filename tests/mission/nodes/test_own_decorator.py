"""A decorator of one's own, registered by one line, works everywhere: from reading to checkpoints."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from collections.abc import Callable
from typing import Any

import pytest

from glotouch_bt.mission.export import as_btcpp, as_svg, as_text, describe_nodes, mission_schema
from glotouch_bt.mission.nodes import NODES, kind_of
from glotouch_bt.mission.spec import MissionFaults
from tests.mission.conftest import REGISTRY
from tests.mission.nodes.quorum import QuorumSettings

pytestmark = pytest.mark.usefixtures("quorum")

TREE = "  - find\n  - quorum: {successes: 2, of: 3, do: {act: {script: SFS}}}\n"


def test_it_is_read_with_its_settings_and_its_child(load: Callable[..., Any]) -> None:
    _, node = load(TREE).spec.children
    assert (node.kind, node.name, node.settings) == ("quorum", "quorum", QuorumSettings(successes=2, of=3))
    assert [c.name for c in node.children] == ["act"]


@pytest.mark.parametrize(
    ("tree", "code", "words"),
    [
        ("  quorum: {successes: 0, of: 3, do: act}\n", "wrong_range", "successes = 0: must be >= 1"),
        ("  quorum: {of: 3, do: act}\n", "missing_parameter", "needs 'successes'"),
        ("  quorum: {successes: 1, of: 3, off: 2, do: act}\n", "unknown_parameter", "did you mean 'of'"),
        ("  quorum: {successes: 1, of: 3}\n", "no_children", "quorum has no child"),
        ("  qorum: {successes: 1, of: 3, do: act}\n", "unknown_skill", "did you mean 'quorum'"),
        ("  - quorum: {successes: 1, of: 2, do: find}\n  - judge\n", "port_unset", "'marks'"),
        ("  - selector: [quorum: {successes: 1, of: 2, do: find}, act]\n  - number\n", "port_maybe_unset", "'find'"),
    ],
)
def test_mistakes_in_it_are_found(tree: str, code: str, words: str, load: Callable[..., Any]) -> None:
    with pytest.raises(MissionFaults) as caught:
        load(tree)
    (found,) = caught.value.findings
    assert found.code == code
    assert words in str(found)


def test_a_quorum_of_one_pass_changes_nothing(load: Callable[..., Any]) -> None:
    (found,) = load("  quorum: {successes: 1, of: 1, do: act}\n").warnings
    assert (found.code, found.what) == ("no_effect", "'quorum' changes nothing: one pass is no quorum")


@pytest.mark.parametrize(
    ("script", "expected"), [("SS", "RS"), ("SFS", "RRS"), ("FSS", "RRS"), ("FF", "RF"), ("RSRFF", "RRRRF")]
)
def test_it_ticks(script: str, expected: str, built: Callable[[str], Any], robot: Any) -> None:
    made, context = built(f"  quorum: {{successes: 2, of: 3, do: {{act: {{script: {script}}}}}}}\n")
    seen = ""
    for _ in expected:
        made.root.tick_once()
        seen += made.root.status.value[0]
        context.observation = robot.cycle(None)
    made.forget()
    assert seen == expected


def test_its_loop_bound_is_counted(load: Callable[..., Any]) -> None:
    tree = load(TREE).spec
    assert str(kind_of(tree).max_runs(tree)) == "4"


def test_it_is_drawn(load: Callable[..., Any]) -> None:
    mission = load(TREE)
    assert "◆ quorum  successes=2  of=3" in as_text(mission)
    assert "quorum: successes=2  of=3" in as_svg(mission)


def test_it_is_exported_as_a_decorator_of_ours(load: Callable[..., Any]) -> None:
    root = ET.fromstring(as_btcpp(load(TREE)))
    (used,) = root.iter("Quorum")
    assert used.attrib == {"name": "quorum", "successes": "2", "of": "3"}
    assert [e.get("name") for e in used] == ["act"]
    assert "Quorum" in {e.get("ID") for e in root.iter("Decorator")}


def test_it_is_in_the_schema_and_in_the_list_of_nodes() -> None:
    schema = json.dumps(mission_schema(REGISTRY))
    assert "number of passes that must succeed" in schema
    (described,) = [n for n in describe_nodes() if n["name"] == "quorum"]
    assert described["children"] == "one"
    assert [(s["name"], s["range"]) for s in described["settings"]] == [
        ("successes", ">= 1, <= 100"),
        ("of", ">= 1, <= 100"),
    ]


def test_every_shipped_kind_is_described() -> None:
    for node in describe_nodes():
        assert node["description"]
        assert all(s["description"] and s["type"] for s in node["settings"]), node["name"]
    shipped = [n for n in NODES if n != "quorum"]
    assert shipped == [n["name"] for n in describe_nodes() if n["name"] != "quorum"]
