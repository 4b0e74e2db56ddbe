"""Check of every setpoint before it is sent: the vendor's interface accepts NaN without an error."""

from __future__ import annotations

import math
from collections.abc import Sequence

from .faults import CommandRefused
from .messages import ArmLimits, Setpoint

STEP_SLACK = 1.02
"""Implied over allowed joint velocity between two setpoints, for rounding. Source: ours."""
SPEED_SLACK = 1.1
"""Commanded over allowed speed of P. Source: ours, rounding and the end of a profile."""
MAX_TURN_RAD_S = 4.0
"""Largest angular speed of P, also of the arm's own smoothing. Source: ours; planned rotations have at most 2.5
rad/s."""
MAX_START_OFFSET_M = 5e-3
"""Largest distance of the first setpoint from the resting arm (servo error). Source: ours."""
MAX_START_TURN_RAD = 0.05
"""The same for the angle."""
MAX_NORM_ERROR = 1e-3
"""Tolerated error of a quaternion's norm. Source: ours."""


class SetpointCheck:
    """Check setpoints against the limits and against the one before.

    Args:
        limits: Limits of the arm.
        period_s: Time between setpoints.
    """

    def __init__(self, limits: ArmLimits, period_s: float) -> None:
        self._limits, self._period = limits, period_s
        self._q: Sequence[float] = ()
        self._pose: Sequence[float] = ()
        self._fresh = True

    def reset_to(self, q: Sequence[float], pose: Sequence[float]) -> None:
        """Start again from the arm at rest at joints (7,) and TCP pose (7,)."""
        self._q, self._pose, self._fresh = tuple(q), tuple(pose), True

    def check(self, s: Setpoint) -> None:
        """Check a setpoint; if it is valid it becomes the last one.

        Raises:
            CommandRefused: A value breaks a limit.
        """
        limits = self._limits
        for name, values, n in (("q", s.q, 7), ("dq", s.dq, 7), ("pose", s.pose, 7), ("twist", s.twist, 6)):
            if len(values) != n or not all(map(math.isfinite, values)):
                raise CommandRefused(f"setpoint.{name}", list(values), f"{n} finite numbers")
        norm = math.sqrt(sum(v * v for v in s.pose[3:]))
        if abs(norm - 1.0) > MAX_NORM_ERROR:
            raise CommandRefused("setpoint.pose", list(s.pose[3:]), "a unit quaternion (w x y z)")
        reach, turn = (MAX_START_OFFSET_M, MAX_START_TURN_RAD) if self._fresh else (0.0, 0.0)
        for i in range(7):
            q, dq, top = s.q[i], s.dq[i], limits.dq_max[i]
            low, high = limits.q_min[i] - 1e-9, limits.q_max[i] + 1e-9
            if not low <= q <= high:
                raise CommandRefused(f"setpoint.q[joint{i + 1}]", q, f"within {low:.4f} .. {high:.4f} rad")
            if abs(dq) > top:
                raise CommandRefused(f"setpoint.dq[joint{i + 1}]", dq, f"within {-top:.4f} .. {top:.4f} rad/s")
            step = (q - self._q[i]) / self._period
            # After a stop the arm's own controller may have moved the joints within the null space.
            if abs(step) > STEP_SLACK * top and not self._fresh:
                raise CommandRefused(f"setpoint.(q - last q)/period[joint{i + 1}]", step, f"within {top:.4f} rad/s")
        moved = math.dist(s.pose[:3], self._pose[:3])
        allowed = SPEED_SLACK * limits.speed_m_s * self._period + reach
        if moved > allowed:
            raise CommandRefused("setpoint.pose", f"{moved * 1e3:.2f} mm from the last", f"<= {allowed * 1e3:.2f} mm")
        turned, allowed = _angle_rad(s.pose[3:], self._pose[3:]), SPEED_SLACK * MAX_TURN_RAD_S * self._period + turn
        if turned > allowed:
            raise CommandRefused("setpoint.pose", f"{turned:.4f} rad from the last", f"<= {allowed:.4f} rad")
        speed, turning = (math.sqrt(sum(v * v for v in part)) for part in (s.twist[:3], s.twist[3:]))
        if speed > SPEED_SLACK * limits.speed_m_s:
            raise CommandRefused("setpoint.twist", f"{speed:.3f} m/s", f"<= {limits.speed_m_s:g} m/s")
        if turning > SPEED_SLACK * MAX_TURN_RAD_S:
            raise CommandRefused("setpoint.twist", f"{turning:.3f} rad/s", f"<= {MAX_TURN_RAD_S:g} rad/s")
        self._q, self._pose, self._fresh = s.q, s.pose, False


def _angle_rad(a: Sequence[float], b: Sequence[float]) -> float:
    """Return the angle between two rotations given as quaternions."""
    norm = math.hypot(*a) * math.hypot(*b)
    return 2.0 * math.acos(min(1.0, abs(sum(x * y for x, y in zip(a, b, strict=True))) / norm))


def rest_pose(setpoint: Setpoint, acceleration_m_s2: float) -> tuple[float, ...]:
    """Return the pose (7,) at which P comes to rest under a uniform deceleration from a setpoint's twist.

    Linear: v^2 / 2a along v. The rotation stops in the same time (at least 0.02 s for a rotation in place).
    """
    v, w = setpoint.twist[:3], setpoint.twist[3:]
    x, y, z, qw, qx, qy, qz = setpoint.pose
    speed = math.sqrt(sum(a * a for a in v))
    half = 0.5 * max(speed / acceleration_m_s2, 0.02 if any(w) else 0.0)
    ax, ay, az = (
        0.5 * half * a for a in w
    )  # half the angle along the axis: a quaternion's vector part, to first order
    bw = math.sqrt(max(0.0, 1.0 - ax * ax - ay * ay - az * az))
    turned = (
        bw * qw - ax * qx - ay * qy - az * qz,
        bw * qx + ax * qw + ay * qz - az * qy,
        bw * qy - ax * qz + ay * qw + az * qx,
        bw * qz + ax * qy - ay * qx + az * qw,
    )
    half_linear = 0.5 * speed / acceleration_m_s2
    return (x + half_linear * v[0], y + half_linear * v[1], z + half_linear * v[2], *turned)
