"""A run uses its own folder only: it takes none that holds something else, and removes nothing that no run wrote."""

from __future__ import annotations

from pathlib import Path

import pytest

from glotouch_bt.robot import BadInput
from glotouch_bt.runs.folder import FILES, PARTS, RunFolder, holds_run

RESULT = '{"mission": "m", "backend": "b", "seed": 0, "status": "success", "versions": {}}'


def files(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.mark.parametrize("name", ["mission.yaml", "report.html", "result.json", "run.mcap", "photo.png", "earlier/1/a"])
@pytest.mark.parametrize("overwrite", [False, True])
def test_a_folder_that_is_no_run_is_refused(tmp_path: Path, name: str, overwrite: bool) -> None:
    """Whatever its files are named."""
    (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / name).write_text("{}")
    with pytest.raises(BadInput, match="is not empty and holds no run"):
        RunFolder(tmp_path).check_free(overwrite)
    assert files(tmp_path) == {name: b"{}"}


def test_a_run_is_replaced_only_when_told_to_and_nothing_else_goes(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path / "run")
    folder.check_free(False)
    kept = {"notes.txt": "mine", "earlier/1/notes.txt": "mine", "earlier/thoughts": "mine", ".writable": "mine"}
    gone = {**dict.fromkeys(FILES, "x"), "earlier/1/run.mcap": "x", "earlier/2/result.json": "x", PARTS[0]: "x"}
    for name, text in (kept | gone | {"result.json": RESULT}).items():
        (folder.path / name).parent.mkdir(parents=True, exist_ok=True)
        (folder.path / name).write_text(text)
    assert holds_run(folder.path)
    with pytest.raises(BadInput, match="--overwrite"):
        folder.check_free(False)
    again = RunFolder(folder.path)
    again.check_free(True)
    again.clear()
    assert files(folder.path) == {k: v.encode() for k, v in sorted(kept.items())}
    assert not (folder.path / "earlier" / "2").exists()


@pytest.mark.parametrize(
    "name", [*FILES, *PARTS, "checkpoint.sqlite-wal", "checkpoint.sqlite-journal", "earlier", "models"]
)
def test_links_under_a_run_s_names_are_refused(tmp_path: Path, name: str) -> None:
    victim, run = tmp_path / "victim", tmp_path / "run"
    victim.mkdir() if name in ("earlier", "models") else victim.write_text("precious")
    run.mkdir()
    (run / "result.json").write_text(RESULT)
    (run / name).unlink(missing_ok=True)
    (run / name).symlink_to(victim)
    with pytest.raises(BadInput, match="is a symbolic link"):
        RunFolder(run)
    assert victim.is_dir() or victim.read_text() == "precious"


def test_a_run_that_does_not_start_leaves_no_folder_and_takes_none_with_it(tmp_path: Path) -> None:
    made = RunFolder(tmp_path / "a" / "b")
    (made.path / "models").mkdir()
    (made.path / "models" / "apple.stl").write_text("x")
    made.discard()
    assert not (tmp_path / "a").exists()
    made = RunFolder(tmp_path / "a" / "b")
    (tmp_path / "a" / "mine").write_text("x")
    made.discard()
    assert files(tmp_path) == {"a/mine": b"x"}
    there = RunFolder(tmp_path)
    there.discard()
    assert files(tmp_path) == {"a/mine": b"x"}


def test_a_link_in_place_of_a_part_is_not_written_through(tmp_path: Path) -> None:
    """It appeared after the check."""
    folder, victim = RunFolder(tmp_path / "run"), tmp_path / "victim"
    victim.write_text("precious")
    (folder.path / ".result.json.part").symlink_to(victim)
    with pytest.raises(Exception, match="cannot be written"):
        folder.write_json("result.json", {})
    assert victim.read_text() == "precious"
