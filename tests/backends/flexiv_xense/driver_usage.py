"""Uses of the vendors' modules in the driver's source: every attribute, call and keyword.

A name below stands for an object of a vendor's class wherever it appears in the driver's adapter files.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import glotouch_backends.flexiv_xense.driver as driver

FOLDER = Path(driver.__file__).parent / "devices"
ARM = {
    "self.robot": "Robot",
    "robot": "Robot",
    "self._tools": "Tool",
    "self.rdk": "",
    "rdk": "",
    "params": "ToolParams",
    "s": "RobotStates",
    "e": "RobotEvent",
    "i": "RobotInfo",
    "self.info": "RobotInfo",
    "command": "NrtCartesianCmd",
}
PADS = {"sdk": "", "sensor": "Sensor", "self._sensors": "Sensor"}
GRIPPER = {"sdk": "", "self._device": "XenseTCPGripper"}
FILES = {
    "arm.py": ARM,
    "arm_19.py": ARM,
    "arm_20.py": ARM,
    "connect.py": {"rdk": "", "robot": "Robot"},
    "pads.py": PADS,
    "gripper.py": GRIPPER,
}


@dataclass(frozen=True)
class Use:
    """One use of a vendor's name.

    Attributes:
        where: File and line.
        path: Dotted name in the vendor's module, e.g. ("Robot", "SwitchMode").
        called: True if it is called.
        positional: Number of positional arguments of the call; None if one is starred.
        keywords: Keyword arguments of the call.
    """

    where: str
    path: tuple[str, ...]
    called: bool = False
    positional: int | None = 0
    keywords: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Dotted name."""
        return ".".join(self.path)


def _dotted(node: ast.expr) -> tuple[str, ...] | None:
    """("self", "rdk", "Mode") of self.rdk.Mode; indexing is looked through."""
    if isinstance(node, ast.Subscript):
        return _dotted(node.value)
    if isinstance(node, ast.Name):
        return (node.id,)
    if isinstance(node, ast.Attribute):
        inner = _dotted(node.value)
        return None if inner is None else (*inner, node.attr)
    return None


def _resolve(node: ast.expr, roots: dict[str, str]) -> tuple[str, ...] | None:
    """The vendor's path of an expression, if it starts at one of the roots and goes on."""
    parts = _dotted(node)
    if parts is None:
        return None
    for length in (2, 1):
        root = ".".join(parts[:length])
        if len(parts) > length and root in roots:
            return (*([roots[root]] if roots[root] else []), *parts[length:])
    return None


def uses(*files: str) -> Iterator[Use]:
    """Yield all uses in these files of the driver."""
    for name in files:
        tree = ast.parse((FOLDER / name).read_text())
        inner: set[int] = set()
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and (path := _resolve(node.func, FILES[name])) is not None:
                inner.add(id(node.func))
                starred = any(isinstance(a, ast.Starred) for a in node.args)
                keywords = tuple(k.arg for k in node.keywords if k.arg is not None)
                yield Use(f"{name}:{node.lineno}", path, True, None if starred else len(node.args), keywords)
            elif isinstance(node, ast.Attribute) and id(node) not in inner:
                path = _resolve(node, FILES[name])
                if path is not None:
                    yield Use(f"{name}:{node.lineno}", path)
