"""Guards of what is sensed: one comparison of the whole block when all is well, a closer look when it is not."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from operator import lt

import numpy as np

from glotouch_bt.robot.command import Command
from glotouch_bt.robot.description import RobotDescription
from glotouch_bt.robot.geometry import Array
from glotouch_bt.robot.limits import Limits
from glotouch_bt.robot.observation import Observation, TactileFrame
from glotouch_bt.robot.supervision_limits import Finding, Patience, SupervisionLimits

STANDS_RAD_S = 0.01
QUAT_SLACK = 0.01
COMPLETE = 0.5
"""A block with fewer than this share of its samples is not complete."""


class SensedWatch:
    """Looks at every block.

    Args:
        description, limits, period_s: The robot's.
        rules: What is tolerated.
        first: The block it begins with; it tells how many samples a period has.
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
        self._samples, dof = len(first.stamp_s), description.dof
        self._last_s = float(first.stamp_s[-1])
        self._late_s = (1.0 + COMPLETE) * period_s
        lower = np.array([j.lower_rad for j in description.joints]) - rules.joint_slack_rad
        upper = np.array([j.upper_rad for j in description.joints]) + rules.joint_slack_rad
        fastest = rules.speed_slack * np.array([j.velocity_rad_s for j in description.joints])
        # One row of a block: q, dq, wrench, position, quaternion; good if |value - middle| <= half, and false for NaN.
        # A wrench whose every component is below limit / sqrt(3) has a norm below the limit.
        share = 1.0 / math.sqrt(3.0)
        middle = np.concatenate([0.5 * (lower + upper), np.zeros(dof + 13)])
        half = np.concatenate(
            [
                0.5 * (upper - lower),
                fastest,
                [share * limits.hard_force_N] * 3,
                [share * limits.hard_torque_Nm] * 3,
                [rules.reach_m] * 3,
                [1.0 + QUAT_SLACK] * 4,
            ]
        )
        # After the block's rows: the newest q against where it shall be.
        width = len(middle)
        self._flat = np.zeros(self._samples * width + dof)
        self._middle = np.concatenate([np.tile(middle, self._samples), np.zeros(dof)])
        per_half = np.concatenate([np.tile(1.0 / half, self._samples), np.full(dof, 1.0 / rules.following_rad)])
        self._per_half = per_half
        rows = self._flat[: self._samples * width].reshape(self._samples, width)
        ends = np.cumsum([0, dof, dof, 6, 3, 4])
        self._q, self._dq, self._wrench, self._position, self._quat = (rows[:, a:b] for a, b in pairwise(ends.tolist()))
        self._newest_q, self._wanted_q = self._flat[-dof:], self._middle[-dof:]
        self._setpoint: Array | None = None
        self._lead: Array | None = None
        self._moving = False
        self._over = 0
        self._force = math.nan
        self._noisy_periods = self._same_periods = 0
        self._tactile_since_s: float | None = None

    def forget(self, newest: Observation) -> None:
        """The robot was set back: its clock and posture begin anew."""
        self._last_s = float(newest.stamp_s[-1])
        self._setpoint = self._lead = self._tactile_since_s = None
        self._moving, self._over, self._force = False, 0, math.nan
        self._noisy_periods = self._same_periods = 0

    def told(self, command: Command) -> None:
        """What the coming block answers to."""
        motion = command.motion
        if motion is not None:
            self._setpoint, self._lead = motion.q, motion.dq
            self._moving = True
        elif self._moving:
            # Told to hold: at rest where it is if it was at rest; else it brakes to where it will stand.
            self._moving = False
            if self._lead is not None and np.count_nonzero(self._lead):
                self._setpoint = None
            self._lead = None
        if not command.tactile:
            self._tactile_since_s = None
        elif self._tactile_since_s is None:
            self._tactile_since_s = self._last_s

    def look(self, o: Observation) -> tuple[Observation, list[Finding]]:
        """Check a block; the block without its unusable samples, and what was found, gravest last.

        A block of which no sample is usable comes back as it is, with a fatal finding.
        """
        stamps = o.stamp_s.tolist()
        found: list[Finding] = []
        if len(stamps) != self._samples or not (
            self._last_s < stamps[0] and stamps[-1] - self._last_s < self._late_s and all(map(lt, stamps, stamps[1:]))
        ):
            o = self._look_at_stamps(o, found)
            if found and found[-1].fatal:
                return o, found
        if len(o.stamp_s) != self._samples or not self._fine(o):
            o = self._look_closely(o, found)
        self._last_s = stamp_s = float(o.stamp_s[-1])
        force = o.wrench_S[-1].item(0)
        if force == self._force:
            self._look_for_stuck(o, found)
        else:
            self._same_periods = 0
            self._noisy_periods = self._noisy_periods + 1 if abs(force - self._force) > self._rules.noise_N else 0
            self._force = force
        jaws = o.gripper
        if not (stamp_s - jaws.stamp_s <= self._rules.gripper_age_s and math.isfinite(jaws.aperture_m + jaws.force_N)):
            self._look_at_jaws(o, found)
        if self._tactile_since_s is not None:
            self._look_at_pads(o.tactile, stamp_s, found)
        return o, found

    def _fine(self, o: Observation) -> bool:
        """Nothing in the block is out of the ordinary."""
        flat = self._flat
        self._q[:], self._dq[:], self._wrench[:] = o.q, o.dq, o.wrench_S
        self._position[:], self._quat[:] = o.position_B_P, o.quat_B_P
        self._newest_q[:] = o.q[-1]
        self._wanted_q[:] = o.q[-1] if self._setpoint is None else self._setpoint
        np.subtract(flat, self._middle, out=flat)
        flat *= self._per_half
        np.abs(flat, out=flat)
        if self._setpoint is None and not self._moving and np.abs(o.dq[-1]).max() < STANDS_RAD_S:
            self._setpoint = np.array(o.q[-1])
        fine = bool(flat.max() <= 1.0)
        if fine:
            self._over = 0
        return fine

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
        if periods >= 1.0 + COMPLETE:
            fatal = periods > 1.0 + self._rules.late_periods and self._moving
            if not fatal and self._moving:
                fatal = self._patience.ends("overrun", now_s)
            what = f"{periods:.1f} control periods passed in one cycle" + (" while the arm moved" * self._moving)
            found.append(Finding("overrun", what, periods, 1.0 + self._rules.late_periods, now_s, fatal))
        missing = round(self._samples * max(periods, 1.0)) - len(o.stamp_s) - bad
        if missing > 0:
            short = len(o.stamp_s) < COMPLETE * self._samples
            fatal = self._patience.ends("samples_missing", now_s, self._rules.tolerated if short else missing)
            what = f"{missing} of {missing + len(o.stamp_s)} samples are missing"
            found.append(Finding("samples_missing", what, float(missing), float(self._rules.tolerated), now_s, fatal))
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
        norm = float(np.abs(np.linalg.norm(o.quat_B_P, axis=1) - 1.0).max())
        if norm > QUAT_SLACK:
            what = f"a reported quaternion's length is off by {norm:.3g}"
            found.append(Finding("out_of_reach", what, norm, QUAT_SLACK, float(o.stamp_s[-1])))
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
        if self._setpoint is None:
            return
        lead = 0.0 if self._lead is None else np.abs(self._lead)
        away = np.abs(o.q[-1] - self._setpoint)
        allowed = rules.following_rad + rules.lag_s * np.broadcast_to(lead, away.shape)
        i = int(np.argmax(away - allowed))
        if away[i] > allowed[i]:
            what = (
                f"{self._joints[i].name} is {away[i]:.3f} rad from where it was told to "
                + ("be" if self._moving else "stay")
                + f", {allowed[i]:.3f} is allowed"
            )
            found.append(Finding("following", what, float(away[i]), float(allowed[i]), stamp_s))

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

    def _look_for_stuck(self, o: Observation, found: list[Finding]) -> None:
        """The newest force is the last block's newest, to the bit."""
        if np.count_nonzero(o.wrench_S != o.wrench_S[-1]):
            return
        self._same_periods += 1
        same_s = self._same_periods * self._period_s
        if same_s < self._rules.stuck_s:
            return
        if self._noisy_periods * self._period_s >= self._rules.noisy_s:
            what = f"the wrench has been the same to the bit for {same_s:.2f} s, it was noisy before"
            found.append(Finding("wrench_stuck", what, same_s, self._rules.stuck_s, float(o.stamp_s[-1])))
        self._noisy_periods = 0

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

    def _look_at_pads(self, frame: TactileFrame | None, now_s: float, found: list[Finding]) -> None:
        limit = self._rules.tactile_age_s
        if frame is None:
            waited = now_s - (self._tactile_since_s or 0.0)
            if waited > limit:
                what = f"no depth map for {waited:.3f} s although they were asked for"
                found.append(Finding("tactile_stale", what, waited, limit, now_s))
            return
        self._tactile_since_s = now_s
        if now_s - frame.stamp_s > limit:
            age = now_s - frame.stamp_s
            found.append(Finding("tactile_stale", f"a depth map is {age:.3f} s old", age, limit, now_s))
        for side, depth in (("left", frame.left_m), ("right", frame.right_m)):
            live = float(np.count_nonzero(np.isfinite(depth))) / depth.size
            if live < self._rules.live_taxels or np.isinf(depth).any():
                fatal = self._patience.ends("tactile_dead", now_s)
                what = f"{100.0 * live:.0f} % of the {side} pad give numbers"
                found.append(Finding("tactile_dead", what, live, self._rules.live_taxels, now_s, fatal))


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
