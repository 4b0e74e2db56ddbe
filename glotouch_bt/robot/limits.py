"""Frozen limits, each with its source. The backend enforces the hard ones below the skill layer."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from glotouch_bt.robot.errors import ParamError


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Robot-wide limits.

    Joint position, velocity and torque limits are in `description.Joint`, next to the kinematics they belong to.

    Attributes:
        hard_force_N: Norm of the tared contact force at which the robot itself stops. Source: 30 N is what public code
            for a Rizon 4 with a Xense gripper sets as its maximum contact wrench.
        hard_torque_Nm: Norm of the tared torque at S that stops the robot: the force limit on the probe's 0.34 m lever.
        tcp_speed_m_s: Largest commanded speed of P. Source: vendor motion-force default 0.5 m/s, halved for blind work.
        tcp_acceleration_m_s2: Largest commanded acceleration of P (vendor default 2.0).
        tcp_jerk_m_s3: Largest commanded jerk of P.
        stop_acceleration_m_s2: Deceleration of a guarded stop (measured: 2 m/s2 moves an object 1.1 mm p95 at 40 mm/s).
        stop_jerk_m_s3: Jerk of a guarded stop: full deceleration within 2 ms. At 200 m/s3 fingers that met an object at
            20 mm/s pressed past the hard limit.
        max_age_s: A reading older than this is stale.
    """

    hard_force_N: float = 30.0
    hard_torque_Nm: float = 10.2
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
