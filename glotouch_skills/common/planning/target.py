"""The target: the model by which it is recognised, and its mesh or what was felt of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from glotouch_bt import perception
from glotouch_bt.perception import recognition
from glotouch_bt.robot import BadInput, Gripper
from glotouch_bt.robot.scene import Mesh, ObjectSet, Quat, load_folder, load_mesh, standing, twins_of
from glotouch_bt.skill import Failure

if TYPE_CHECKING:
    from glotouch_bt.perception.recognition import TargetModel, TouchedObject

TOO_LOW = Failure("too_low", "the target is lower than the probe and the pads reach", advice="sweep lower")
FILLED = (0.1, 1.5)
"""Least and largest volume of an object known only by touch, relative to its outline times its height. Source: ours; it
may be hollow, or wider above the outline."""


@dataclass(frozen=True, eq=False)
class SoughtObject:
    """The object to find.

    Attributes:
        name: Its name.
        model: Its model, with a hypothesis for each side on which it may stand.
        solid: Its mesh as in its file, or what was felt of it.
        volume_m3: Least and largest volume; equal if it has a mesh.
        twins: Other objects of the world whose files have the same shape.
    """

    name: str
    model: TargetModel
    solid: Mesh | TouchedObject
    volume_m3: tuple[float, float]
    twins: tuple[str, ...] = ()

    def standing(self, quat: Quat) -> Mesh | TouchedObject:
        """Return the mesh turned onto one of its sides, or what was felt."""
        return standing(self.solid, quat) if isinstance(self.solid, Mesh) else self.solid


def find_target(target: str, objects: ObjectSet, gripper: Gripper) -> SoughtObject:
    """Return the target: an STL file, an object of the world's folder, or `touched:NAME`.

    Args:
        target: As a mission names it.
        objects: The objects of the world.
        gripper: The gripper, whose pads touch.

    Raises:
        BadInput: It cannot be read.
        SkillFailed: `too_low`.
    """
    if name := perception.touched_name(target):
        return _touched(perception.read_touched(name), gripper)
    mesh = load_target(target, objects.folder)
    volume = float(mesh.as_trimesh().volume)
    model = load_target_model(mesh, gripper, objects.stance)
    return SoughtObject(mesh.name, model, mesh, (volume, volume), twins_of(target, objects))


def _touched(felt: TouchedObject, gripper: Gripper) -> SoughtObject:
    model = recognition.touched_model(felt, perception.pads_of(gripper))
    long, short = model.outline.likely.size_m
    smallest_m3, largest_m3 = (share * long * short * felt.height_m for share in FILLED)
    return SoughtObject(felt.name, model, felt, (smallest_m3, largest_m3))


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
