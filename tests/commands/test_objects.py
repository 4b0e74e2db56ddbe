"""`glotouch objects`: exit codes, the clean folder, the page and the JSON."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
import trimesh
from typer.testing import CliRunner

from glotouch_bt import check, cli
from glotouch_bt.robot.scene import load_folder


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine").mkdir()
    trimesh.creation.box((50, 40, 60)).export("mine/b<i>x.obj")
    trimesh.creation.cylinder(30, 60).export("mine/tin.ply")
    return tmp_path


def objects(*words: str) -> tuple[int, str, str]:
    done = CliRunner().invoke(cli.app, ["objects", *words])
    assert "Traceback" not in done.output
    assert "internal error" not in done.output
    return done.exit_code, done.stdout, done.stderr


def test_a_new_user_s_way(folder: Path) -> None:
    """The unit is missing: the command says what to type; then a clean folder is written, which a mission takes."""
    code, out, _ = objects("mine")
    assert (code, out.splitlines()[-1]) == (2, "next: glotouch objects mine --units mm")
    code, out, _ = objects("mine", "--units", "mm", "--out", "clean")
    assert code == 0
    assert "next: glotouch run retrieve --objects clean --set target=b<i>x" in out
    assert sorted(p.name for p in Path("clean").iterdir()) == ["b<i>x.stl", "objects.html", "tin.stl"]
    assert [m.name for m in load_folder(Path("clean"))] == ["b<i>x", "tin"]
    assert not [f for f in check("retrieve", {"target": "tin"}, objects="clean") if f.severity == "error"]
    page = Path("clean/objects.html").read_text()
    assert "b&lt;i&gt;x" in page
    assert "b<i>x" not in page
    assert set(re.findall(r'(?:src|href)="(\w+:)', page)) == {"data:"}


def test_a_clean_folder_is_replaced_only_when_asked(folder: Path) -> None:
    assert objects("mine", "--units", "mm", "--out", "clean")[0] == 0
    code, _, said = objects("mine", "--units", "mm", "--out", "clean")
    assert (code, "is not empty" in said) == (2, True)
    Path("mine/tin.ply").unlink()
    assert objects("mine", "--units", "mm", "--out", "clean", "--overwrite")[0] == 0
    assert not Path("clean/tin.stl").exists()
    Path("clean/notes.txt").write_text("mine")
    code, _, said = objects("mine", "--units", "mm", "--out", "clean", "--overwrite")
    assert (code, "is no clean folder (holds notes.txt)" in said) == (2, True)
    assert "holds the files to read" in objects("mine", "--units", "mm", "--out", "mine", "--overwrite")[2]


def test_no_target_is_proposed_that_must_fail(folder: Path) -> None:
    """A plate of 6 mm is lower than the ball's path."""
    trimesh.creation.box((50, 40, 6)).export("plate.stl")
    code, out, _ = objects("plate.stl", "--units", "mm", "--out", "clean")
    assert (code, "not a target" in out, "--set target=" in out) == (0, True, False)
    assert "none of them can be a target" in out


def test_a_folder_of_several_units_is_to_be_sorted(folder: Path) -> None:
    trimesh.creation.box((0.05, 0.04, 0.06)).export("mine/in_metres.stl")
    code, out, _ = objects("mine")
    assert (code, out.splitlines()[-1]) == (
        2,
        "next: sort the files by their unit (mm and that of the others) into folders",
    )


def test_the_rest_is_written_when_a_file_is_refused(folder: Path) -> None:
    Path("mine/bad.stl").write_text("no mesh")
    code, out, _ = objects("mine", "--units", "mm", "--out", "clean", "--json")
    assert code == 2
    found = {o["name"]: o for o in json.loads(out)["objects"]}
    assert [n for n, o in found.items() if not o["usable"]] == ["bad"]
    assert "is not a readable STL file" in found["bad"]["reason"]
    assert found["tin"]["size_m"] == [0.06, 0.06, 0.06]
    assert len(load_folder(Path("clean"))) == 2


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("gone", "gone: no such folder or file"),
        ("empty", "empty: holds no mesh (formats: .stl, .obj, .ply, .glb, .off)"),
        ("mine --units km", "unknown unit 'km'"),
        ("mine --side tin=x", "--side tin=x: must be the number of a side, from 1"),
        ("mine --side tan=1", "--side tan=1: no such object (it has b<i>x, tin)"),
        ("mine --side tin", "--side tin: must be NAME=VALUE"),
        ("mine --out mine/tin.ply", "--out mine/tin.ply: is a file"),
        ("mine --backend mujco", "unknown backend 'mujco'"),
    ],
)
def test_bad_input(words: str, said: str, folder: Path) -> None:
    Path("empty").mkdir()
    code, out, err = objects(*words.split())
    assert (code, out) == (2, "")
    assert said in err
