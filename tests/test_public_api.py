"""The public API: its names, its types, its documentation, and that it does what the command line does."""

from __future__ import annotations

import ast
import inspect
import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Literal, assert_type

import numpy as np
import py_trees
import pytest
from typer.testing import CliRunner

import glotouch_bt as gt
from glotouch_bt.cli import app

ROOT = Path(__file__).parents[1]
NAMES = {
    "HOLD",
    "BackendError",
    "BadInput",
    "Command",
    "Failure",
    "FaultPlan",
    "Finding",
    "GlotouchError",
    "In",
    "Mission",
    "MissionFaults",
    "MotionRefused",
    "Observation",
    "Out",
    "Robot",
    "RunRecord",
    "RunResult",
    "SafetyStop",
    "Skill",
    "SkillFailed",
    "SkillParams",
    "SkillRun",
    "__version__",
    "check",
    "load_mission",
    "open_robot",
    "param",
    "read_run",
    "run",
}
NOT_IN_EXAMPLES = {
    "__version__",
    "BackendError",
    "Command",
    "Finding",
    "GlotouchError",
    "In",
    "Mission",
    "MissionFaults",
    "MotionRefused",
    "Robot",
    "RunRecord",
    "SafetyStop",
    "SkillFailed",
}
"""Types that a script meets without naming them, and errors."""
WALL_TIMES = ("wall_time_s", "wall_open_s")

if TYPE_CHECKING:  # checked by mypy: the lazy names keep their types
    assert_type(gt.run("calibrate"), gt.RunResult)
    assert_type(gt.run("calibrate").status, Literal["success", "failure", "aborted"])
    assert_type(gt.check("calibrate"), tuple[gt.Finding, ...])
    assert_type(gt.open_robot("fake"), gt.Robot)
    assert_type(gt.read_run("run"), gt.RunRecord)
    assert_type(gt.load_mission("calibrate"), gt.Mission)
    assert_type(gt.FaultPlan.from_yaml("plan.yaml"), gt.FaultPlan)
    assert_type(gt.HOLD, gt.Command)


def test_the_names_are_pinned() -> None:
    assert set(gt.__all__) == NAMES == set(dir(gt))
    with pytest.raises(AttributeError, match="no attribute 'launch_mission'"):
        gt.launch_mission  # noqa: B018


@pytest.mark.parametrize("name", sorted(NAMES - {"__version__", "HOLD", "SkillRun"}))
def test_every_name_is_documented(name: str) -> None:
    value = getattr(gt, name)
    assert inspect.getdoc(value)
    if inspect.isfunction(value):
        hints = inspect.signature(value)
        assert all(p.annotation is not inspect.Parameter.empty for p in hints.parameters.values())
        assert hints.return_annotation is not inspect.Signature.empty


def test_the_examples_use_every_name() -> None:
    used: set[str] = set()
    for path in (ROOT / "examples").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "gt":
                used.add(node.attr)
    assert used | NOT_IN_EXAMPLES == NAMES


def test_the_import_is_cheap() -> None:
    code = "import sys, glotouch_bt; print([m for m in ('numpy', 'py_trees', 'pydantic') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_run_gives_what_the_command_line_gives(tmp_path: Path) -> None:
    result = gt.run("calibrate", backend="fake", seed=3, out=tmp_path / "api")
    words = ["run", "calibrate", "--backend", "fake", "--seed", "3", "--out", str(tmp_path / "cli"), "--json"]
    command = CliRunner().invoke(app, words)
    printed = json.loads(command.stdout)
    printed.pop("folder")
    for name in WALL_TIMES:
        printed.pop(name)
    assert {k: v for k, v in result.result.items() if k not in WALL_TIMES} == printed
    assert (tmp_path / "api" / "run.mcap").read_bytes() == (tmp_path / "cli" / "run.mcap").read_bytes()
    assert (result.status, command.exit_code, result.exit_code) == ("failure", 1, 1)
    assert result.reasons == printed["reasons"]
    assert result.folder == tmp_path / "api"
    assert result.report == tmp_path / "api" / "report.html"
    assert result.outputs == {}
    with pytest.raises(gt.BadInput, match="holds an earlier run"):
        gt.run("calibrate", backend="fake", out=tmp_path / "api")


def test_settings_are_parameters_and_backend_options() -> None:
    with pytest.raises(gt.BadInput, match="expected_objects = 0"):
        gt.run("survey", backend="fake", expected_objects=0)
    with pytest.raises(gt.BadInput, match="sleep"):
        gt.run("survey", backend="fake", sleep=True)
    with pytest.raises(gt.BadInput, match="must be a number, a text"):
        gt.run("survey", backend="fake", expected_objects=object())


def test_check_returns_findings(tmp_path: Path) -> None:
    assert gt.check("calibrate") == ()
    file = tmp_path / "m.yaml"
    file.write_text("mission: m\nworld: container_five\ntree: liift\n")
    found = [(finding.severity, finding.code) for finding in gt.check(file)]
    assert ("error", "unknown_skill") in found
    with pytest.raises(gt.BadInput):
        gt.check(tmp_path / "gone.yaml")


def test_a_mission_s_tree_is_a_py_trees_tree() -> None:
    mission = gt.load_mission("retrieve")
    names = [node.name for node in mission.tree.iterate()]
    assert sorted(names) == sorted(node.name for node in mission.spec.walk())
    assert "tool_pickup" in py_trees.display.unicode_tree(mission.tree)
    assert mission.tree is not mission.tree


def test_open_robot_closes_it() -> None:
    with gt.open_robot("fake", world="container_five", conditions="ideal") as robot:
        assert isinstance(robot.cycle(gt.HOLD), gt.Observation)
    with pytest.raises(gt.BadInput, match="did you mean 'mujoco'"):
        gt.open_robot("mujco")


def test_a_record_as_a_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record = gt.RunRecord(tmp_path, samples={"stamp_s": np.arange(3.0), "q": np.ones((3, 2))})
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(gt.BadInput, match="needs pandas, which is not installed"):
        record.to_dataframe()

    class Table(dict[str, Any]):
        def set_index(self, name: str) -> tuple[str, list[str]]:
            return name, list(self)

    monkeypatch.setitem(sys.modules, "pandas", SimpleNamespace(DataFrame=Table))
    made: Any = record.to_dataframe()
    assert made == ("stamp_s", ["stamp_s", "q_0", "q_1"])
