"""Guard of the commands: nothing that is not finite, out of range or a jump is sent."""

from __future__ import annotations

import math

import numpy as np

from glotouch_bt.robot.command import Command, GripperTarget, JointSetpoint
from glotouch_bt.robot.interface import Robot
from glotouch_bt.robot.observation import Observation
from glotouch_bt.robot.supervision.limits import GuardFinding, SupervisionLimits

MAX_ACCELERATION_RAD_S2 = 1e3
"""Refuse a larger feed-forward acceleration: it would take a joint to full speed within two samples. Source: ours."""
ROUNDING = 1e-9
"""Rounding allowed at the ends of a range, in the unit of the value."""


class CommandGuard:
    """Check every command before it is sent.

    Args:
        robot: The guarded robot.
        guard_limits: Limits of the guards.
        first: The newest block.
    """

    def __init__(self, robot: Robot, guard_limits: SupervisionLimits, first: Observation) -> None:
        self._joints, self._hand = robot.description.joints, robot.description.gripper
        self._period_s, self._speed_m_s = robot.period_s, robot.limits.tcp_speed_m_s
        self._start_rad = guard_limits.start_rad
        # lower, upper, largest speed, largest step in a period
        self._ranges = [
            (j.lower_rad - ROUNDING, j.upper_rad + ROUNDING, fastest, fastest * robot.period_s)
            for j in self._joints
            for fastest in (guard_limits.command_slack * j.velocity_rad_s,)
        ]
        self._max_step_2 = (guard_limits.command_slack * self._speed_m_s * robot.period_s) ** 2
        self.reset(first)

    def reset(self, newest: Observation) -> None:
        """Let the next setpoint begin where the robot is now."""
        self._q: list[float] = newest.q[-1].tolist()
        self._P: list[float] | None = None
        self._moving = False

    def check(self, command: Command, newest: Observation) -> GuardFinding | None:
        """Return the first finding about a command, or None; `newest` is the last block."""
        target, motion = command.gripper, command.motion
        if target is not None and (wrong := self._check_jaws(target, newest)) is not None:
            return wrong
        if motion is None:
            if self._moving:  # the robot brakes by itself: the next setpoint is compared with where it stands then
                self._moving, self._P = False, None
            return None
        before, spare = (newest.q[-1].tolist(), self._start_rad) if self._P is None else (self._q, 0.0)
        try:
            asked, P = motion.q.tolist(), motion.pose_B_P.position_m.tolist()
            for q, dq, ddq, last, (low, high, fastest, step) in zip(
                asked, motion.dq.tolist(), motion.ddq.tolist(), before, self._ranges, strict=True
            ):
                if not (
                    low <= q <= high
                    and -fastest <= dq <= fastest
                    and -MAX_ACCELERATION_RAD_S2 <= ddq <= MAX_ACCELERATION_RAD_S2
                    and abs(q - last) <= step + spare
                ):
                    return self._explain_setpoint(motion, before, spare, newest)
            x, y, z = P
        except (ValueError, TypeError, AttributeError):
            count = len(self._ranges)
            return self._finding(f"a setpoint that is not {count} numbers a quantity", math.nan, 0.0, newest)
        if self._P is not None:
            a, b, c = self._P
            way_2 = (x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2
            if not way_2 <= self._max_step_2:
                speed = math.sqrt(way_2) / self._period_s
                return self._finding(
                    f"P would move at {speed:.3f} m/s; {self._speed_m_s:.3f} m/s are allowed",
                    speed,
                    self._speed_m_s,
                    newest,
                )
        self._q, self._P, self._moving = asked, P, bool(np.count_nonzero(motion.dq))
        return None

    def _explain_setpoint(
        self, motion: JointSetpoint, before: list[float], spare: float, newest: Observation
    ) -> GuardFinding:
        """Report the first value out of range; after a hold, a setpoint may begin within `start_rad` of the arm."""
        q, dq, ddq = (np.asarray(v, dtype=np.float64) for v in (motion.q, motion.dq, motion.ddq))
        low, high, fastest, step = np.array(self._ranges).T
        greatest = np.full(len(q), MAX_ACCELERATION_RAD_S2)
        quantities = (
            ("q", "rad", q, low, high),
            ("dq", "rad/s", dq, -fastest, fastest),
            ("ddq", "rad/s2", ddq, -greatest, greatest),
            ("the step", "rad", q - before, -step - spare, step + spare),
        )
        name, unit, value, least, most = next(x for x in quantities if not np.all((x[3] <= x[2]) & (x[2] <= x[4])))
        i = int(np.argmin((least <= value) & (value <= most)))
        valid = f"{least[i]:.4f}..{most[i]:.4f} {unit}"
        what = f"{name} of {self._joints[i].name} would be {value[i]:.4g} {unit}; valid: {valid}"
        return self._finding(what, float(value[i]), float(most[i] if value[i] > most[i] else least[i]), newest)

    def _check_jaws(self, target: GripperTarget, newest: Observation) -> GuardFinding | None:
        hand = self._hand
        for name, value, low, high in (
            ("aperture_m", target.aperture_m, 0.0, hand.stroke_m),
            ("speed_m_s", target.speed_m_s, 0.0, hand.speed_m_s),
            ("force_N", target.force_N, 0.0, hand.force_N),
        ):
            if not low - ROUNDING <= value <= high + ROUNDING:
                what = f"the jaws' {name} would be {value:.4g}; valid: {low:g}..{high:g}"
                return self._finding(what, float(value), high, newest)
        return None

    @staticmethod
    def _finding(what: str, value: float, limit: float, newest: Observation) -> GuardFinding:
        return GuardFinding("command", what, value, limit, newest.now_s)
