"""Tests of the units, frames, signs and times of readings."""

from __future__ import annotations

import numpy as np
import pytest

from glotouch_bt.conformance.base import Conformance
from glotouch_bt.conformance.rig import Rig, stack
from glotouch_bt.robot import Array, ParamError, SetPayload, Tare

GRAVITY_M_S2 = 9.81


class SensingTests(Conformance):
    """Readings and setpoints."""

    def test_joints_and_pose_agree(self) -> None:
        """q in rad, through the description's kinematics, gives the reported pose of P in B at every sample."""
        rig = self.rig()
        rig.shift(np.array([0.0, 0.06, 0.03]))
        rig.go(rig.tilt(0.3))
        rig.rest(0.1)
        for o in rig.seen[-80::8]:
            for q, position, quat in zip(o.q, o.position_B_P, o.quat_B_P, strict=True):
                expected = rig.kinematics.fk(np.asarray(q))
                assert np.linalg.norm(expected.position_m - position) < 2e-3, "P is not where q puts it"
                assert abs(float(expected.quat @ quat)) > np.cos(0.01), "the hand is not turned as q turns it"
                assert abs(float(np.linalg.norm(quat)) - 1.0) < 1e-6

    def test_velocities_match_positions(self) -> None:
        """dq in rad/s is the rate of q."""
        rig = self.rig()
        seen = [o for _, o in rig.shift(np.array([0.0, 0.10, 0.0]))]
        stamp, q, dq = stack(seen, "stamp_s"), stack(seen, "q"), stack(seen, "dq")
        far = max(1, round(0.05 / self.sample_s))
        rate = (q[far:] - q[:-far]) / (stamp[far:] - stamp[:-far])[:, None]
        mean = np.array([dq[i : i + far].mean(axis=0) for i in range(len(rate))])
        assert np.abs(rate).max() > 0.05, "it did not move"
        assert np.abs(rate - mean).max() < 0.1 * np.abs(rate).max()

    @pytest.mark.parametrize("axis", [0, 1, 2])
    def test_setpoints_are_reached(self, axis: int) -> None:
        """Setpoints move P along the axes of B; each is reached at the end of its period."""
        rig = self.rig()
        start = rig.last.position_B_P[-1].copy()
        wish = np.zeros(3)
        wish[axis] = 0.05
        track = rig.shift(wish, 0.04)
        late = [np.linalg.norm(o.position_B_P[-1] - s.pose_B_P.position_m) for s, o in track]
        assert max(late) < self.track_m, f"{max(late) * 1e3:.2f} mm behind its setpoint"
        end = rig.rest(0.3).position_B_P[-1]
        assert np.linalg.norm(end - start - wish) < 0.5 * self.track_m + 1e-4

    def test_blocks_are_complete_and_in_order(self) -> None:
        """Consecutive periods have no gap and no repeated sample, also in motion."""
        rig = self.rig()
        before = rig.last
        seen = [o for _, o in rig.shift(np.array([0.0, 0.08, 0.0]))] + rig.hold(0.5, tactile=True)
        assert rig.robot.observe() is rig.last or rig.robot.observe().now_s == rig.last.now_s
        stamps = np.concatenate([before.stamp_s[-1:], *(o.stamp_s for o in seen)])
        steps = np.diff(stamps)
        assert (steps > 0).all(), "stamps do not increase"
        expected = round((stamps[-1] - stamps[0]) / self.sample_s)
        if self.paced:
            assert len(steps) >= 0.98 * expected, f"{expected - len(steps)} of {expected} samples are missing"
            assert np.quantile(steps, 0.95) < 3 * self.sample_s
        else:
            assert len(steps) == expected, f"{expected - len(steps)} of {expected} samples are missing"
            assert np.abs(steps - self.sample_s).max() < 0.1 * self.sample_s
        for o in seen:
            assert len({len(o.stamp_s), len(o.q), len(o.dq), len(o.position_B_P), len(o.wrench_S)}) == 1

    def test_a_cycle_lasts_a_period(self) -> None:
        """One cycle takes one period on the robot's clock, with and without a command."""
        rig = self.rig()
        stamps = [rig.last.now_s, *(o.now_s for o in rig.hold(0.5)), *(o.now_s for _, o in rig.shift(np.full(3, 0.02)))]
        lasted = np.diff(stamps)
        if self.paced:
            assert abs(float(np.median(lasted)) - rig.period_s) < 0.1 * rig.period_s
            assert np.quantile(lasted, 0.9) < 2.5 * rig.period_s
        else:
            assert np.abs(lasted - rig.period_s).max() < 1e-6

    def test_tare(self) -> None:
        """A tare takes time, the arm stands meanwhile, and afterwards the wrench is zero, also with the hand tilted."""
        rig = self.rig()
        start = rig.last.position_B_P[-1].copy()
        periods = rig.ask(Tare(0.2))
        assert periods * rig.period_s > 0.15, "there was no time to average"
        assert np.linalg.norm(rig.last.position_B_P[-1] - start) < 1e-3
        rig.rest(0.1)
        self._is_zero(rig, "after a tare")
        for angle in (0.35, -0.7):
            rig.go(rig.tilt(angle))
            rig.rest(0.3)
            self._is_zero(rig, f"tilted by {angle} rad")

    def _is_zero(self, rig: Rig, when: str) -> None:
        mean = rig.mean_wrench()
        assert np.linalg.norm(mean[:3]) < self.rest_force_N, f"{when}: {mean[:3]} N"
        assert np.linalg.norm(mean[3:]) < self.rest_torque_Nm, f"{when}: {mean[3:]} Nm"

    def test_invalid_requests_are_refused(self) -> None:
        """A tare without a positive duration and a payload of negative mass raise ParamError."""
        rig = self.rig()
        for bad in (0.0, -1.0, float("nan")):
            with pytest.raises(ParamError):
                rig.robot.start(Tare(bad))
        with pytest.raises(ParamError):
            rig.robot.start(SetPayload(-0.1, np.zeros(3)))

    @pytest.mark.parametrize("angle_rad", [0.0, 0.3])
    def test_sign_and_frame_of_the_wrench(self, angle_rad: float) -> None:
        """A payload that is set but not held shows as an upward force m g, because its weight is subtracted.

        The wrench is in S about S's origin; a centre of mass beside the axis also gives the torque c x F.
        """
        mass, com_P = 0.3, np.array([0.03, 0.02, 0.0])
        rig = self.rig()
        rig.go(rig.tilt(angle_rad))
        rig.rest(0.3)
        rig.ask(Tare())
        before = rig.mean_wrench()
        try:
            rig.ask(SetPayload(mass, com_P))
            rig.rest(0.3)
            change = rig.mean_wrench() - before
            up_S = self._up_in_S(rig)
        finally:
            rig.ask(SetPayload(0.0, np.zeros(3)))
        weight = mass * GRAVITY_M_S2
        force = weight * up_S
        torque = np.cross(rig.robot.description.gripper.pose_E_P.apply(com_P), force)
        assert np.linalg.norm(change[:3] - force) < self.weight_share * weight + 0.1, f"{change[:3]}, not {force} N"
        tolerance = self.weight_share * weight * 0.25 + 0.02
        assert np.linalg.norm(change[3:] - torque) < tolerance, f"{change[3:]}, not {torque} Nm"

    @staticmethod
    def _up_in_S(rig: Rig) -> Array:
        pose_B_S = rig.last.pose_B_P @ rig.robot.description.gripper.pose_E_P.inverse()
        return np.asarray(pose_B_S.rotation.T @ np.array([0.0, 0.0, 1.0]))
