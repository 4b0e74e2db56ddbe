"""Values that pass between loops, subtrees and the mission: items of a tuple, private keys, states in the end."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from glotouch_bt import cli
from glotouch_bt.mission.spec.findings import Finding
from glotouch_bt.validation.seeded_mistakes.mistakes import MISSION

Found = Callable[..., list[Finding]]

HEAD = "mission: m\nworld: container_five\n"
FOUND = "  - subtree: {file: subtrees/find_objects.yaml%s}\n"
SQUEEZED = "  - subtree: {file: subtrees/squeeze_all.yaml, ports: {candidates: candidates}}\n"


MISTAKES = [
    ("{touchset: touchsets}", "{touchset: candidates}", "port_type", "'squeeze all' (line 40) writes tuple of T"),
    ("{touchset: touchsets}", "{touchset: touchsets, candidate: touchsets}", "written_twice", "'touchsets'"),
    ("{touchset: touchsets}", "{touchset: candidate}", "written_twice", "'candidate'"),
    ("{touchset: touchsets}", "{touchset: touch_sets}", "unused_key", "no node writes 'touchsets'"),
    ("order_by: quality", "order_by: contour", "unknown_field", "'contour'"),
    ("order_by: quality", "order_by: extent_K_m", "unknown_field", "'extent_K_m'"),
    ("order_by: quality", "order_by: span_m", "unknown_field", "'span_m'"),
    ("{hand: object}", "{hand: objct}", "unknown_state", "state of the hand: 'objct'"),
    ("{hand: object}", "{hand: [object, emtpy]}", "unknown_state", "state of the hand: 'emtpy'"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "code", "words"), MISTAKES, ids=[m[1] for m in MISTAKES])
def test_a_wrong_wire(old: str, new: str, code: str, words: str, found_in: Found) -> None:
    assert MISSION.count(old) == 1
    found = found_in(MISSION.replace(old, new))
    assert {f.code for f in found} == {code} or code == "written_twice"
    assert any(f.code == code and words in f.what for f in found)


@pytest.mark.parametrize("field", ["quality", "height_m", "index"])
def test_what_can_be_put_in_order(field: str, found_in: Found) -> None:
    assert found_in(MISSION.replace("order_by: quality", f"order_by: {field}")) == []


def test_a_key_that_a_subtree_keeps_to_itself(found_in: Found) -> None:
    (found,) = found_in(HEAD + "tree:\n" + FOUND % "" + SQUEEZED)
    assert found.code == "port_unset"
    assert "subtree 'find_objects' keeps its own 'candidates' to itself" in found.what
    assert found_in(HEAD + "tree:\n" + FOUND % ", ports: {candidates: candidates}" + SQUEEZED) == []


def test_only_a_subtree_s_own_keys_are_its_ports(found_in: Found) -> None:
    found = found_in(HEAD + "tree:\n" + FOUND % ", ports: {objects: candidates}")
    assert [(f.code, f.valid) for f in found] == [
        ("unknown_port", "candidates, found, map, postponed, probed, unmeasured")
    ]


@pytest.mark.parametrize(
    ("given", "nearest"),
    [
        ("subtrees/hold", "subtrees/hold.yaml"),
        ("subtrees/recognize.yaml", "subtrees/recognise.yaml"),
        ("beside.yml", "beside.yaml"),
        ("mnie", "mine"),
    ],
)
def test_a_subtree_of_a_name_like_it(given: str, nearest: str, tmp_path: Path, found_in: Found) -> None:
    (tmp_path / "beside.yaml").write_text("tree: tare\n")
    text = HEAD + "subtrees: {mine: {tree: tare}}\ntree:\n  - subtree: {file: mine}\n"
    (found,) = found_in(text + f"  - subtree: {{file: {given}}}\n")
    assert (found.code, found.hint) == ("unusable_subtree", nearest)


def test_a_subtree_that_nobody_uses(found_in: Found) -> None:
    found = found_in(HEAD + "subtrees: {mine: {tree: trae}}\ntree: bare_hand\n")
    assert [(f.code, f.place.line, f.place.column) for f in found] == [("unused_subtree", 3, 12)]


def test_a_setting_of_a_name_like_a_parameter() -> None:
    done = CliRunner().invoke(cli.app, ["check", "retrieve", "--set", "targt=apple"])
    assert done.exit_code == 0
    assert "targt; did you mean 'target'?" in done.stdout
