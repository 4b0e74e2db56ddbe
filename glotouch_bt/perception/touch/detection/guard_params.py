"""Thresholds of the contact guard and of the hard stop."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from glotouch_bt.robot import ParamError


@dataclass(frozen=True, kw_only=True)
class GuardParams:
    """Thresholds of the contact guard and of the hard stop.

    Attributes:
        directional_N: Minimum tip force opposing the motion. Source: three times the residual of free motion at
            0.5 m/s2 after inertia compensation (0.05 N in simulation); see `bench detection`.
        total_N: Minimum norm of the tip force. Source: as above.
        sustained_N: The same two thresholds for a force that lasts. Source: ours; in 10 minutes of `bench detection
            --conditions nominal --seed 2400`, 0.06 N gave 3 false contacts and 0.09 N none.
        moment_Nm: Moment at the sensor that may replace the total force: `total_N` on a 0.34 m lever.
        consecutive: Number of consecutive samples. Source: 3 at 1 kHz, a tenth of the filter's rise time.
        sigmas: Minimum of every threshold, in standard deviations of the filtered estimate in its direction. Source:
            `bench detection`, harsh, downward moves with a latency error of 5 ms: 12 false alarms an hour at 5.5, a few
            at 6.5; none elsewhere in two hours each.
        cutoff_Hz, rate_Hz: Low-pass and sampling rate. Source: 15-60 Hz change the result by < 0.2 mm.
        sustained_Hz: Low-pass of the force that lasts. Source: ours; 45 ms of delay, 1.5 mm at 30 mm/s.
        latency_s: Age of a wrench sample on arrival. Source: the wrist sensor's declared latency.
        hard_force_N, hard_torque_Nm: Absolute limits of the tared wrench. Source: `robot.Limits`.
        hard_residual_N, hard_residual_Nm: Limits of the wrench minus its baseline. Source: slip of the grasped probe
            (12.8 N measured at 60 N grip); the torque on the same lever.
    """

    directional_N: float = 0.15
    total_N: float = 0.15
    sustained_N: float = 0.09
    moment_Nm: float = 0.05
    consecutive: int = 3
    sigmas: float = 6.5
    cutoff_Hz: float = 30.0
    sustained_Hz: float = 5.0
    rate_Hz: float = 1000.0
    latency_s: float = 0.003
    hard_force_N: float = 30.0
    hard_torque_Nm: float = 10.2
    hard_residual_N: float = 20.0
    hard_residual_Nm: float = 6.8

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            least = 0.0 if f.name == "latency_s" else math.ulp(0.0)
            if not (math.isfinite(value) and value >= least):
                raise ParamError(f.name, value, "finite and positive (latency_s may be 0)")
        if self.consecutive != int(self.consecutive) or self.consecutive < 1:
            raise ParamError("consecutive", self.consecutive, "a whole number >= 1")
        if max(self.directional_N, self.total_N) >= min(self.hard_force_N, self.hard_residual_N):
            raise ParamError("directional_N, total_N", max(self.directional_N, self.total_N), "below the hard limits")
        if self.cutoff_Hz >= 0.5 * self.rate_Hz:
            raise ParamError("cutoff_Hz", self.cutoff_Hz, "below half of rate_Hz")
