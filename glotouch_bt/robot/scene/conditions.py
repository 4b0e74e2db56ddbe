"""The disturbances of a trial, drawn from its seed.

"sd" is one standard deviation; a pair is a uniform range. All zero is `ideal`. The profiles are in
glotouch_missions/conditions/*.yaml; their keys are these field names. The profiles state the source of each value.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from glotouch_bt.errors import ParamError

Range = tuple[float, float]
POSITIVE = (
    *("object_mass_kg", "object_friction", "pad_friction", "object_scale", "gel_stiffness_factor"),
    *(
        "gel_thickness_factor",
        "tactile_gain",
        "image_light_gain",
        "jaw_force_gain",
        "contact_softness_s",
        "housing_softness_s",
    ),
)
"""Ranges of positive numbers."""


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """One disturbance profile; each field name ends with its unit, or the field has none.

    The fields from `object_scale` on are axes: each says what it alters, has no effect by default, and is an error if
    a run uses its sensor and nothing is altered.

    Attributes:
        object_scale: True size of an object over that of its STL.
        object_surface_offset_m: Distance of the true surface outside that of the STL.
        object_roughness_m: Roughness (RMS) of the surface that the pads touch, correlated over 2 mm.
        object_lean_deg: Lean of a standing object, because its base is not flat.
        object_com_sd_m: Distance of the centre of mass from that of a uniform solid, along each axis.
        gel_stiffness_factor, gel_thickness_factor: True gel over the nominal one of the gel model.
        gel_blur_m: Width (sd) of the Gaussian by which the membrane extends a contact.
        gel_bulge_fraction: Height of the gel's bulge around a contact over the contact's depth.
        tactile_gain: Shown over true depth.
        tactile_smooth_error_sd_m: Smooth error of a depth map, correlated over 5 mm.
        tactile_hysteresis_fraction: Share of the lost depth that is still shown when the gel is unloaded.
        tactile_shear_m_per_N: Shift of a pad's surface under a tangential force.
        image_blur_m: Width (sd) of the Gaussian to which a gel image resolves the gel's surface.
        image_light_gain: Brightness of each of a gel's three lights over the nominal one.
        image_noise_sd: White noise of a gel image over its full scale.
        finger_flex_m_per_N: Outward motion of each fingertip under the closing force, unknown to the aperture sensor.
        jaw_force_gain, jaw_force_offset_N: True closing force = gain x reported force + offset.
        jaw_backlash_m: Play between aperture sensor and pads.
        probe_compliance_about_m_per_N: Deflection of the held probe's ball along x_P: rotation about the jaws' axis.
        probe_compliance_across_m_per_N: The same along y_P, the jaws' closing direction.
        wrench_gain_sd: Gain error of each axis of the wrist sensor.
        wrench_cross_talk_sd: Reading of an axis, over its range, when the other five have that share of theirs.
        torque_drift_Nm_per_sqrt_min: Random walk of each torque.
        kinematic_error_sd_m: Error of the reported position of P, smooth over the workspace.
        following_error_s: Lag of the arm behind its setpoints.
        floor_tilt_sd_deg: Tilt of the container about x_K and about y_K.
        latency_jitter_s: Largest deviation of the latencies of wrench and tactile frames.
        contact_softness_s: Time constant of contacts of probe and container; that of objects is twice as long.
        housing_softness_s: Time constant of contacts of arm, housing and fingers.
    """

    name: str = "ideal"
    force_noise_sd_N: float = 0.0
    torque_noise_sd_Nm: float = 0.0
    force_drift_N_per_sqrt_min: float = 0.0
    wrench_latency_s: float = 0.0
    payload_mass_error: float = 0.0
    payload_com_error_m: float = 0.0
    tip_offset_sd_m: float = 0.0
    tip_tilt_sd_deg: float = 0.0
    registration_sd_m: float = 0.0
    registration_sd_deg: float = 0.0
    aperture_noise_sd_m: float = 0.0
    aperture_bias_m: Range = (0.0, 0.0)
    aperture_resolution_m: float = 1e-5
    gripper_latency_s: float = 0.0
    tactile_noise_sd_m: float = 0.0
    tactile_offset_m: Range = (0.0, 0.0)
    tactile_dead_fraction: float = 0.0
    tactile_rate_Hz: float = 60.0
    tactile_latency_s: float = 0.0
    object_mass_kg: Range = (0.25, 0.25)
    object_friction: Range = (0.6, 0.6)
    pad_friction: Range = (1.0, 1.0)
    object_scale: Range = (1.0, 1.0)
    object_surface_offset_m: Range = (0.0, 0.0)
    object_roughness_m: float = 0.0
    object_lean_deg: Range = (0.0, 0.0)
    object_com_sd_m: float = 0.0
    gel_stiffness_factor: Range = (1.0, 1.0)
    gel_thickness_factor: Range = (1.0, 1.0)
    gel_blur_m: float = 0.0
    gel_bulge_fraction: float = 0.0
    tactile_gain: Range = (1.0, 1.0)
    tactile_smooth_error_sd_m: float = 0.0
    tactile_hysteresis_fraction: float = 0.0
    tactile_shear_m_per_N: float = 0.0
    image_blur_m: float = 0.0
    image_light_gain: Range = (1.0, 1.0)
    image_noise_sd: float = 0.0
    finger_flex_m_per_N: float = 0.0
    jaw_force_gain: Range = (1.0, 1.0)
    jaw_force_offset_N: Range = (0.0, 0.0)
    jaw_backlash_m: float = 0.0
    probe_compliance_about_m_per_N: Range = (0.0, 0.0)
    probe_compliance_across_m_per_N: Range = (0.0, 0.0)
    wrench_gain_sd: float = 0.0
    wrench_cross_talk_sd: float = 0.0
    torque_drift_Nm_per_sqrt_min: float = 0.0
    kinematic_error_sd_m: float = 0.0
    following_error_s: float = 0.0
    floor_tilt_sd_deg: float = 0.0
    latency_jitter_s: float = 0.0
    contact_softness_s: Range = (0.004, 0.004)
    housing_softness_s: Range = (0.050, 0.050)

    def __post_init__(self) -> None:
        for f in fields(self):
            if f.name == "name":
                continue
            value, ranged = getattr(self, f.name), isinstance(f.default, tuple)
            if isinstance(value, tuple) and not ranged:
                raise ParamError(f"conditions.{f.name}", value, "one number, not a range")
            if ranged and not isinstance(value, tuple):
                value = (value, value)
                object.__setattr__(self, f.name, value)
            lo, hi = value if ranged else (0.0, value)
            if not (math.isfinite(lo) and math.isfinite(hi) and lo <= hi):
                valid = "finite, and a range is (low, high)" if ranged else "finite and not negative"
                raise ParamError(f"conditions.{f.name}", value, valid)
        for name in POSITIVE:
            if getattr(self, name)[0] <= 0:
                raise ParamError(f"conditions.{name}", getattr(self, name), "positive")
        for name in ("probe_compliance_about_m_per_N", "probe_compliance_across_m_per_N"):
            if getattr(self, name)[0] < 0:
                raise ParamError(f"conditions.{name}", getattr(self, name), "zero or more")
        if self.tactile_rate_Hz <= 0:
            raise ParamError("conditions.tactile_rate_Hz", self.tactile_rate_Hz, "positive")

    def axes_set(self) -> frozenset[str]:
        """Return the axes that have an effect: those that differ from their defaults."""
        defaults = {f.name: f.default for f in fields(self)}
        return frozenset(name for name in AXES if getattr(self, name) != defaults[name])


_NAMES = tuple(f.name for f in fields(Conditions))
AXES = _NAMES[_NAMES.index("object_scale") :]
"""Fields that have no effect by default and whose effect each run proves."""
