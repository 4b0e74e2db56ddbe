"""Tests of opening, closing, refused commands and stopping."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest

from glotouch_bt.conformance.base import Conformance
from glotouch_bt.conformance.rig import Rig, stack
from glotouch_bt.robot import HOLD, BackendError, Command, GripperTarget, JointSetpoint, Observation, ParamError, Pose


class StoppingTests(Conformance):
    """Opening, refusals and stopping."""

    def test_first_observation_is_valid_and_at_rest(self) -> None:
        """`observe` is valid at once and lets no time pass; the arm does not move without a command."""
        with self.own() as rig:
            first, dof = rig.robot.observe(), rig.robot.description.dof
            n = len(first.stamp_s)
            assert n >= 1
            for name, width in (("q", dof), ("dq", dof), ("position_B_P", 3), ("quat_B_P", 4), ("wrench_S", 6)):
                block = np.asarray(getattr(first, name))
                assert block.shape == (n, width), name
                assert np.isfinite(block).all(), name
            assert rig.robot.observe().now_s == first.now_s
            seen = rig.hold(0.3)
            drift = stack(seen, "position_B_P") - first.position_B_P[-1]
            assert np.abs(drift).max() < 1e-3, "it moves without a command"

    def test_closing_is_idempotent_and_another_robot_opens(self) -> None:
        """A closed robot accepts no cycle; hold and close never raise."""
        with self.own() as rig:
            rig.hold(0.05)
            rig.robot.close()
            rig.robot.close()
            rig.robot.hold()
            with pytest.raises(BackendError):
                rig.robot.cycle(HOLD)
        with self.own() as rig:
            rig.hold(0.05)

    def _broken_setpoints(self, rig: Rig) -> Iterator[tuple[str, JointSetpoint]]:
        q, zero = rig.q, np.zeros_like(rig.q)
        pose = rig.kinematics.fk(q)
        good = JointSetpoint(q, zero, zero, pose)
        joint = rig.robot.description.joints[1]
        one = np.eye(len(q), dtype=bool)
        yield "a NaN", replace(good, q=np.where(one[0], np.nan, q))
        yield "an infinite velocity", replace(good, dq=np.where(one[2], np.inf, zero))
        yield "a joint beyond its range", replace(good, q=np.where(one[1], joint.upper_rad + 0.1, q))
        yield "a joint faster than its limit", replace(good, dq=np.where(one[1], 2.0 * joint.velocity_rad_s, zero))
        jump = np.where(one[3], q + 0.3, q)
        yield "a jump", replace(good, q=jump, pose_B_P=rig.kinematics.fk(jump))
        yield "one joint too few", replace(good, q=q[:-1])
        yield "degrees", replace(good, q=np.degrees(q))

    def test_setpoints_beyond_the_limits_are_refused(self) -> None:
        """ParamError; nothing is sent, the arm holds, and the next valid command is accepted."""
        rig = self.rig()
        start = rig.last.position_B_P[-1].copy()
        for what, setpoint in self._broken_setpoints(rig):
            try:
                rig.robot.cycle(Command(motion=setpoint))
            except ParamError:
                pass
            else:
                raise AssertionError(f"{what} was accepted")
            rig.hold(0.05)
            assert np.linalg.norm(rig.last.position_B_P[-1] - start) < 1e-3, f"{what} moved it"
        rig.rest(0.1)
        rig.shift(np.array([0.0, 0.0, 0.02]))
        assert rig.rest(0.2).position_B_P[-1][2] - start[2] > 0.015

    def test_jaw_targets_beyond_the_limits_are_refused(self) -> None:
        """ParamError; the next valid command is accepted."""
        rig, hand = self.rig(), self.rig().robot.description.gripper
        good = GripperTarget(0.5 * hand.stroke_m, 0.5 * hand.speed_m_s, 0.5 * hand.force_N)
        for bad in (
            replace(good, aperture_m=float("nan")),
            replace(good, aperture_m=1.5 * hand.stroke_m),
            replace(good, aperture_m=-0.01),
            replace(good, speed_m_s=2.0 * hand.speed_m_s),
            replace(good, force_N=2.0 * hand.force_N),
            replace(good, force_N=float("inf")),
        ):
            with pytest.raises(ParamError):
                rig.robot.cycle(Command(gripper=bad))
            rig.hold(0.03)

    def _moving(self, rig: Rig, speed_m_s: float = 0.1) -> Pose:
        """Bring the arm into motion; return its measured pose."""
        here = rig.kinematics.fk(rig.q)

        def far(o: Observation) -> bool:
            return float(np.linalg.norm(o.position_B_P[-1] - here.position_m)) > 0.04

        rig.go(Pose(here.position_m + np.array([0.0, 0.12, 0.0]), here.quat), speed_m_s, until=far)
        return rig.last.pose_B_P

    def _stops(self, rig: Rig, at: Pose, speed_m_s: float = 0.1) -> None:
        """Check that the arm stops within v / a and v^2 / 2a plus the latency, and stays."""
        braking_s = speed_m_s / rig.robot.limits.stop_acceleration_m_s2
        seen = rig.hold(braking_s + self.stop_s + 0.2)
        stamps, track = stack(seen, "stamp_s"), stack(seen, "position_B_P")
        far = np.linalg.norm(track - at.position_m, axis=1)
        allowed = 2.0 * speed_m_s * braking_s / 2 + speed_m_s * self.stop_s + 0.5 * self.track_m
        assert far.max() < allowed, f"it went {far.max() * 1e3:.1f} mm on; {allowed * 1e3:.1f} mm are allowed"
        moving = stamps[np.linalg.norm(track - track[-1], axis=1) > 5e-4]
        if len(moving):
            lasted = moving[-1] - (stamps[0] - self.sample_s)
            assert lasted < 2 * braking_s + self.stop_s + rig.period_s, f"it moved {lasted:.3f} s on"
        after = stack(rig.hold(0.2), "position_B_P")
        assert np.linalg.norm(after - track[-1], axis=1).max() < 5e-4, "it does not stay"
        rig.rest(rig.period_s)

    def test_stops_without_a_motion_command(self) -> None:
        """A cycle without a motion brakes to rest."""
        rig = self.rig()
        self._stops(rig, self._moving(rig))

    def test_goes_on_after_a_stop_at_full_speed(self) -> None:
        """The next motion may begin where the arm came to rest, beyond its last setpoint."""
        rig = self.rig()
        self._moving(rig, rig.robot.limits.tcp_speed_m_s)
        at = rig.rest(0.5).pose_B_P.position_m
        rig.shift(np.array([0.0, -0.03, 0.0]))
        assert at[1] - rig.rest(0.2).position_B_P[-1][1] > 0.025

    def test_stops_on_hold(self) -> None:
        """`hold` may be called several times."""
        rig = self.rig()
        at = self._moving(rig)
        rig.robot.hold()
        rig.robot.hold()
        self._stops(rig, at)

    def test_holds_after_a_refused_command(self) -> None:
        """A command refused in motion brakes the arm."""
        rig = self.rig()
        at = self._moving(rig)
        bad = JointSetpoint(rig.q * np.nan, rig.dq, np.zeros_like(rig.q), rig.kinematics.fk(rig.q))
        with pytest.raises(ParamError):
            rig.robot.cycle(Command(motion=bad))
        self._stops(rig, at)

    def test_leaving_by_an_exception_holds_and_closes(self) -> None:
        """Leaving the context manager by an exception holds and closes the robot."""
        with self.own() as rig, suppress(ZeroDivisionError), rig.robot:
            self._moving(rig)
            raise ZeroDivisionError
        with pytest.raises(BackendError):
            rig.robot.cycle(HOLD)
