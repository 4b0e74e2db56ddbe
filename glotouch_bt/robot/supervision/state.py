"""Guards of what is sensed: one comparison of the whole block when all is well, a closer look when it is not."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from operator import lt

import numpy as np

from glotouch_bt.robot.command import Command
from glotouch_bt.robot.description import RobotDescription
from glotouch_bt.robot.geometry import Array
from glotouch_bt.robot.limits import Limits
from glotouch_bt.robot.observation import Observation
from glotouch_bt.robot.supervision.limits import Finding, Patience, SupervisionLimits
from glotouch_bt.robot.supervision.signal import PadWatch, WristWatch

STANDS_RAD_S = 0.01
QUAT_SLACK = 0.01
LATE = 0.5
"""A cycle that took so many periods more than one was late."""
SEEN = 0.25
"""A block with fewer than this share of its samples misses some. A device that is polled every millisecond, by a loop
that is not hard real time, gives seven to nine of ten; a machine that is busy besides, half of them."""


class SensedWatch:
    """Looks at every block.

    Args:
        description, limits, period_s: The robot's.
        rules: What is tolerated.
        first: The block it begins with; how many samples a period has is told by the first block of several.
    """

    def __init__(
        self,
        description: RobotDescription,
        limits: Limits,
        period_s: float,
        rules: SupervisionLimits,
        first: Observation,
    ) -> None:
        self._rules, self._limits, self._period_s = rules, limits, period_s
        self._joints = description.joints
        self._patience = Patience(rules)
        self._samples = self._count(first)
        self._last_s = float(first.stamp_s[-1])
        self._late_s = (1.0 + LATE) * period_s
        slack = rules.joint_slack_rad
        self._ranges = [(j.lower_rad - slack, j.upper_rad + slack) for j in description.joints]
        self._fastest = rules.speed_slack * np.array([j.velocity_rad_s for j in description.joints])
        # Of whole blocks, sums of squares: below their limits surely in order, and never with a NaN among them.
        self._per_limit = np.array([1.0 / limits.hard_force_N] * 3 + [1.0 / limits.hard_torque_Nm] * 3)
        self._slow_2, self._reach_2 = float(self._fastest.min()) ** 2, rules.reach_m**2
        self._near_2, self._alike = rules.following_m**2, math.cos(0.5 * rules.following_rad)
        self._touching_2, self._nearer_2 = rules.touching_N**2, rules.touching_m**2
        # Position and quaternion of P in B as it was told to be lately, newest last; empty: it brakes to where it will.
        self._told: deque[list[float]] = deque(maxlen=max(1, round(rules.lag_s / period_s)))
        self._brakes = False
        self._moving = False
        self._moved = False  # by the command before the newest: that is what a late cycle waited with
        self._over = 0
        self._wrist = WristWatch(period_s, rules, self._patience)
        self._pads = PadWatch(rules, self._patience)

    def forget(self, newest: Observation) -> None:
        """The robot was set back: its clock and posture begin anew."""
        self._last_s = float(newest.stamp_s[-1])
        self._wrist.forget()
        self._pads.forget()
        self._told.clear()
        self._moving = self._brakes = self._moved = False
        self._over = 0

    def told(self, command: Command) -> None:
        """What the coming block answers to."""
        self._moved = self._moving and self._brakes
        motion = command.motion
        if motion is not None:
            pose = motion.pose_B_P
            self._told.append([*pose.position_m.tolist(), *pose.quat.tolist()])
            self._moving, self._brakes = True, bool(np.count_nonzero(motion.dq))
        elif self._moving and self._brakes:
            self._told.clear()
            self._moving = False
        elif self._told:
            self._told.append(self._told[-1])
            self._moving = False
        self._pads.told(command.tactile, self._last_s)

    def look(self, o: Observation) -> tuple[Observation, list[Finding]]:
        """Check a block; the block without its unusable samples, and what was found, gravest last.

        A block of which no sample is usable comes back as it is, with a fatal finding.
        """
        stamps = o.stamp_s.tolist()
        found: list[Finding] = []
        if self._samples == 0:
            self._samples = self._count(o)
        if len(stamps) < SEEN * self._samples or not (
            self._last_s < stamps[0] and stamps[-1] - self._last_s < self._late_s and all(map(lt, stamps, stamps[1:]))
        ):
            o = self._look_at_stamps(o, found)
            if found and found[-1].fatal:
                return o, found
        if not self._fine(o):
            o = self._look_closely(o, found)
        self._last_s = stamp_s = float(o.stamp_s[-1])
        self._wrist.look(o, found)
        jaws = o.gripper
        if not (stamp_s - jaws.stamp_s <= self._rules.gripper_age_s and math.isfinite(jaws.aperture_m + jaws.force_N)):
            self._look_at_jaws(o, found)
        if self._pads.asked:
            self._pads.look(o, found)
        return o, found

    def _count(self, o: Observation) -> int:
        """Samples a period has, from the spacing of several; 0 while that is not known."""
        span_s = float(o.stamp_s[-1] - o.stamp_s[0])
        return round(self._period_s * (len(o.stamp_s) - 1) / span_s) if len(o.stamp_s) > 1 and span_s > 0.0 else 0

    def _fine(self, o: Observation) -> bool:
        """Nothing in the block is out of the ordinary: sums of squares of all of it, range and pose of its newest."""
        wrench = o.wrench_S * self._per_limit
        scaled = wrench.ravel()
        q, dq, position, quat = o.q.ravel(), o.dq.ravel(), o.position_B_P.ravel(), o.quat_B_P.ravel()
        if not (
            (scaled @ scaled < 1.0 or _within(wrench))
            and math.isfinite(q @ q)
            and (dq @ dq <= self._slow_2 or bool((np.abs(o.dq).max(axis=0) <= self._fastest).all()))
            and position @ position <= self._reach_2
            and abs(quat @ quat - len(o.quat_B_P)) <= QUAT_SLACK
        ):
            return False
        self._over = 0
        for value, (low, high) in zip(o.q[-1].tolist(), self._ranges, strict=True):
            if not low <= value <= high:
                return False
        x, y, z = o.position_B_P[-1].tolist()
        w, i, j, k = o.quat_B_P[-1].tolist()
        if not self._told:
            if not self._moving and np.abs(o.dq[-1]).max() < STANDS_RAD_S:
                self._told.append([x, y, z, w, i, j, k])
            return True
        a, b, c, d, e, f, g = self._told[-1]
        away_2 = (x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2
        if away_2 > self._nearer_2 and self._touches(o):
            return False
        return bool(away_2 <= self._near_2 and abs(w * d + i * e + j * f + k * g) >= self._alike)

    def _touches(self, o: Observation) -> bool:
        """The newest sample feels more than a following servo may press with."""
        force = o.wrench_S[-1, :3]
        return bool(force @ force > self._touching_2)

    def _look_at_stamps(self, o: Observation, found: list[Finding]) -> Observation:
        """Samples out of order are dropped; gaps and missing samples are put on record, or end patience."""
        s, last = o.stamp_s, self._last_s
        newest = np.concatenate([[last], np.maximum.accumulate(np.where(np.isfinite(s), s, -np.inf))])
        good = s > np.maximum(newest[:-1], last)
        bad = len(s) - int(np.count_nonzero(good))
        if bad:
            fatal = not good.any() or self._patience.ends("stamps", last, bad)
            what = f"{bad} of {len(s)} samples are not later than the one before them"
            found.append(Finding("stamps", what, float(bad), float(self._rules.tolerated), last, fatal))
            if fatal:
                return o
            o = _picked(o, good)
        now_s = float(o.stamp_s[-1])
        periods = (now_s - last) / self._period_s
        if periods >= 1.0 + LATE:
            fatal = self._moved and periods > 1.0 + self._rules.late_periods
            if not fatal and self._moved and periods > 1.0 + self._rules.held_periods:
                fatal = self._patience.ends("overrun", now_s)
            what = f"{periods:.1f} control periods passed in one cycle" + (" while the arm moved" * self._moved)
            found.append(Finding("overrun", what, periods, 1.0 + self._rules.late_periods, now_s, fatal))
        expected = round(self._samples * periods)
        missing = expected - len(o.stamp_s) - bad
        if missing > 1 and len(o.stamp_s) < SEEN * expected:
            blind = missing / (self._samples * self._rules.late_periods) if self._moved else 0.0
            fatal = self._patience.ends("samples_missing", now_s, max(1, math.ceil(blind * self._rules.tolerated)))
            what = f"{missing} of {expected} samples are missing"
            most = (1.0 - SEEN) * expected
            found.append(Finding("samples_missing", what, float(missing), most, now_s, fatal))
        return o

    def _look_closely(self, o: Observation, found: list[Finding]) -> Observation:
        """Which guard it is; samples that are not finite are dropped."""
        good = np.ones(len(o.stamp_s), dtype=bool)
        for part in (o.q, o.dq, o.wrench_S, o.position_B_P, o.quat_B_P):
            good &= np.isfinite(part).all(axis=1)
        bad = len(good) - int(np.count_nonzero(good))
        if bad:
            stamp_s = float(o.stamp_s[int(np.argmin(good))])
            fatal = not good.any() or self._patience.ends("not_finite", stamp_s, bad)
            names = [n for n in ("q", "dq", "wrench_S", "position_B_P", "quat_B_P")
                     if not np.isfinite(getattr(o, n)).all()]  # fmt: skip
            what = f"{bad} of {len(good)} samples are not finite ({', '.join(names)})"
            found.append(Finding("not_finite", what, float(bad), float(self._rules.tolerated), stamp_s, fatal))
            if not good.any():
                return o
            o = _picked(o, good)
        self._look_at_joints(o, found)
        far = float(np.abs(o.position_B_P).max())
        if far > self._rules.reach_m:
            what = f"the pads' mid-point is reported {far:.2f} m from the base"
            found.append(Finding("out_of_reach", what, far, self._rules.reach_m, float(o.stamp_s[-1])))
        norm = float(np.abs((o.quat_B_P * o.quat_B_P).sum(axis=1) - 1.0).max())
        if norm > QUAT_SLACK:
            what = f"the square of a reported quaternion's length is off by {norm:.3g}"
            found.append(Finding("out_of_reach", what, norm, QUAT_SLACK, float(o.stamp_s[-1])))
        self._look_at_pose(o, found)
        self._look_at_wrench(o, found)
        return o

    def _look_at_joints(self, o: Observation, found: list[Finding]) -> None:
        rules, stamp_s = self._rules, float(o.stamp_s[-1])
        for i, joint in enumerate(self._joints):
            low, high = float(o.q[:, i].min()), float(o.q[:, i].max())
            value = low if joint.lower_rad - low > high - joint.upper_rad else high
            limit = joint.lower_rad if value == low else joint.upper_rad
            if not joint.lower_rad - rules.joint_slack_rad <= value <= joint.upper_rad + rules.joint_slack_rad:
                valid = f"{joint.lower_rad:.3f}..{joint.upper_rad:.3f}"
                what = f"{joint.name} is at {value:.3f} rad, its range is {valid}"
                found.append(Finding("joint_range", what, value, limit, stamp_s))
            fastest = float(np.abs(o.dq[:, i]).max())
            if fastest > rules.speed_slack * joint.velocity_rad_s:
                what = f"{joint.name} turns at {fastest:.2f} rad/s, its limit is {joint.velocity_rad_s:.2f}"
                found.append(Finding("joint_speed", what, fastest, joint.velocity_rad_s, stamp_s))

    def _look_at_pose(self, o: Observation, found: list[Finding]) -> None:
        """Whether the hand is where it was told to be, now or within the lag.

        The hand's pose, not the joints': where a device is sent poses, a redundant arm finds its own posture for them.
        """
        if not self._told:
            return
        rules, p, q = self._rules, o.position_B_P[-1].tolist(), o.quat_B_P[-1].tolist()
        aways = [(math.dist(p, t[:3]), _turn_rad(q, t[3:])) for t in self._told]
        touches = self._touches(o)
        max_m = min(rules.touching_m, rules.following_m) if touches else rules.following_m
        if any(m <= max_m and rad <= rules.following_rad for m, rad in aways):
            return
        told = "told to " + ("be" if self._moving else "stay")
        m, rad = min(aways)
        if m > max_m:
            what = f"the hand is {m * 1e3:.1f} mm from where it was {told}, {max_m * 1e3:.1f} are allowed"
            if touches:
                what += f" while {float(np.linalg.norm(o.wrench_S[-1, :3])):.0f} N press"
            found.append(Finding("following", what, m, max_m, float(o.stamp_s[-1])))
        else:
            what = f"the hand is turned {rad:.3f} rad from how it was {told}, {rules.following_rad:.3f} are allowed"
            found.append(Finding("following", what, rad, rules.following_rad, float(o.stamp_s[-1])))

    def _look_at_wrench(self, o: Observation, found: list[Finding]) -> None:
        """The hard limit, so many samples running, also across blocks."""
        limits = self._limits
        force, torque = (np.linalg.norm(w, axis=1) for w in (o.wrench_S[:, :3], o.wrench_S[:, 3:]))
        beyond = (force > limits.hard_force_N) | (torque > limits.hard_torque_Nm)
        for i, over in enumerate(beyond.tolist()):
            self._over = self._over + 1 if over else 0
            if self._over < self._rules.wrench_samples:
                continue
            by_force = force[i] / limits.hard_force_N >= torque[i] / limits.hard_torque_Nm
            value, limit, unit = (
                (float(force[i]), limits.hard_force_N, "N")
                if by_force
                else (float(torque[i]), limits.hard_torque_Nm, "Nm")
            )
            what = f"{value:.1f} {unit} sensed at the wrist, {self._over} samples running beyond {limit:.1f} {unit}"
            found.append(Finding("wrench", what, value, limit, float(o.stamp_s[i])))
            return

    def _look_at_jaws(self, o: Observation, found: list[Finding]) -> None:
        jaws, now_s, limit = o.gripper, float(o.stamp_s[-1]), self._rules.gripper_age_s
        if not math.isfinite(jaws.aperture_m + jaws.force_N + jaws.stamp_s):
            what = f"the gripper reports {jaws.aperture_m} m, {jaws.force_N} N at {jaws.stamp_s} s"
            fatal = self._patience.ends("not_finite", now_s, self._rules.tolerated + 1)
            found.append(Finding("not_finite", what, math.nan, limit, now_s, fatal))
            return
        age = now_s - jaws.stamp_s
        what = f"the gripper's last report is {age:.3f} s old"
        found.append(Finding("gripper_stale", what, age, limit, now_s))


def _picked(o: Observation, good: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Observation:
    """The block with some of its samples only."""
    return replace(
        o,
        stamp_s=o.stamp_s[good],
        q=o.q[good],
        dq=o.dq[good],
        position_B_P=o.position_B_P[good],
        quat_B_P=o.quat_B_P[good],
        wrench_S=o.wrench_S[good],
    )


def _within(wrench: Array) -> bool:
    """No sample of a block (n, 6) of shares of the limits is beyond one."""
    squares = (wrench * wrench).reshape(-1, 2, 3).sum(axis=2)
    return bool(squares.max() < 1.0)


def _turn_rad(a: list[float], b: list[float]) -> float:
    """Angle between two rotations given as unit quaternions."""
    half = abs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3])
    return 2.0 * math.acos(min(1.0, half))
