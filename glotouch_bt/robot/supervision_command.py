"""The guard of what is commanded: nothing that is not finite, out of range or a jump is ever sent."""

from __future__ import annotations

import math

import numpy as np

from glotouch_bt.robot.command import Command, GripperTarget, JointSetpoint
from glotouch_bt.robot.description import RobotDescription
from glotouch_bt.robot.geometry import Array
from glotouch_bt.robot.limits import Limits
from glotouch_bt.robot.observation import Observation
from glotouch_bt.robot.supervision_limits import Finding, SupervisionLimits

GREATEST_RAD_S2 = 1e3
"""A feed-forward acceleration beyond this is a mistake: it would take a joint to full speed within a sample or two."""
ROUND = 1e-9


class CommandWatch:
    """Looks at every command before it is sent.

    Args:
        description, limits, period_s: The robot's.
        rules: What is tolerated.
        first: Where the robot is.
    """

    def __init__(
        self,
        description: RobotDescription,
        limits: Limits,
        period_s: float,
        rules: SupervisionLimits,
        first: Observation,
    ) -> None:
        self._joints, self._hand, self._period_s = description.joints, description.gripper, period_s
        dof = description.dof
        lower = np.array([j.lower_rad for j in description.joints])
        upper = np.array([j.upper_rad for j in description.joints])
        self._fastest = rules.command_slack * np.array([j.velocity_rad_s for j in description.joints])
        self._start_rad = rules.following_rad
        # Rows: q, dq, ddq, step since the last setpoint. |value - middle| <= half; false for NaN.
        self._asked = np.zeros((4, dof))
        self._middle = np.stack([0.5 * (lower + upper), *np.zeros((3, dof))])
        half = [
            0.5 * (upper - lower) + ROUND,
            self._fastest,
            np.full(dof, GREATEST_RAD_S2),
            self._fastest * period_s,
        ]
        self._half = np.stack(half)
        self._most_m = (rules.command_slack * limits.tcp_speed_m_s * period_s) ** 2
        self._speed_m_s = limits.tcp_speed_m_s
        self.forget(first)

    def forget(self, newest: Observation) -> None:
        """The next setpoint begins where the robot is now."""
        self._q: Array = np.array(newest.q[-1])
        self._P: Array | None = None
        self._moving = False

    def look(self, command: Command, newest: Observation) -> Finding | None:
        """What is wrong with a command, or None; `newest` is what was sensed last."""
        target, motion = command.gripper, command.motion
        if target is not None and (wrong := self._jaws(target, newest)) is not None:
            return wrong
        if motion is None:
            if self._moving:  # it brakes by itself: the next setpoint is measured from where it stands then
                self._moving, self._P = False, None
            return None
        asked = self._asked
        first = self._P is None
        try:
            asked[0], asked[1], asked[2] = motion.q, motion.dq, motion.ddq
            P = np.asarray(motion.pose_B_P.position_m, dtype=np.float64)
        except (ValueError, TypeError, AttributeError):
            return self._wrong(f"a setpoint that is not {asked.shape[1]} numbers a quantity", math.nan, 0.0, newest)
        np.subtract(asked[0], newest.q[-1] if first else self._q, out=asked[3])
        half = self._half
        bad = np.abs(asked - self._middle) <= half
        if np.count_nonzero(bad) < bad.size and (wrong := self._setpoint(asked, bad, first, newest)) is not None:
            return wrong
        if self._P is not None:
            way = P - self._P
            if not way @ way <= self._most_m:
                speed = float(np.linalg.norm(way)) / self._period_s
                return self._wrong(
                    f"P would move at {speed:.3f} m/s, {self._speed_m_s:.3f} is allowed", speed, self._speed_m_s, newest
                )
        self._q, self._P, self._moving = motion.q, P, _moves(motion)
        return None

    def _setpoint(self, asked: Array, good: Array, first: bool, newest: Observation) -> Finding | None:
        """The first thing out of range; after a hold a setpoint may begin within the following error."""
        for row, i in np.argwhere(~good.astype(bool)).tolist():
            name, unit = (("q", "rad"), ("dq", "rad/s"), ("ddq", "rad/s2"), ("step", "rad"))[row]
            value, half = float(asked[row, i]), float(self._half[row, i])
            if row == 3 and first:
                half += self._start_rad
                if abs(value) <= half:
                    continue
            middle = float(self._middle[row, i])
            valid = f"{middle - half:.4f}..{middle + half:.4f} {unit}"
            what = f"{name} of {self._joints[i].name} would be {value:.4g} {unit}, valid is {valid}"
            return self._wrong(what, value, middle + math.copysign(half, value - middle), newest)
        return None

    def _jaws(self, target: GripperTarget, newest: Observation) -> Finding | None:
        hand = self._hand
        for name, value, low, high in (
            ("aperture_m", target.aperture_m, 0.0, hand.stroke_m),
            ("speed_m_s", target.speed_m_s, 0.0, hand.speed_m_s),
            ("force_N", target.force_N, 0.0, hand.force_N),
        ):
            if not low - ROUND <= value <= high + ROUND:
                what = f"the jaws' {name} would be {value:.4g}, valid is {low:g}..{high:g}"
                return self._wrong(what, float(value), high, newest)
        return None

    @staticmethod
    def _wrong(what: str, value: float, limit: float, newest: Observation) -> Finding:
        return Finding("command", what, value, limit, newest.now_s)


def _moves(motion: JointSetpoint) -> bool:
    return bool(np.count_nonzero(motion.dq))
