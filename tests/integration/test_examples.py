"""The examples run as they are: three scripts, a notebook and a mission."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

import glotouch_bt as gt

EXAMPLES = Path(__file__).parents[2] / "examples"


def run_python(*words: str, cwd: Path) -> str:
    done = subprocess.run([sys.executable, *words], cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("name", ["own_skill", "inject_fault"])
def test_script_without_physics(name: str, tmp_path: Path) -> None:
    run_python(str(EXAMPLES / f"{name}.py"), cwd=tmp_path)


def test_run_mission(tmp_path: Path) -> None:
    out = run_python(str(EXAMPLES / "run_mission.py"), "run", cwd=tmp_path)
    assert "success" in out
    assert (tmp_path / "run" / "report.html").is_file()


@pytest.mark.study
def test_notebook(tmp_path: Path) -> None:
    """The cells run in order as one script, with one object fewer to find."""
    notebook = json.loads((EXAMPLES / "tour.ipynb").read_text())
    cells = [c for c in notebook["cells"] if c["cell_type"] == "code"]
    assert all(c["outputs"] == [] and c["execution_count"] is None for c in cells), "commit it without outputs"
    script = tmp_path / "tour.py"
    text = "\n\n".join("".join(c["source"]) for c in cells)
    assert "expected_objects=2" in text
    script.write_text(text.replace("expected_objects=2", "expected_objects=1"))
    run_python("-W", "ignore:FigureCanvasAgg", str(script), cwd=tmp_path)


def test_the_mission_is_sound() -> None:
    assert gt.check(EXAMPLES / "crowded.yaml") == ()


def test_every_example_is_run() -> None:
    files = {p.name for p in EXAMPLES.iterdir() if p.suffix in (".py", ".ipynb", ".yaml")}
    assert files == {"own_skill.py", "inject_fault.py", "run_mission.py", "tour.ipynb", "crowded.yaml"}
