"""Mutants of trees: each differs, each changes one place, and what tells it from the original really does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from glotouch_bt.mission.load import Mission
from glotouch_bt.mission.spec.node import RetrySettings
from glotouch_bt.mission_testing.mutation.mutants import findings_of, mutants_of, signature
from glotouch_bt.mission_testing.mutation.search import Search

Make = Callable[..., Mission]

TREE = """
  - selector:
      - retry: {attempts: 3, do: find}
      - find: {name: again, how_many: 2}
  - condition: {name: enough, port: found, at_least: 2}
  - for_each: {items: items, item: item, on_failure: continue, least_first: weight, do: {succeed: use}}
  - timeout: {seconds: 10, do: {rest: {name: nap}}}
  - repeat: {until: complete, limit: 4, do: {find: {name: more}}}
"""


def test_every_kind_of_slip_is_made_once(mission: Make) -> None:
    made = mission(TREE)
    mutants = list(mutants_of(made.tree))
    signatures = [signature(m.apply(made.tree)) for m in mutants]
    assert len(set(signatures)) == len(signatures)
    assert signature(made.tree) not in signatures
    assert {m.operator for m in mutants} == {
        "composite", "drop", "unwrap", "wrap", "order", "bound", "key", "on_failure", "constant", "parameter",
    }  # fmt: skip
    assert all(m.place.file == str(made.file) and m.place.line >= 4 for m in mutants)


@pytest.mark.parametrize(
    "what",
    [
        "selector 'selector' becomes a sequence",
        "retry 'retry' dropped, its child stays",
        "'again' dropped from selector 'selector'",
        "'again' put below invert",
        "'retry': attempts 3 becomes 2",
        "'retry': attempts 3 becomes 4",
        "'again': how_many left to its default",
        "'enough': at_least 2 becomes 1",
        "'enough': at_least 2 becomes 3",
        "'enough': at_least becomes at_most",
        "'for_each': on_failure becomes stop",
        "'for_each': least_first dropped",
        "'timeout': seconds 10 becomes 5",
        "'repeat': limit 4 becomes 3",
        "'enough' and 'for_each' change places",
    ],
)
def test_it_is_the_slip_it_says_it_is(mission: Make, what: str) -> None:
    made = mission(TREE)
    mutant = next(m for m in mutants_of(made.tree) if m.what == what)
    before, after = (sum(1 for _ in t.walk()) for t in (made.tree, mutant.apply(made.tree)))
    grown = {"wrap": 1, "unwrap": -1, "drop": -1}.get(mutant.operator, 0)
    assert after - before == grown


def test_what_stands_twice_in_a_tree_is_changed_in_both_places(mission: Make, tmp_path: Path) -> None:
    (tmp_path / "part.yaml").write_text("subtree: part\ntree:\n  - retry: {attempts: 2, do: find}\n  - rest\n")
    made = mission("\n  - subtree: {file: part.yaml}\n  - subtree: {file: part.yaml}\n")
    mutant = next(m for m in mutants_of(made.tree) if m.what == "'retry': attempts 2 becomes 3")
    changed = [n.settings for n in mutant.apply(made.tree).walk() if n.kind == "retry"]
    assert [s.attempts for s in changed if isinstance(s, RetrySettings)] == [3, 3]
    assert mutant.place.file.endswith("part.yaml")


def test_what_check_refuses_is_known_before_it_is_tried(mission: Make) -> None:
    made = mission("\n  - find\n  - for_each: {items: items, item: item, do: use}\n")
    mutant = next(m for m in mutants_of(made.tree) if m.what == "'find' dropped from sequence 'sequence'")
    assert findings_of(made, made.tree) == []
    assert "port_unset" in {f.code for f in findings_of(made, mutant.apply(made.tree))}


EQUIVALENT = {"'for_each' put below succeed", "'for_each': on_failure becomes continue"}


def test_what_nothing_tells_apart_is_equivalent_and_all_else_is_told_apart(mission: Make) -> None:
    """`use` below succeed cannot fail, so that the for_each cannot either."""
    made = mission("\n  - find\n  - for_each: {items: items, item: item, do: {succeed: {name: on, do: use}}}\n")
    search = Search(made, scripts=150)
    told: dict[str, bool] = {}
    for mutant in mutants_of(made.tree):
        tree = mutant.apply(made.tree)
        if not findings_of(made, tree):
            told[mutant.what] = search.difference(tree) is not None
    assert {what for what, found in told.items() if not found} == EQUIVALENT & set(told)
    assert len(told) > 5


def test_a_difference_is_short_and_says_where_they_part(mission: Make) -> None:
    made = mission("\n  - find\n  - retry: {attempts: 2, do: {find: {name: again}}}\n")
    mutant = next(m for m in mutants_of(made.tree) if m.what == "'retry': attempts 2 becomes 3")
    found = Search(made).difference(mutant.apply(made.tree))
    assert found is not None
    assert found.script in ("{'again': fails('nothing')}", "{'again': fails('blocked')}")
    assert found.where == "after 3 calls"
    assert found.before.startswith("no more calls: failure")
    assert found.after.startswith("again[")


def test_a_tree_is_not_told_from_itself(mission: Make) -> None:
    made = mission(TREE)
    assert Search(made, scripts=40).difference(replace(made.tree)) is None
