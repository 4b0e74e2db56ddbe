"""The target: its mesh, and the model by which it is recognised."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from glotouch_bt import perception
from glotouch_bt.robot import BadInput, Gripper
from glotouch_bt.robot.scene import Mesh, load_folder, load_mesh
from glotouch_bt.skill import Failure

if TYPE_CHECKING:
    from glotouch_bt.perception.recognition import TargetModel

TOO_LOW = Failure("too_low", "the target is lower than the probe and the pads reach", advice="sweep lower")


def load_target(target: str, folder: Path) -> Mesh:
    """Return the target's mesh: `target` is a path to an STL file, or a file's stem in `folder`.

    Raises:
        BadInput: Neither is a usable STL.
    """
    if target.lower().endswith(".stl"):
        return load_mesh(Path(target))
    if not target:
        raise BadInput("the target is an empty name; give an STL file or the name of one in the object folder")
    return load_folder(folder, (target,))[0]


def load_target_model(mesh: Mesh, gripper: Gripper, stance: str) -> TargetModel:
    """Return the target's model for the gripper's pads; it is kept on disk.

    Args:
        mesh: The target.
        gripper: The gripper.
        stance: How the objects stand in the box, as in `ObjectSet`.

    Raises:
        SkillFailed: `too_low`.
    """
    try:
        return perception.model_for(mesh, gripper, stance)
    except perception.TooLow as e:
        raise TOO_LOW(str(e)) from e
