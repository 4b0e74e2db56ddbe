"""Guards of the readings: one fast test of the whole block, and single checks only when it fails."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from itertools import pairwise
from operator import lt
from typing import Any

import numpy as np

from glotouch_bt.robot.command import Command
from glotouch_bt.robot.geometry import Array
from glotouch_bt.robot.interface import Robot
from glotouch_bt.robot.observation import SAMPLED, Observation
from glotouch_bt.robot.supervision import targets
from glotouch_bt.robot.supervision.limits import GuardFinding, SupervisionLimits, TransientCounter
from glotouch_bt.robot.supervision.response import WristResponseGuard
from glotouch_bt.robot.supervision.signals import TactileSignalGuard, WrenchSignalGuard
from glotouch_bt.robot.supervision.targets import MAX_NORM_ERROR, NOWHERE, angle_rad, distance_to_path

MAX_REST_SPEED_RAD_S = 0.01
"""A joint below this speed stands still. Source: ours."""
LATE_PERIODS = 0.5
"""A cycle is late when it lasts this many periods more than one. Source: ours."""
MAX_LAG_M = 0.001
"""Compare a hand that is farther from its newest target with its whole path of the last `lag_s`. Source: ours."""
MIN_SAMPLE_SHARE = 0.25
"""A block with fewer than this share of its samples is reported. Source: measured; a device that is polled every
millisecond by a soft real-time loop gives 0.7-0.9 of them, on a loaded machine 0.5."""


class ReadingsGuard:
    """Check every block of readings.

    Args:
        robot: The guarded robot.
        guard_limits: Limits of the guards.
        first: The newest block. The first block of several samples gives the number of samples a period.
    """

    def __init__(self, robot: Robot, guard_limits: SupervisionLimits, first: Observation) -> None:
        limits, period_s = robot.limits, robot.period_s
        self._guard_limits, self._limits, self._period_s = guard_limits, limits, period_s
        self._joints = robot.description.joints
        self._transients = TransientCounter(guard_limits)
        self._samples = self._count(first)
        self._last_s = float(first.stamp_s[-1])
        self._late_s = (1.0 + LATE_PERIODS) * period_s
        slack = guard_limits.joint_slack_rad
        # Columns are joints; the last row has the limits that are not of a joint.
        self._fast_limits: Array = np.zeros((4, max(3, len(self._joints))))
        for i, j in enumerate(self._joints):
            speed = guard_limits.speed_slack * j.velocity_rad_s
            self._fast_limits[:3, i] = j.lower_rad - slack, j.upper_rad + slack, speed
        self._fast_limits[3, :3] = guard_limits.reach_m, limits.stop_force_N, limits.stop_torque_Nm
        self._min_dot, self._min_pressing_force_2 = (
            math.cos(0.5 * guard_limits.following_rad),
            guard_limits.touching_N**2,
        )
        # Recently commanded positions and quaternions of P in B, newest last; empty while the arm brakes on its own.
        self._targets: deque[Array] = deque(maxlen=max(1, round(guard_limits.lag_s / period_s)))
        self._braking_from: tuple[list[float], float] | None = None  # position, largest distance from it
        self._has_velocity = False
        self._moving = False
        self._was_moving = False  # by the command before the newest: a late cycle waited with that one
        self._samples_over = 0
        self._away_m = 0.0  # of the hand from its path, in the block before
        self._response = WristResponseGuard(robot, guard_limits) if robot.description.wrist_feels_inertia else None
        self._wrist = WrenchSignalGuard(period_s, guard_limits, self._transients)
        self._pads = TactileSignalGuard(guard_limits, self._transients)

    def reset(self, newest: Observation) -> None:
        """Start again from `newest`: the robot was restored to an earlier state."""
        self._last_s = float(newest.stamp_s[-1])
        self._wrist.reset()
        if self._response is not None:
            self._response.reset()
        self._pads.reset()
        self._targets.clear()
        self._braking_from = None
        self._moving = self._has_velocity = self._was_moving = False
        self._samples_over = 0

    def on_command(self, command: Command) -> None:
        """Note the command that the next block answers."""
        self._was_moving = self._moving and self._has_velocity
        motion = command.motion
        if motion is not None:
            pose = motion.pose_B_P
            self._targets.append(np.concatenate((pose.position_m, pose.quat)))
            self._braking_from = None
            self._moving, self._has_velocity = True, bool(np.count_nonzero(motion.dq))
        elif self._moving and self._has_velocity:
            self._braking_from = self._targets[-1][:3].tolist(), self._braking_m()
            self._targets.clear()
            self._moving = False
        elif self._targets:
            self._targets.append(self._targets[-1])
            self._moving = False
        self._pads.on_command(command.tactile, self._last_s)

    def _braking_m(self) -> float:
        """Return the largest distance from the newest target at which the arm may come to rest."""
        path = [t[:3].tolist() for t in self._targets]
        speed_m_s = max((math.dist(a, b) for a, b in pairwise(path)), default=0.0) / self._period_s
        braking_m = 0.5 * speed_m_s**2 / self._limits.stop_acceleration_m_s2
        return braking_m + speed_m_s * self._guard_limits.lag_s + self._guard_limits.following_m

    def _add_stop(self) -> None:
        """Insert the place where the device came to rest when the newest command was late.

        Between two commands the arm may be anywhere on its way there.
        """
        if len(self._targets) > 2:
            before, last, newest = (self._targets[i] for i in (-3, -2, -1))
            step_m = last[:3] - before[:3]
            ahead = 0.5 * float(np.linalg.norm(step_m)) / (self._period_s**2 * self._limits.stop_acceleration_m_s2)
            self._targets[-1] = np.concatenate((last[:3] + ahead * step_m, last[3:]))
            self._targets.append(newest)

    def check(self, o: Observation) -> tuple[Observation, list[GuardFinding]]:
        """Return the block without its unusable samples, and the findings, most severe last.

        A block without any usable sample is returned unchanged, with a fatal finding.
        """
        stamps = o.stamp_s.tolist()
        findings: list[GuardFinding] = []
        if self._samples == 0:
            self._samples = self._count(o)
        if len(stamps) < MIN_SAMPLE_SHARE * self._samples or not (
            self._last_s < stamps[0] and stamps[-1] - self._last_s < self._late_s and all(map(lt, stamps, stamps[1:]))
        ):
            o = self._check_stamps(o, findings)
            if findings and findings[-1].fatal:
                return o, findings
        if not self._in_order(o):
            o = self._check_each(o, findings)
        self._last_s = stamp_s = float(o.stamp_s[-1])
        self._wrist.check(o, findings)
        if self._response is not None:
            self._response.check(o, findings)
        jaws = o.gripper
        if not (
            stamp_s - jaws.stamp_s <= self._guard_limits.gripper_age_s and math.isfinite(jaws.aperture_m + jaws.force_N)
        ):
            self._check_jaws(o, findings)
        if self._pads.asked:
            self._pads.check(o, findings)
        return o, findings

    def _count(self, o: Observation) -> int:
        """Return the number of samples a period from their spacing; 0 if the block has only one."""
        span_s = float(o.stamp_s[-1] - o.stamp_s[0])
        return round(self._period_s * (len(o.stamp_s) - 1) / span_s) if len(o.stamp_s) > 1 and span_s > 0.0 else 0

    def _in_order(self, o: Observation) -> bool:
        """Return True if nothing is wrong: every sample in its range, and the newest pose at the newest target."""
        target = self._targets[-1] if self._targets else NOWHERE
        away_m = targets.way_to_target(  # the compiled function is put into its own module
            o.q, o.dq, o.position_B_P, o.quat_B_P, o.wrench_S, self._fast_limits, target, self._min_dot
        )
        if not 0.0 <= away_m <= MAX_LAG_M:
            return False
        if self._braking_from is not None:
            start, max_m = self._braking_from
            if math.dist(o.position_B_P[-1].tolist(), start) > max_m:
                return False
        self._samples_over = 0
        if self._targets:
            self._away_m = away_m
        elif not self._moving and np.abs(o.dq[-1]).max() < MAX_REST_SPEED_RAD_S:
            self._targets.append(np.concatenate((o.position_B_P[-1], o.quat_B_P[-1])))
            self._braking_from = None
        return True

    def _pressing(self, o: Observation) -> bool:
        """Return True if the newest sample shows more force than a servo without error may press with."""
        force = o.wrench_S[-1, :3]
        return bool(force @ force > self._min_pressing_force_2)

    def _check_stamps(self, o: Observation, findings: list[GuardFinding]) -> Observation:
        """Drop samples out of order; report gaps and missing samples."""
        s, last = o.stamp_s, self._last_s
        newest = np.concatenate([[last], np.maximum.accumulate(np.where(np.isfinite(s), s, -np.inf))])
        good = s > np.maximum(newest[:-1], last)
        bad = len(s) - int(np.count_nonzero(good))
        if bad:
            fatal = not good.any() or self._transients.exceeded("stamps", last, bad)
            what = f"{bad} of {len(s)} samples are not later than the one before them"
            findings.append(GuardFinding("stamps", what, float(bad), float(self._guard_limits.tolerated), last, fatal))
            if fatal:
                return o
            o = _select(o, good)
        self._check_gap(o, bad, findings)
        return o

    def _check_gap(self, o: Observation, dropped: int, findings: list[GuardFinding]) -> None:
        """Report a late block and missing samples; `dropped` samples arrived out of order."""
        now_s = float(o.stamp_s[-1])
        periods = (now_s - self._last_s) / self._period_s
        if periods >= 1.0 + LATE_PERIODS:
            fatal = self._was_moving and periods > 1.0 + self._guard_limits.late_periods
            if not fatal and self._was_moving and periods > 1.0 + self._guard_limits.held_periods:
                fatal = self._transients.exceeded("overrun", now_s)
            what = f"{periods:.1f} control periods passed in one cycle" + (" while the arm moved" * self._was_moving)
            findings.append(GuardFinding("overrun", what, periods, 1.0 + self._guard_limits.late_periods, now_s, fatal))
        expected = round(self._samples * periods)
        missing = expected - len(o.stamp_s) - dropped
        if missing > 1 and len(o.stamp_s) < MIN_SAMPLE_SHARE * expected:
            blind = missing / (self._samples * self._guard_limits.late_periods) if self._was_moving else 0.0
            fatal = self._transients.exceeded(
                "samples_missing", now_s, max(1, math.ceil(blind * self._guard_limits.tolerated))
            )
            what = f"{missing} of {expected} samples are missing"
            most = (1.0 - MIN_SAMPLE_SHARE) * expected
            findings.append(GuardFinding("samples_missing", what, float(missing), most, now_s, fatal))

    def _check_each(self, o: Observation, findings: list[GuardFinding]) -> Observation:
        """Find the guard that trips; drop samples that are not finite."""
        good = np.ones(len(o.stamp_s), dtype=bool)
        for part in (o.q, o.dq, o.wrench_S, o.position_B_P, o.quat_B_P):
            good &= np.isfinite(part).all(axis=1)
        bad = len(good) - int(np.count_nonzero(good))
        if bad:
            stamp_s = float(o.stamp_s[int(np.argmin(good))])
            fatal = not good.any() or self._transients.exceeded("not_finite", stamp_s, bad)
            names = [n for n in ("q", "dq", "wrench_S", "position_B_P", "quat_B_P")
                     if not np.isfinite(getattr(o, n)).all()]  # fmt: skip
            what = f"{bad} of {len(good)} samples are not finite ({', '.join(names)})"
            findings.append(
                GuardFinding("not_finite", what, float(bad), float(self._guard_limits.tolerated), stamp_s, fatal)
            )
            if not good.any():
                return o
            o = _select(o, good)
        self._check_joints(o, findings)
        far = float(np.abs(o.position_B_P).max())
        if far > self._guard_limits.reach_m:
            what = f"the pads' mid-point is reported {far:.2f} m from the base"
            findings.append(GuardFinding("out_of_reach", what, far, self._guard_limits.reach_m, float(o.stamp_s[-1])))
        norm = float(np.abs((o.quat_B_P * o.quat_B_P).sum(axis=1) - 1.0).max())
        if norm > MAX_NORM_ERROR:
            what = f"the square of a reported quaternion's length is off by {norm:.3g}"
            findings.append(GuardFinding("out_of_reach", what, norm, MAX_NORM_ERROR, float(o.stamp_s[-1])))
        self._check_pose(o, findings)
        self._check_wrench(o, findings)
        return o

    def _check_joints(self, o: Observation, findings: list[GuardFinding]) -> None:
        guard_limits, stamp_s = self._guard_limits, float(o.stamp_s[-1])
        for i, joint in enumerate(self._joints):
            low, high = float(o.q[:, i].min()), float(o.q[:, i].max())
            value = low if joint.lower_rad - low > high - joint.upper_rad else high
            limit = joint.lower_rad if value == low else joint.upper_rad
            if (
                not joint.lower_rad - guard_limits.joint_slack_rad
                <= value
                <= joint.upper_rad + guard_limits.joint_slack_rad
            ):
                valid = f"{joint.lower_rad:.3f}..{joint.upper_rad:.3f}"
                what = f"{joint.name} is at {value:.3f} rad, its range is {valid}"
                findings.append(GuardFinding("joint_range", what, value, limit, stamp_s))
            fastest = float(np.abs(o.dq[:, i]).max())
            if fastest > guard_limits.speed_slack * joint.velocity_rad_s:
                what = f"{joint.name} turns at {fastest:.2f} rad/s, its limit is {joint.velocity_rad_s:.2f}"
                findings.append(GuardFinding("joint_speed", what, fastest, joint.velocity_rad_s, stamp_s))

    def _check_pose(self, o: Observation, findings: list[GuardFinding]) -> None:
        """Compare the hand's pose with those commanded now and within the lag.

        The joints are not compared: a device that is sent poses chooses its own posture for them.
        """
        guard_limits, p, q, now_s = (
            self._guard_limits,
            o.position_B_P[-1].tolist(),
            o.quat_B_P[-1].tolist(),
            float(o.stamp_s[-1]),
        )
        if self._braking_from is not None:
            start, max_m = self._braking_from
            if (away_m := math.dist(p, start)) > max_m:
                what = f"the hand is {away_m * 1e3:.1f} mm from where it was told to stop"
                what += f"; {max_m * 1e3:.1f} mm are allowed"
                findings.append(GuardFinding("following", what, away_m, max_m, now_s))
        if not self._targets:
            return
        periods = max(1.0, (now_s - self._last_s) / self._period_s)
        if self._was_moving and periods > 1.0 + guard_limits.held_periods:
            self._add_stop()
        recent = [t.tolist() for t in self._targets]
        away_m, before_m = distance_to_path(p, [t[:3] for t in recent]), self._away_m
        self._away_m = away_m
        touches = self._pressing(o)
        max_m = min(guard_limits.touching_m, guard_limits.following_m) if touches else guard_limits.following_m
        told = "told to " + ("be" if self._moving else "stay")
        leaving_m = max(away_m - before_m, 0.0) / periods
        soon_m = away_m + guard_limits.following_periods * leaving_m
        if soon_m > max_m:
            what = f"the hand is {away_m * 1e3:.1f} mm from where it was {told}"
            if away_m <= max_m:
                what += f" and leaves it at {leaving_m / self._period_s * 1e3:.0f} mm/s"
            what += f"; {max_m * 1e3:.1f} mm are allowed"
            if touches:
                what += f" while it presses with {float(np.linalg.norm(o.wrench_S[-1, :3])):.0f} N"
            findings.append(GuardFinding("following", what, soon_m, max_m, now_s))
        rad = min(angle_rad(q, t[3:]) for t in recent)
        if rad > guard_limits.following_rad:
            allowed = f"{guard_limits.following_rad:.3f} rad are allowed"
            what = f"the hand is turned by {rad:.3f} rad from how it was {told}; {allowed}"
            findings.append(GuardFinding("following", what, rad, guard_limits.following_rad, now_s))

    def _check_wrench(self, o: Observation, findings: list[GuardFinding]) -> None:
        """Count consecutive samples beyond the stop limit, also across blocks."""
        limits = self._limits
        force, torque = (np.linalg.norm(w, axis=1) for w in (o.wrench_S[:, :3], o.wrench_S[:, 3:]))
        max_N, max_Nm = limits.stop_force_N, limits.stop_torque_Nm
        beyond = (force > max_N) | (torque > max_Nm)
        for i, over in enumerate(beyond.tolist()):
            self._samples_over = self._samples_over + 1 if over else 0
            if self._samples_over < self._guard_limits.wrench_samples:
                continue
            by_force = force[i] / max_N >= torque[i] / max_Nm
            value, limit, unit = (float(force[i]), max_N, "N") if by_force else (float(torque[i]), max_Nm, "Nm")
            n = self._samples_over
            what = f"{value:.1f} {unit} sensed at the wrist; {n} consecutive samples are beyond {limit:.1f} {unit}"
            findings.append(GuardFinding("wrench", what, value, limit, float(o.stamp_s[i])))
            return

    def _check_jaws(self, o: Observation, findings: list[GuardFinding]) -> None:
        jaws, now_s, limit = o.gripper, float(o.stamp_s[-1]), self._guard_limits.gripper_age_s
        if not math.isfinite(jaws.aperture_m + jaws.force_N + jaws.stamp_s):
            what = f"the gripper reports {jaws.aperture_m} m, {jaws.force_N} N at {jaws.stamp_s} s"
            fatal = self._transients.exceeded("not_finite", now_s, self._guard_limits.tolerated + 1)
            findings.append(GuardFinding("not_finite", what, math.nan, limit, now_s, fatal))
            return
        age = now_s - jaws.stamp_s
        what = f"the gripper's last report is {age:.3f} s old"
        findings.append(GuardFinding("gripper_stale", what, age, limit, now_s))


def _select(o: Observation, good: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Observation:
    """Return the block with the chosen samples only."""
    chosen: dict[str, Any] = {name: getattr(o, name)[good] for name in SAMPLED}
    return replace(o, **chosen)
