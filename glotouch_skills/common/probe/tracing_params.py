"""Parameters common to the skills that trace outlines."""

from __future__ import annotations

from glotouch_bt.perception.search import TraceParams
from glotouch_bt.skill import SkillParams, param
from glotouch_skills.common.probe.plan_driver import ExploringSpeeds


class TracingParams(SkillParams):
    """Base of the parameters of `orbit_probe` and `refine_outline`."""

    clearance_m: float = param("Ball to outline while going round", unit="m", default=0.003, ge=0.002, le=0.03)
    centre_sd_m: float = param(
        "Enough is known when the centre's standard deviation is below this", unit="m", default=0.0010, gt=0.0, le=0.02
    )
    radial_sd_m: float = param(
        "... and the outline's, in every direction, below this", unit="m", default=0.004, gt=0.0, le=0.03
    )
    min_contacts: int = param("Fewest contacts, whatever the covariance says", default=4, ge=3, le=60)
    max_contacts: int = param("Most contacts in all", default=14, ge=3, le=60)
    orbit_speed_m_s: float = param("Speed beside the object", unit="m/s", default=0.05, gt=0.0, le=0.08)
    probe_speed_m_s: float = param("Probing speed", unit="m/s", default=0.02, gt=0.0, le=0.06)
    lower_speed_m_s: float = param("Speed down beside it", unit="m/s", default=0.02, gt=0.0, le=0.06)
    height_m: float = param("Ball centre above the floor while tracing", unit="m", default=0.018, ge=0.009, le=0.06)

    def rule(self) -> TraceParams:
        """Return them as the trace plan takes them."""
        shared = {"clearance_m", "centre_sd_m", "radial_sd_m", "min_contacts", "max_contacts"}
        return TraceParams(**self.model_dump(include=shared))

    def speeds(self) -> ExploringSpeeds:
        """Return them as the plan driver takes them."""
        return ExploringSpeeds(
            step_m_s=self.orbit_speed_m_s,
            probe_m_s=self.probe_speed_m_s,
            lower_m_s=self.lower_speed_m_s,
            height_m=self.height_m,
        )
