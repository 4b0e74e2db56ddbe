"""The axes of the sweep: what is varied alone, over which values, and around which conditions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from glotouch_bt.robot import BadInput, Conditions


@dataclass(frozen=True)
class Axis:
    """One property of objects, gel, gripper or arm.

    Attributes:
        label: For people, with the unit that the levels are shown in.
        fields: Fields of `Conditions` that take the value; a range takes it as both ends.
        levels: Values, SI as in `Conditions`.
        shown: Shown value = level * shown.
    """

    label: str
    fields: tuple[str, ...]
    levels: tuple[float, ...]
    shown: float = 1.0


AXES: Mapping[str, Axis] = {
    "object_scale": Axis("object's scale", ("object_scale",), (0.98, 0.99, 1.0, 1.01, 1.02)),
    "object_offset": Axis("surface offset, mm", ("object_surface_offset_m",), (0.0, 1e-4, 2e-4, 3e-4, 5e-4), 1e3),
    "object_roughness": Axis("roughness, mm", ("object_roughness_m",), (0.0, 1e-4, 2e-4, 3e-4), 1e3),
    "object_lean": Axis("lean, deg", ("object_lean_deg",), (0.0, 1.0, 2.0, 3.0, 5.0, 8.0)),
    "gel_stiffness": Axis("gel's stiffness", ("gel_stiffness_factor",), (0.3, 0.5, 1.0, 2.0, 3.0)),
    "gel_thickness": Axis("gel's thickness", ("gel_thickness_factor",), (0.7, 0.85, 1.0, 1.15, 1.3)),
    "gel_blur": Axis("gel's blur, mm", ("gel_blur_m",), (0.0, 5e-4, 1e-3, 2e-3), 1e3),
    "gel_bulge": Axis("gel's bulge, %", ("gel_bulge_fraction",), (0.0, 0.05, 0.1, 0.2), 100.0),
    "depth_gain": Axis("depth gain", ("tactile_gain",), (0.6, 0.8, 0.9, 1.0, 1.1, 1.3)),
    "depth_error": Axis("smooth depth error, mm", ("tactile_smooth_error_sd_m",), (0.0, 2.5e-5, 5e-5, 1e-4), 1e3),
    "depth_hysteresis": Axis("depth hysteresis, %", ("tactile_hysteresis_fraction",), (0.0, 0.05, 0.1), 100.0),
    "aperture_zero": Axis("jaws' zero, mm", ("aperture_bias_m",), (-1e-3, -5e-4, 0.0, 5e-4, 1e-3), 1e3),
    "finger_flex": Axis("finger flex, mm/N", ("finger_flex_m_per_N",), (0.0, 7e-6, 1.5e-5, 3e-5), 1e3),
    "jaw_backlash": Axis("jaws' backlash, mm", ("jaw_backlash_m",), (0.0, 5e-5, 2e-4), 1e3),
    "jaw_force": Axis("jaw force", ("jaw_force_gain",), (0.7, 0.9, 1.0, 1.1, 1.3)),
    "probe_compliance": Axis(
        "probe's compliance, mm/N", ("probe_compliance_about_m_per_N", "probe_compliance_across_m_per_N"),
        (0.0, 1e-3, 3e-3, 6e-3), 1e3,
    ),
    "kinematic_error": Axis("position error, mm", ("kinematic_error_sd_m",), (0.0, 3e-4, 1e-3), 1e3),
}  # fmt: skip
"""The axes by name, with levels around and beyond those of `realistic`; none that acts on motions alone."""


def changed(base: str, axis: str, level: float) -> str:
    """Return the name of conditions (see `load_conditions`) with one axis at one level.

    Raises:
        BadInput: No such axis.
    """
    if axis not in AXES:
        raise BadInput(f"--axis {axis}: must be among {', '.join(AXES)}")
    default = Conditions(name="")
    ranged = {f: isinstance(getattr(default, f), tuple) for f in AXES[axis].fields}
    return "+".join([base, *(f"{f}={level},{level}" if ranged[f] else f"{f}={level}" for f in ranged)])
