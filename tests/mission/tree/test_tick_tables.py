"""Tick tables: what each composite and decorator answers, tick by tick (R running, S success, F failure)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from glotouch_bt.mission.nodes.for_each import ForEach, ForEachSettings

TABLE = [
    ("one skill", "  act: {script: RRS}", "RRS"),
    ("a failing skill", "  act: {script: RF}", "RF"),
    ("sequence goes on in the same tick", "  sequence: [act: {script: RS}, act: {script: RS}]", "RRS"),
    ("sequence stops at a failure", "  sequence: [act, act: {script: F}, act: {script: RRR}]", "F"),
    ("a list is a sequence", "  - act: {script: R}\n  - act\n", "RS"),
    ("selector takes the first success", "  selector: [act: {script: RF}, act: {script: RS}, act]", "RRS"),
    ("selector fails when all do", "  selector: [act: {script: F}, act: {script: RF}]", "RF"),
    ("parallel all", "  parallel: {policy: all, do: [act: {script: RS}, act: {script: RRRS}]}", "RRRS"),
    ("parallel one", "  parallel: {policy: one, do: [act: {script: RRRS}, act: {script: RS}]}", "RS"),
    ("parallel fails at once", "  parallel: [act: {script: RF}, act: {script: RRRS}]", "RF"),
    ("retry until success", "  retry: {attempts: 3, do: {act: {script: FFS}}}", "RRS"),
    ("retry runs out", "  retry: {attempts: 2, do: {act: {script: FFS}}}", "RF"),
    ("repeat times", "  repeat: {times: 3, do: {act: {script: SSS}}}", "RRS"),
    ("repeat times fails", "  repeat: {times: 3, do: {act: {script: SF}}}", "RF"),
    ("invert", "  invert: {act: {script: RS}}", "RF"),
    ("invert a failure", "  invert: {do: {act: {script: F}}}", "S"),
    ("succeed", "  succeed: {act: {script: RF}}", "RS"),
    ("fail", "  fail: {act: {script: RS}}", "RF"),
    ("fail what fails", "  fail: {do: {act: {script: RF}}}", "RF"),
    ("a safe ending fails on", "  selector: [act: {script: RF}, fail: {act: {script: RS}}]", "RRF"),
    ("timeout fails", "  timeout: {seconds: 30 ms, do: {act: {script: RRRRRR}}}", "RRRF"),
    ("timeout lets success through", "  timeout: {seconds: 0.05, do: {act: {script: RS}}}", "RS"),
    (
        "timeout starts anew",
        "  retry: {attempts: 2, do: {timeout: {seconds: 0.02, do: {act: {script: RRRRRRRR}}}}}",
        "RRRRRF",
    ),
    ("condition true", "  sequence: [find, condition: {port: found, at_least: 3}]", "RS"),
    ("condition false", "  sequence: [find, condition: {port: found, at_least: 4}]", "RF"),
    ("condition at_most", "  sequence: [find, condition: {port: found, at_most: 3}]", "RS"),
    ("condition equals", "  sequence: [find, condition: {port: complete, equals: true}]", "RS"),
    ("condition equals is typed", "  sequence: [find: {how_many: 1}, condition: {port: found, equals: 1}]", "RS"),
    ("condition is_set", "  sequence: [find, condition: {port: found, is_set: true}]", "RS"),
    ("condition is_set false", "  sequence: [find, condition: {port: found, is_set: false}]", "RF"),
    ("repeat until a key", "  repeat: {until: complete, do: find}", "RS"),
    ("repeat until a comparison", "  repeat: {until: {port: found, at_least: 1}, do: find}", "RS"),
    ("repeat until runs out", "  repeat: {until: {port: found, at_least: 9}, limit: 2, do: find}", "RRRF"),
    ("for_each", "  - find\n  - for_each: {items: items, item: item, do: {use: {force_N: 1}}}", "RRRRRRS"),
    (
        "for_each of nothing",
        "  - find: {how_many: 0}\n  - for_each: {items: items, item: item, do: {act: {script: F}}}",
        "RS",
    ),
    ("for_each stops", "  - find\n  - for_each: {items: items, item: item, do: {act: {script: SF}}}", "RRF"),
    (
        "for_each goes on",
        "  - find\n  - for_each: {items: items, item: item, on_failure: continue, do: {act: {script: FSF}}}",
        "RRRS",
    ),
    (
        "for_each without one success",
        "  - find\n  - for_each: {items: items, item: item, on_failure: continue, do: {act: {script: FFF}}}",
        "RRRF",
    ),
]


@pytest.mark.parametrize(("tree", "expected"), [t[1:] for t in TABLE], ids=[t[0] for t in TABLE])
def test_tick_table(tree: str, expected: str, built: Callable[[str], Any], robot: Any, log: list[str]) -> None:
    """Each tick is followed by one control period of 10 ms."""
    made, context = built(tree)
    seen = ""
    for _ in expected:
        made.root.tick_once()
        seen += made.root.status.value[0]
        context.observation = robot.cycle(None)
    made.forget()
    assert seen == expected


def test_a_preempted_skill_is_closed_and_holds(built: Callable[[str], Any], robot: Any, log: list[str]) -> None:
    made, context = built("  timeout: {seconds: 0.01, do: {act: {script: RRRR}}}")
    for _ in range(2):
        context.command = None
        made.root.tick_once()
        context.observation = robot.cycle(None)
    assert log == ["actR", "actR", "act!"]
    assert context.command.motion is None


def test_for_each_gathers_only_what_succeeded(built: Callable[[str], Any], robot: Any) -> None:
    tree = """
    - find: {how_many: 3}
    - for_each:
        items: items
        item: item
        collect: {mark: marks}
        do: {use: {force_N: 7}}
    - judge
"""
    made, context = built(tree)
    for _ in range(12):
        made.root.tick_once()
        context.observation = robot.cycle(None)
        if made.root.status.value != "RUNNING":
            break
    assert made.root.status.value == "SUCCESS"
    assert made.value("marks") == (7.0, 7.0, 7.0)
    assert made.value("best") == 7.0
    made.forget()
    assert made.value("best") is None


def test_two_trees_do_not_share_keys(built: Callable[[str], Any], robot: Any) -> None:
    first, context = built("  find: {how_many: 1}")
    second, _ = built("  find: {how_many: 2}")
    for _ in range(2):
        first.root.tick_once()
        context.observation = robot.cycle(None)
    assert first.value("found") == 1
    assert second.value("found") is None


def test_a_port_takes_a_value_written_in_the_mission(built: Callable[[str], Any], robot: Any) -> None:
    made, context = built("  go_to: {in: {spot: {position_K_m: [10 mm, 0, 0.5], yaw_rad: 90 deg}}}")
    for _ in range(2):
        made.root.tick_once()
        context.observation = robot.cycle(None)
    seen: Any = made.value("seen")
    assert seen.position_K_m.tolist() == [0.01, 0.0, 0.5]
    assert abs(seen.yaw_rad - 1.5707963267949) < 1e-12
    made.forget()


def test_a_subtree_s_keys_are_its_own(built: Callable[[str], Any], robot: Any, tmp_path: Path) -> None:
    sub = "subtree: s\nparameters:\n  n: {type: int, default: 1}\ntree:\n  - find: {how_many: $n}\n  - number\n"
    (tmp_path / "a.b.yaml").write_text(sub)
    made, context = built(
        "  - find\n  - subtree: {file: a.b.yaml, parameters: {n: 5}, ports: {complete: ours}}\n  - number\n"
    )
    for _ in range(5):
        made.root.tick_once()
        context.observation = robot.cycle(None)
    assert made.root.status.value == "SUCCESS"
    assert (made.value("found"), made.value("ours"), made.value("a_b@1/found")) == (3, True, 5)
    made.forget()


def test_for_each_takes_the_least_first_and_gathers_in_order() -> None:
    """Whatever order the items are taken in, what is gathered keeps theirs."""
    keys, taken = _Keys({"items": tuple(complex(r, i) for i, r in enumerate((0.7, 0.2, 0.5)))}), []

    class Child(Behaviour):
        def update(self) -> Status:
            item = keys.get("item")
            taken.append(item.imag)
            keys.set("mark", item.imag)
            return Status.FAILURE if item.real == 0.2 else Status.SUCCESS

    settings = ForEachSettings(items="items", item="item", on_failure="continue", order_by="real")
    made = ForEach("each", Child("child"), keys, "items", "item", {"mark": "marks"}, settings)
    while made.status not in (Status.SUCCESS, Status.FAILURE):
        made.tick_once()
    assert taken == [1, 2, 0]
    assert (made.status, keys.get("marks")) == (Status.SUCCESS, (0, 2))


class _Keys:
    """A blackboard of one's own."""

    def __init__(self, values: dict[str, Any]) -> None:
        self.values = values

    def get(self, key: str) -> Any:
        return self.values.get(key)

    def set(self, key: str, value: Any) -> None:
        self.values[key] = value

    def unset(self, key: str) -> None:
        self.values.pop(key, None)
