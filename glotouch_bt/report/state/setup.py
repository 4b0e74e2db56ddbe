"""The unchanging part of a run, from its recorded description: robot, container, probe, meshes of the objects."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np

from glotouch_bt.mission import node_paths
from glotouch_bt.mission.read import shipped_root
from glotouch_bt.report.run_record import RunRecord
from glotouch_bt.report.state.model import DEFAULT_PAD_WINDOW_M
from glotouch_bt.robot import Array, BadInput, Container, Holder, Pose, Probe, RobotDescription
from glotouch_bt.robot.scene import Mesh, load_mesh, stl_files

T = TypeVar("T")
SHIPPED = "glotouch_missions"
"""Name of the shipped folder in a record."""


@dataclass(frozen=True)
class RunSetup:
    """The unchanging part of a run; a part that its record lacks is None and is not drawn.

    Attributes:
        pose_B_K: The registered container frame in B.
        description: The robot.
        container, holder, probe: The nominal world.
        window_m: Size of a pad along x_P and z_P.
        objects: Folder of the STL files of its objects, if it is known here.
    """

    pose_B_K: Pose
    description: RobotDescription | None = None
    container: Container | None = None
    holder: Holder | None = None
    probe: Probe | None = None
    window_m: tuple[float, float] = DEFAULT_PAD_WINDOW_M
    objects: Path | None = None

    @cached_property
    def _files(self) -> dict[str, Path]:
        try:
            return {} if self.objects is None else stl_files(self.objects)
        except (BadInput, OSError):
            return {}

    def mesh(self, name: str) -> Mesh | None:
        """Return the mesh of an object; None if its file is unknown or unusable."""
        try:
            return load_mesh(self._files[name]) if name in self._files else None
        except (BadInput, OSError):
            return None


def read_setup(record: RunRecord, objects: Path | None = None) -> RunSetup:
    """Return the unchanging part of a run.

    Args:
        record: Its record; only the description is used.
        objects: Folder of the STL files, instead of the recorded one.
    """
    description = _part(record.of_run("robot", "description"), RobotDescription)
    return RunSetup(
        pose_B_K=record.pose_B_K or Pose(np.zeros(3)),
        description=description,
        container=_part(record.run.get("container"), Container),
        holder=_part(record.run.get("holder"), Holder),
        probe=_part(record.run.get("probe"), Probe),
        window_m=DEFAULT_PAD_WINDOW_M if description is None else description.gripper.pad_window_m,
        objects=objects or _shipped(record.of_run("objects", "folder")),
    )


def planned_nodes(folder: Path) -> list[str]:
    """Return the paths of all nodes of a run's mission, parents first; none if its mission.yaml cannot be loaded."""
    try:
        return node_paths(folder / "mission.yaml")
    except BadInput:
        return []


def _part(value: Any, kind: type[T]) -> T | None:
    """Return a recorded dataclass, or None if it is missing or of another version."""
    try:
        return msgspec.convert(value, kind, dec_hook=_array, strict=False)
    except (BadInput, ValueError, TypeError, msgspec.ValidationError):
        return None


def _array(_: object, value: Any) -> Array:
    return np.asarray(value, dtype=np.float64)


def _shipped(folder: Any) -> Path | None:
    """Return a shipped folder of objects by its recorded name; a run's folder names no other path of this machine."""
    if not isinstance(folder, str) or not folder.startswith(f"{SHIPPED}/"):
        return None
    root = shipped_root()
    found = (root / folder.removeprefix(f"{SHIPPED}/")).resolve()
    return found if found.is_relative_to(root) and found.is_dir() else None
