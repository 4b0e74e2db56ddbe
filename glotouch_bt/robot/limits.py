"""Robot-wide limits, each with its source. The backend enforces the hard ones below the skills."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from glotouch_bt.errors import ParamError


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Robot-wide limits.

    Joint position, velocity and torque limits are in `description.Joint`, next to the kinematics they belong to.

    Attributes:
        hard_force_N: Norm of the contact force that the true peak must not pass. Source: the maximum contact wrench
            that public code sets for a Rizon 4 with a Xense gripper.
        hard_torque_Nm: The same for the torque at S. Source: the force limit on the probe's 0.34 m lever.
        stop_share: Share of both at which the robot stops itself. Source: ours; above the 27.5 N with which a probe
            that slipped snags on its way back.
        stop_ahead_s: The robot also stops if a hand that presses on would pass that share within this time. Source:
            measured; three samples to see it and 5 ms to stop 0.1 m/s.
        tcp_speed_m_s: Largest commanded speed of P. Source: vendor default of motion-force mode, 0.5 m/s, halved.
        tcp_acceleration_m_s2: Largest commanded acceleration of P. Source: vendor default 2.0, halved.
        tcp_jerk_m_s3: Largest commanded jerk of P. Source: ours.
        stop_acceleration_m_s2: Deceleration of a guarded stop. Source: measured; at 40 mm/s an object moves 1.1 mm
            (p95).
        stop_jerk_m_s3: Jerk of a guarded stop. Source: measured; full deceleration after 2 ms. At 200 m/s3, fingers
            that met an object at 20 mm/s exceeded the hard force limit.
        max_age_s: A reading older than this is stale. Source: ours.
    """

    hard_force_N: float = 30.0
    hard_torque_Nm: float = 10.2
    stop_share: float = 0.95
    stop_ahead_s: float = 0.008
    tcp_speed_m_s: float = 0.25
    tcp_acceleration_m_s2: float = 1.0
    tcp_jerk_m_s3: float = 20.0
    stop_acceleration_m_s2: float = 2.0
    stop_jerk_m_s3: float = 1000.0
    max_age_s: float = 0.2

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            if not (math.isfinite(value) and value > 0):
                raise ParamError(f.name, value, "finite and positive")
        if self.stop_share > 1.0:
            raise ParamError("stop_share", self.stop_share, "at most 1")

    @property
    def stop_force_N(self) -> float:
        """Contact force at which the robot stops itself."""
        return self.stop_share * self.hard_force_N

    @property
    def stop_torque_Nm(self) -> float:
        """Torque at which the robot stops itself."""
        return self.stop_share * self.hard_torque_Nm
