# ruff: noqa: E501 (a table of one mistake a line reads better than wrapped ones)
"""Seeded mistakes: each is found at its line and column, says what is wrong, and all are found at once."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from glotouch_bt.mission.load import load_mission
from glotouch_bt.mission.read.library import shipped_root
from glotouch_bt.mission.spec.findings import MissionFaults
from glotouch_bt.robot import BadInput
from tests.support.examples import examples

HEAD = "mission: m\nworld: container_five\n"
# (name, whole text, [(line, column, code, words)])
MISTAKES: list[tuple[str, str, list[tuple[int, int, str, str]]]] = [
    ("unknown skill", HEAD + "tree:\n  fnd\n", [(4, 3, "unknown_skill", "did you mean 'find'")]),
    ("unknown node in a list", HEAD + "tree:\n  - find\n  - seqence: [find]\n", [(5, 5, "unknown_skill", "did you mean 'sequence'")]),
    ("unknown parameter", HEAD + "tree:\n  find: {how_mny: 3}\n", [(4, 10, "unknown_parameter", "did you mean 'how_many'")]),
    ("wrong type", HEAD + "tree:\n  find: {how_many: three}\n", [(4, 20, "wrong_type", "must be a whole number")]),
    ("whole number wanted", HEAD + "tree:\n  find: {how_many: 2.5}\n", [(4, 20, "wrong_type", "whole number")]),
    ("text is not a number", HEAD + "tree:\n  find: {how_many: '3'}\n", [(4, 20, "wrong_type", "whole number")]),
    ("number is not text", HEAD + "tree:\n  find: {mode: 3}\n", [(4, 16, "wrong_type", "must be text")]),
    ("out of range", HEAD + "tree:\n  find: {how_many: 99}\n", [(4, 20, "wrong_range", "must be <= 9")]),
    ("out of range, with units", HEAD + "tree:\n  find: {speed_m_s: 400 mm/s}\n", [(4, 21, "wrong_range", "m/s")]),
    ("wrong unit", HEAD + "tree:\n  find: {speed_m_s: 40 N}\n", [(4, 21, "wrong_unit", "mm/s")]),
    ("unknown unit", HEAD + "tree:\n  find: {speed_m_s: 4 furlongs}\n", [(4, 21, "wrong_unit", "not 'furlongs'")]),
    ("missing parameter", HEAD + "tree:\n  - find\n  - for_each: {items: items, item: item, do: use}\n", [(5, 46, "missing_parameter", "'force_N'")]),
    ("unknown reference", HEAD + "parameters:\n  many: {type: int, default: 2}\ntree:\n  find: {how_many: $mny}\n", [(6, 20, "unknown_parameter", "did you mean 'many'")]),
    ("reference of a wrong unit", HEAD + "parameters:\n  v: {type: float, default: 2, unit: N}\ntree:\n  find: {speed_m_s: $v}\n", [(6, 21, "wrong_unit", "from $v")]),
    ("reference out of range", HEAD + "parameters:\n  v: {type: float, default: 400, unit: mm/s}\ntree:\n  find: {speed_m_s: $v}\n", [(6, 21, "wrong_range", "from $v")]),
    ("parameter type", HEAD + "parameters:\n  v: {type: flaot, default: 2}\ntree: find\n", [(4, 13, "wrong_type", "float")]),
    ("parameter default out of range", HEAD + "parameters:\n  v: {type: int, default: 2, range: [3, 5]}\ntree: find\n", [(4, 27, "wrong_value", "[3, 5]")]),
    ("parameter without a value", HEAD + "parameters:\n  v: {type: int}\ntree: find\n", [(4, 3, "missing_parameter", "--set v=")]),
    ("unknown object", HEAD + "parameters:\n  t: {type: stl, default: wukng}\ntree: find\n", [(4, 27, "no_such_stl", "did you mean 'wukong'")]),
    ("unread port", HEAD + "tree:\n  - judge\n", [(4, 5, "port_unset", "'marks'")]),
    ("port written too late", HEAD + "tree:\n  - number\n  - find\n", [(4, 5, "port_unset", "'find' at line 5 writes it, but later")]),
    ("port written on one branch only", HEAD + "tree:\n  - selector:\n    - find\n    - act\n  - number\n", [(7, 5, "port_maybe_unset", "'find' (line 5)")]),
    ("rewired to nothing", HEAD + "tree:\n  - find\n  - number:\n      in: {number: fond}\n", [(6, 20, "port_unset", "'fond'")]),
    ("wrong port type", HEAD + "tree:\n  - find\n  - number:\n      in: {number: items}\n", [(6, 20, "port_type", "as int, but 'find'")]),
    ("wrong element type", HEAD + "tree:\n  - find: {out: {items: things}}\n  - for_each: {items: things, item: n, do: {number: {in: {number: n}}}}\n", [(5, 67, "port_type", "writes Item")]),
    ("unknown port", HEAD + "tree:\n  find: {out: {foud: n}}\n", [(4, 16, "unknown_port", "did you mean 'found'")]),
    ("port of the other side", HEAD + "tree:\n  find: {in: {found: n}}\n", [(4, 15, "unknown_port", "belongs under out")]),
    ("not a key", HEAD + "tree:\n  find: {out: {found: /n}}\n", [(4, 23, "wrong_key", "'/n'")]),
    ("for_each over a number", HEAD + "tree:\n  - find\n  - for_each: {items: found, item: item, do: act}\n", [(5, 23, "port_type", "as tuple")]),
    ("collects what nobody writes", HEAD + "tree:\n  - find\n  - for_each: {items: items, item: item, collect: {mrk: marks}, do: act}\n", [(5, 52, "port_unset", "mrk")]),
    ("for_each by an unknown field", HEAD + "tree:\n  - find\n  - for_each: {items: items, item: item, order_by: sise, do: act}\n", [(5, 5, "unknown_field", "of Item")]),
    ("until of a number", HEAD + "tree:\n  repeat: {until: found, do: find}\n", [(4, 19, "port_type", "as bool")]),
    ("repeat without an end", HEAD + "tree:\n  repeat: {do: find}\n", [(4, 3, "wrong_value", "either times or until")]),
    ("two comparisons", HEAD + "tree:\n  - find\n  - condition: {port: found, at_least: 1, at_most: 2}\n", [(5, 5, "wrong_value", "exactly one")]),
    ("compares text with a number", HEAD + "tree:\n  - find\n  - condition: {port: found, equals: three}\n", [(5, 23, "port_type", "as str")]),
    ("unreachable in a selector", HEAD + "tree:\n  selector: [succeed: find, act]\n", [(4, 29, "unreachable", "always succeeds")]),
    ("unreachable in a sequence", HEAD + "tree:\n  sequence: [invert: {succeed: act}, find]\n", [(4, 38, "unreachable", "always fails")]),
    ("literal: unknown field", HEAD + "tree:\n  go_to: {in: {spot: {position_K_m: [0, 0, 0], yaw_rad: 0, cout: 1}}}\n", [(4, 60, "unknown_field", "did you mean 'count'")]),
    ("literal: missing field", HEAD + "tree:\n  go_to: {in: {spot: {position_K_m: [0, 0, 0]}}}\n", [(4, 22, "missing_parameter", "'yaw_rad'")]),
    ("literal: wrong unit", HEAD + "tree:\n  go_to: {in: {spot: {position_K_m: [0, 1 kg, 0], yaw_rad: 0}}}\n", [(4, 41, "wrong_unit", "in m, not 'kg'")]),
    ("literal: wrong type", HEAD + "tree:\n  go_to: {in: {spot: {position_K_m: 3, yaw_rad: x}}}\n", [(4, 37, "wrong_type", "list of numbers"), (4, 49, "wrong_type", "a number")]),
    ("literal for a type that has none", HEAD + "tree:\n  - use: {force_N: 1, in: {item: 7}}\n", [(4, 34, "wrong_type", "takes a Item")]),
    ("no children", HEAD + "tree:\n  sequence: []\n", [(4, 3, "no_children", "sequence")]),
    ("no child", HEAD + "tree:\n  retry: {attempts: 2}\n", [(4, 3, "no_children", "retry")]),
    ("missing setting", HEAD + "tree:\n  retry: {do: find}\n", [(4, 3, "missing_parameter", "'attempts'")]),
    ("setting out of range", HEAD + "tree:\n  timeout: {seconds: 0, do: find}\n", [(4, 22, "wrong_range", "> 0")]),
    ("bad policy", HEAD + "tree:\n  parallel: {policy: most, do: [find]}\n", [(4, 22, "wrong_type", "'all' or 'one'")]),
    ("two names in one node", HEAD + "tree:\n  - find:\n    act:\n", [(5, 5, "not_a_node", "indentation")]),
    (
        "an entry below another one",
        HEAD + "tree:\n  sequence:\n    do:\n      - tool_pickup\n        - tool_return\n",
        [(6, 9, "not_a_node", "begin each '-' in the same column")],
    ),
    ("a fault plan", "faults: x\nplan: []\n", [(1, 1, "wrong_type", "glotouch run MISSION --faults PLAN")]),
    ("a number is no node", HEAD + "tree:\n  - 7\n", [(4, 5, "not_a_node", "a node is expected here")]),
    ("skill with a list", HEAD + "tree:\n  find: [1]\n", [(4, 9, "wrong_type", "must be a mapping")]),
    ("unknown world", "mission: m\nworld: worlds/containr_five.yaml\ntree: find\n", [(2, 8, "unknown_world", "did you mean 'container_five'")]),
    ("unknown key", HEAD + "tre: find\ntree: find\n", [(3, 1, "unknown_key", "did you mean 'tree'")]),
    ("no tree", HEAD, [(1, 1, "missing_key", "'tree'")]),
    ("no world", "mission: m\ntree: find\n", [(1, 1, "missing_key", "'world'")]),
    ("bad name", "mission: a/b\nworld: container_five\ntree: find\n", [(1, 10, "wrong_name", "a/b")]),
    ("subtree that is not there", HEAD + "tree:\n  subtree: {file: gone.yaml}\n", [(4, 19, "unusable_subtree", "gone.yaml")]),
    ("subtree of itself", HEAD + "tree:\n  subtree: {file: m.yaml}\n", [(4, 19, "subtree_loop", "contains itself")]),
    (
        "many at once, sorted",
        HEAD + "tree:\n  - judge\n  - fnd: {how_mny: 1}\n  - find: {how_many: 99, speed_m_s: 1 kg}\n  - retry: {attempts: $n, do: act}\n",
        [
            (4, 5, "port_unset", "marks"),
            (5, 5, "unknown_skill", "find"),
            (5, 11, "unknown_parameter", "how_many"),
            (6, 22, "wrong_range", "99"),
            (6, 37, "wrong_unit", "kg"),
            (7, 23, "unknown_parameter", "'n'"),
        ],
    ),
]  # fmt: skip


@pytest.mark.parametrize(("text", "expected"), [m[1:] for m in MISTAKES], ids=[m[0] for m in MISTAKES])
def test_found_at_its_place(
    text: str, expected: list[tuple[int, int, str, str]], tmp_path: Path, registry: dict[str, Any]
) -> None:
    path = tmp_path / "m.yaml"
    path.write_text(text)
    with pytest.raises(MissionFaults) as e:
        load_mission(path, skills=registry)
    found = [(f.place.line, f.place.column, f.code) for f in e.value.findings]
    assert found == [x[:3] for x in expected], str(e.value)
    for finding, (line, column, _, words) in zip(e.value.findings, expected, strict=True):
        assert words in str(finding)
        assert str(finding).startswith(f"{path}:{line}:{column}: ")


GOOD = [
    ("optional order", "  - find\n  - number\n"),
    ("units", "  find: {speed_m_s: 40 mm/s}\n"),
    ("rewired", "  - find: {out: {found: n}}\n  - number: {in: {number: n}}\n"),
    ("both branches write", "  - selector: [find, find]\n  - number\n"),
    ("written under a failing branch", "  - selector:\n    - repeat: {until: complete, do: find}\n    - condition: {port: found, at_least: 1}\n"),
    ("condition makes it sure", "  - succeed: find\n  - condition: {port: found, at_least: 1}\n  - number\n"),
    ("written in an earlier pass", "  repeat:\n    times: 2\n    do: [{condition: {port: found, is_set: false}}, find]\n"),
    ("parallel sibling", "  - parallel: [find, act]\n  - number\n"),
    ("two findings' worth of names", "  - find: {name: a}\n  - find: {name: a}\n  - find: {name: a 2}\n"),
]  # fmt: skip


@pytest.mark.parametrize("tree", [g[1] for g in GOOD], ids=[g[0] for g in GOOD])
def test_nothing_is_found_in_good_trees(tree: str, load: Callable[..., Any]) -> None:
    names = [n.name for n in load(tree).spec.walk()]
    assert len(names) == len(set(names))


def test_set_overrides_are_typed_and_ranged(load: Callable[..., Any]) -> None:
    text = (
        HEAD + "parameters:\n  n: {type: int, default: 2, range: [1, 5]}\n  v: {type: float, default: 40, unit: mm/s}\n"
    )
    text += "  t: {type: stl, default: wukong}\n  b: {type: bool, default: false}\n"
    text += "tree:\n  find: {how_many: $n, speed_m_s: $v}\n"
    mission = load(text, n="4", v="0.05 m/s", t="apple", b="true")
    assert dict(mission.parameters) == {"n": 4, "v": 50.0, "t": "apple", "b": True}
    assert mission.spec.params is not None
    assert mission.spec.params.model_dump() == {"how_many": 4, "speed_m_s": 0.05, "mode": "fast"}
    assert mission.document["parameters"]["n"]["default"] == 4
    for name, value, word in (("n", "9", "[1, 5]"), ("n", "2.0", "whole"), ("t", "nobody", "unknown object"), ("b", "maybe", "true or false"), ("v", "inf", "must be a number"), ("n", "1_0", "whole"), ("v", "1_0", "must be a number"), ("v", "4 N", "not 'N'")):  # fmt: skip
        with pytest.raises(BadInput, match=f"--set {name}: ") as e:
            load(text, **{name: value})
        assert word in str(e.value)


def test_objects_folder_replaces_the_world_s(tmp_path: Path, registry: dict[str, Any]) -> None:
    path = tmp_path / "m.yaml"
    path.write_text(HEAD + "parameters:\n  t: {type: stl, default: wukong}\ntree: find\n")
    folder = tmp_path / "stl"
    folder.mkdir()
    with pytest.raises(BadInput, match=r"--objects .*: is not a folder with \.stl"):
        load_mission(path, skills=registry, objects=folder)
    (folder / "cup.stl").write_bytes((shipped_root() / "objects" / "apple.stl").read_bytes())
    (folder / "flat.stl").write_bytes(b"solid\nendsolid\n")
    with pytest.raises(BadInput, match=r"unknown object .*wukong.*valid: cup"):
        load_mission(path, skills=registry, objects=folder)
    for target in ("flat", "cup"):
        with pytest.raises(BadInput, match=r"--objects .*flat.stl: "):
            load_mission(path, {"t": target}, skills=registry, objects=folder)
    (folder / "flat.stl").unlink()
    mission = load_mission(path, {"t": "cup"}, skills=registry, objects=folder)
    assert mission.world.objects.folder == folder


def test_a_subtree_keeps_its_keys_to_itself(tmp_path: Path, registry: dict[str, Any]) -> None:
    (tmp_path / "sub.yaml").write_text(
        "subtree: sub\nparameters:\n  n: {type: int, default: 1}\ntree:\n  - find: {how_many: $n}\n  - number\n"
    )
    path = tmp_path / "m.yaml"
    path.write_text(
        HEAD
        + "tree:\n  - subtree: {file: sub.yaml, parameters: {n: 4}, ports: {found: ours}}\n  - number: {in: {number: ours}}\n"
    )
    mission = load_mission(path, skills=registry)
    find = next(n for n in mission.spec.walk() if n.skill == "find")
    assert find.writes["found"].key == "ours"
    assert find.writes["items"].key.startswith("sub@1/")
    path.write_text(
        HEAD + "tree:\n  - subtree: {file: sub.yaml, parameters: {m: 4}, ports: {fund: ours}}\n  - number\n"
    )
    with pytest.raises(MissionFaults) as e:
        load_mission(path, skills=registry)
    assert [(f.place.line, f.place.column, f.code) for f in e.value.findings] == [
        (4, 44, "unknown_parameter"),
        (4, 59, "unknown_port"),
        (5, 5, "port_unset"),
    ]


def test_the_resolved_mission_loads_again(load: Callable[..., Any], tmp_path: Path, registry: dict[str, Any]) -> None:
    text = HEAD + "parameters:\n  n: {type: int, default: 2}\ntree:\n  - find: {how_many: $n}\n  - number\n"
    again = tmp_path / "again.yaml"
    again.write_text(load(text, n=7).resolved_yaml())
    assert dict(load_mission(again, skills=registry).parameters) == {"n": 7}


WORDS = st.sampled_from(["find", "use", "act", "sequence", "selector", "retry", "for_each", "condition", "subtree", "repeat", "name", "do", "in", "out", "items", "item", "port", "until", "times", "attempts", "found", "$n", "file", "collect", "x"])  # fmt: skip
TREES = st.recursive(
    WORDS | st.integers(-3, 9) | st.none() | st.booleans(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(WORDS, inner, max_size=3),
    max_leaves=15,
)


@settings(max_examples=examples(100, 300), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(tree=TREES, parameters=TREES)
def test_any_tree_is_loaded_or_refused(tree: Any, parameters: Any, tmp_path: Path, registry: dict[str, Any]) -> None:
    """Whatever stands there: a mission or a BadInput, never another error."""
    import yaml

    path = tmp_path / "m.yaml"
    path.write_text(yaml.safe_dump({"mission": "m", "world": "container_five", "parameters": parameters, "tree": tree}))
    try:
        load_mission(path, skills=registry)
    except BadInput as refused:
        if str(path) not in str(refused):
            raise


def test_the_resolved_mission_carries_its_subtrees(tmp_path: Path, registry: dict[str, Any]) -> None:
    """It loads alike without their files: the same nodes, names and keys; a second time the same text."""
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "b").mkdir()
    (tmp_path / "a" / "sub.yaml").write_text(
        "tree:\n  - find\n  - subtree: {file: b/sub.yaml, ports: {found: found}}\n"
    )
    (tmp_path / "a" / "b" / "sub.yaml").write_text(
        "parameters: {n: {type: int, default: 1}}\ntree: {find: {how_many: $n}}\n"
    )
    path = tmp_path / "m.yaml"
    sub = "  - subtree: {file: a/sub.yaml, ports: {found: ours}}\n"
    path.write_text(HEAD + "tree:\n" + sub + sub + "  - number: {in: {number: ours}}\n")
    mission = load_mission(path, skills=registry)
    again = tmp_path / "elsewhere" / "m.yaml"
    again.parent.mkdir()
    again.write_text(mission.resolved_yaml())
    loaded = load_mission(again, skills=registry)

    def nodes(of: Any) -> list[Any]:
        return [
            (n.kind, n.name, [w.key for w in (*n.reads.values(), *n.writes.values())], n.params) for n in of.spec.walk()
        ]

    assert nodes(loaded) == nodes(mission)
    assert loaded.resolved_yaml() == mission.resolved_yaml()
    assert sorted(loaded.document["subtrees"]) == ["sub", "sub_2"]


def test_trees_without_end_are_refused(tmp_path: Path, registry: dict[str, Any]) -> None:
    """Eight levels of ten copies each would be a hundred million nodes."""
    for level in range(7):
        text = f"  - subtree: {{file: s{level + 1}.yaml}}\n" * 10 if level < 6 else "  - act\n"
        (tmp_path / f"s{level}.yaml").write_text("tree:\n" + text)
    path = tmp_path / "m.yaml"
    path.write_text(HEAD + "tree: {subtree: {file: s0.yaml}}\n")
    with pytest.raises(MissionFaults, match="more than 3000 nodes"):
        load_mission(path, skills=registry)


def test_what_a_mission_leaves_is_checked(load: Callable[..., Any]) -> None:
    for text, code in (("[]", "wrong_type"), ("{hand: 3}", "wrong_type"), ("{hnd: empty}", "unknown_resource")):
        with pytest.raises(MissionFaults) as e:
            load(HEAD + f"leaves: {text}\ntree: act\n")
        assert [f.code for f in e.value.findings] == [code]


@pytest.mark.parametrize("tares", ["", "tare, ", "{succeed: tare}, "])
def test_wrong_state__what_weighs_needs_a_tared_wrist(tares: str, tmp_path: Path) -> None:
    """An untared wrist weighs the hand itself: 8.7 N in empty jaws."""
    plan = "{candidate: 0, position_K_m: [0, 0, 25 mm], yaw_rad: 0 deg, aperture_m: 50 mm, opening_m: 80 mm}"
    path = tmp_path / "m.yaml"
    path.write_text(f"{HEAD}leaves: {{hand: object}}\ntree: [{tares}{{grasp: {{in: {{plan: {plan}}}}}}}, lift]\n")
    if tares == "tare, ":
        load_mission(path)
        return
    with pytest.raises(MissionFaults) as e:
        load_mission(path)
    found = [f for f in e.value.findings if f.code == "wrong_state"]
    assert found
    assert all("wrist" in f.what and "'untared'" in f.what and f.valid == "tared" for f in found)
