"""A robot by the name of a shipped one or by the path of its YAML file."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from glotouch_bt.robot import RobotDescription, UnknownName, read_robot

FOLDER = Path(__file__).parent
SUFFIXES = (".yaml", ".yml")


def shipped_robots() -> dict[str, Path]:
    """Return the files of the shipped robots by name."""
    return {path.stem: path for path in sorted(FOLDER.glob("*.yaml"))}


def load_robot(given: str) -> RobotDescription:
    """Load a robot.

    Args:
        given: Name of a shipped robot, or path of a robot's YAML file.

    Raises:
        UnknownName: There is no such robot; lists those that ship.
        BadInput: As `read_robot`.
    """
    if given.endswith(SUFFIXES):
        return read_robot(Path(given))
    shipped = shipped_robots()
    if given not in shipped:
        raise UnknownName("robot", given, [*shipped, "FILE.yaml"])
    return _read_shipped(shipped[given])


_read_shipped = cache(read_robot)
