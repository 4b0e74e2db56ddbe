"""The simulated sensors' parameters and the recogniser's beliefs are separate: neither reads the other."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

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


def test_the_method_reads_no_conditions_and_is_not_told_how_objects_are_placed() -> None:
    """Neither the class, nor a profile, nor an axis by name, nor a module of the simulated sensors."""
    conditions = {"Conditions", "load_conditions", "conditions_of", *AXES}
    placing = {"min_gap_m", "min_wall_gap_m", "draw_stance", "draw_layout"}
    for path in sources(*METHOD):
        used = set(names_in(path))
        assert used.isdisjoint(conditions | placing), path
        assert not any("glotouch_missions/conditions" in u or u.startswith("glotouch_backends") for u in used), path


def test_the_simulator_reads_no_beliefs() -> None:
    beliefs = ("glotouch_skills", "glotouch_bt.perception", "glotouch_bt.motion")
    for path in sources(*SIMULATOR):
        assert not [n for n in names_in(path) if n.startswith(beliefs)], path
