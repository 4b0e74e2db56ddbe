"""Can probe and jaws feel and hold an object at all? The words are those in which a skill and a check refuse it."""

from __future__ import annotations

from glotouch_bt.perception.model_cache import target_model
from glotouch_bt.perception.recognition.model import PadSpec, TargetModel
from glotouch_bt.perception.sides import model_with_sides
from glotouch_bt.robot import BadInput, Gripper, ParamError
from glotouch_bt.robot.scene import Mesh


class TooLow(BadInput):
    """An object is lower than the probe and the pads reach."""


def pads_of(gripper: Gripper) -> PadSpec:
    """Return the pads of a gripper."""
    return PadSpec(gripper.pad_window_m, gripper.pad_shape, gripper.pad_depth_m)


def model_for(mesh: Mesh, gripper: Gripper, stance: str | None = None) -> TargetModel:
    """Return an object's model for the pads of a gripper; it is kept on disk.

    Args:
        mesh: The object.
        gripper: The gripper.
        stance: How the objects stand in the box, as in `ObjectSet`; the model then has a hypothesis for each side.
            None: as in its file only.

    Raises:
        TooLow: The object is lower than the probe and the pads reach.
    """
    pads = pads_of(gripper)
    try:
        return target_model(mesh, pads) if stance is None else model_with_sides(mesh, pads, stance)
    except ParamError as e:
        raise TooLow(
            f"{mesh.name} cannot be felt: it is {mesh.extents_m[2] * 1e3:.1f} mm high and must be {e.rule}"
        ) from e


def too_wide(model: TargetModel, gripper: Gripper) -> str:
    """Return by how much an object is too wide for the jaws at every yaw and height, or empty if it fits somewhere."""
    narrowest_m = min(h.model.narrowest_m for h in model.hypotheses)
    if narrowest_m <= gripper.stroke_m:
        return ""
    return (
        f"{model.name} is {narrowest_m * 1e3:.0f} mm across at its narrowest and the jaws open "
        f"{gripper.stroke_m * 1e3:.0f} mm"
    )
