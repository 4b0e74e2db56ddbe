"""The simulated sensors' parameters and the recogniser's beliefs are separate: neither reads the other."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from glotouch_bt.robot.scene import AXES

ROOT = Path(__file__).parents[1]
METHOD = ("glotouch_skills", "glotouch_bt/perception", "glotouch_bt/motion")
"""Packages of the method: what it believes is written there."""
SIMULATOR = ("glotouch_backends/mujoco", "glotouch_bt/robot/scene")


def sources(*folders: str) -> list[Path]:
    return [p for folder in folders for p in sorted((ROOT / folder).rglob("*.py"))]


def names_in(path: Path) -> Iterator[str]:
    """Yield every name, attribute, imported name and module of a file, and its short texts."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.Attribute):
            yield node.attr
        elif isinstance(node, ast.ImportFrom):
            yield node.module or ""
            yield from (a.name for a in node.names)
        elif isinstance(node, ast.Import):
            yield from (a.name for a in node.names)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


@pytest.mark.parametrize("path", sources(*METHOD), ids=lambda p: str(p.relative_to(ROOT)))
def test_the_method_reads_no_conditions(path: Path) -> None:
    """Neither the class, nor a profile, nor an axis by name, nor a module of the simulated sensors."""
    used = set(names_in(path))
    assert used.isdisjoint({"Conditions", "load_conditions", "conditions_of", *AXES})
    assert not any("glotouch_missions/conditions" in u or u.startswith("glotouch_backends") for u in used)


@pytest.mark.parametrize("path", sources(*METHOD), ids=lambda p: str(p.relative_to(ROOT)))
def test_the_method_is_not_told_how_objects_are_placed(path: Path) -> None:
    assert set(names_in(path)).isdisjoint({"min_gap_m", "min_wall_gap_m", "draw_stance", "draw_layout"})


@pytest.mark.parametrize("path", sources(*SIMULATOR), ids=lambda p: str(p.relative_to(ROOT)))
def test_the_simulator_reads_no_beliefs(path: Path) -> None:
    modules = [n for n in names_in(path) if n.startswith("glotouch_")]
    assert not [m for m in modules if m.startswith(("glotouch_skills", "glotouch_bt.perception", "glotouch_bt.motion"))]
