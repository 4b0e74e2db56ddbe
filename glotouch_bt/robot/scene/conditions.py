"""The disturbances of a trial, drawn from its seed.

"sd" is one standard deviation; a pair is a uniform range. All zero is `ideal`. The profiles are in
glotouch_missions/conditions/*.yaml; their keys are these field names.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from glotouch_bt.errors import ParamError

Range = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """One disturbance profile; each field name ends with its unit."""

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

    def __post_init__(self) -> None:
        for f in fields(self):
            if f.name == "name":
                continue
            value = getattr(self, f.name)
            lo, hi = value if isinstance(value, tuple) else (0.0, value)
            if not (math.isfinite(lo) and math.isfinite(hi) and lo <= hi):
                raise ParamError(f"conditions.{f.name}", value, "finite, and a range must be (low, high)")
        for name in ("object_mass_kg", "object_friction", "pad_friction"):
            if getattr(self, name)[0] <= 0:
                raise ParamError(f"conditions.{name}", getattr(self, name), "positive")
        if self.tactile_rate_Hz <= 0:
            raise ParamError("conditions.tactile_rate_Hz", self.tactile_rate_Hz, "positive")
