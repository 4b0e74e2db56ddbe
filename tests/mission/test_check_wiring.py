"""What passes between loops, subtrees and the mission: items of a tuple, private keys, states in the end."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from glotouch_bt import cli
from glotouch_bt.mission.findings import Finding, MissionFaults
from glotouch_bt.mission.load import load_mission
from glotouch_bt.study.mistakes import MISSION

HEAD = "mission: m\nworld: container_five\n"
FOUND = "  - subtree: {file: subtrees/find_objects.yaml%s}\n"
SQUEEZED = "  - subtree: {file: subtrees/squeeze_all.yaml, ports: {candidates: candidates}}\n"


def found_in(text: str, tmp_path: Path) -> list[Finding]:
    path = tmp_path / "m.yaml"
    path.write_text(text)
    try:
        return list(load_mission(path).warnings)
    except MissionFaults as e:
        return [*e.findings, *e.warnings]


MISTAKES = [
    ("{touchset: touchsets}", "{touchset: candidates}", "port_type", "'squeeze all' (line 40) writes tuple of T"),
    ("{touchset: touchsets}", "{touchset: touchsets, candidate: touchsets}", "written_twice", "'touchsets'"),
    ("{touchset: touchsets}", "{touchset: candidate}", "written_twice", "'candidate'"),
    ("{touchset: touchsets}", "{touchset: touch_sets}", "unused_key", "nobody writes 'touchsets'"),
    ("least_first: quality", "least_first: contour", "unknown_field", "'contour'"),
    ("least_first: quality", "least_first: extent_K_m", "unknown_field", "'extent_K_m'"),
    ("least_first: quality", "least_first: span_m", "unknown_field", "'span_m'"),
    ("{hand: object}", "{hand: objct}", "unknown_state", "state of the hand: 'objct'"),
    ("{hand: object}", "{hand: [object, emtpy]}", "unknown_state", "state of the hand: 'emtpy'"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "code", "words"), MISTAKES, ids=[m[1] for m in MISTAKES])
def test_a_wrong_wire(old: str, new: str, code: str, words: str, tmp_path: Path) -> None:
    assert MISSION.count(old) == 1
    found = found_in(MISSION.replace(old, new), tmp_path)
    assert {f.code for f in found} == {code} or code == "written_twice"
    assert any(f.code == code and words in f.what for f in found)


@pytest.mark.parametrize("field", ["quality", "height_m", "index"])
def test_what_can_be_put_in_order(field: str, tmp_path: Path) -> None:
    assert found_in(MISSION.replace("least_first: quality", f"least_first: {field}"), tmp_path) == []


def test_a_key_that_a_subtree_keeps_to_itself(tmp_path: Path) -> None:
    (found,) = found_in(HEAD + "tree:\n" + FOUND % "" + SQUEEZED, tmp_path)
    assert found.code == "port_unset"
    assert "subtree 'find_objects' keeps its own 'candidates' to itself" in found.what
    assert found_in(HEAD + "tree:\n" + FOUND % ", ports: {candidates: candidates}" + SQUEEZED, tmp_path) == []


def test_only_a_subtree_s_own_keys_are_its_ports(tmp_path: Path) -> None:
    found = found_in(HEAD + "tree:\n" + FOUND % ", ports: {objects: candidates}", tmp_path)
    assert [(f.code, f.valid) for f in found] == [("unknown_port", "candidates, found")]


@pytest.mark.parametrize(
    ("given", "nearest"),
    [
        ("subtrees/hold", "subtrees/hold.yaml"),
        ("subtrees/recognize.yaml", "subtrees/recognise.yaml"),
        ("beside.yml", "beside.yaml"),
        ("mnie", "mine"),
    ],
)
def test_a_subtree_of_a_name_like_it(given: str, nearest: str, tmp_path: Path) -> None:
    (tmp_path / "beside.yaml").write_text("tree: tare\n")
    text = HEAD + "subtrees: {mine: {tree: tare}}\ntree:\n  - subtree: {file: mine}\n"
    (found,) = found_in(text + f"  - subtree: {{file: {given}}}\n", tmp_path)
    assert (found.code, found.hint) == ("unusable_subtree", nearest)


def test_a_subtree_that_nobody_uses(tmp_path: Path) -> None:
    found = found_in(HEAD + "subtrees: {mine: {tree: trae}}\ntree: bare_hand\n", tmp_path)
    assert [(f.code, f.place.line, f.place.column) for f in found] == [("unused_subtree", 3, 12)]


def test_a_setting_of_a_name_like_a_parameter() -> None:
    done = CliRunner().invoke(cli.app, ["check", "retrieve", "--set", "targt=apple"])
    assert done.exit_code == 0
    assert "for the backend: targt; did you mean 'target'?" in done.stdout
