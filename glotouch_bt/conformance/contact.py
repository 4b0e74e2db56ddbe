"""Tests against a wall at a known place: a guarded move, and the hard limit below it."""

from __future__ import annotations

import numpy as np
import pytest

from glotouch_bt.conformance.base import Conformance
from glotouch_bt.conformance.rig import Rig, Wall, stack
from glotouch_bt.robot import Array, Command, JointSetpoint, Observation, Pose, SafetyStop, Tare

TOUCH_FORCE_N = 2.0
"""Force at which the guarded move has touched the wall."""
SPEED_M_S = 0.02
"""Speed of the guarded move."""
APPROACH_GAP_M = 0.008
"""Gap to the wall at which the guarded move starts."""
OVERTRAVEL_M = 0.05
"""Distance beyond the wall that is commanded."""


class ContactTests(Conformance):
    """Contact with a wall."""

    def _wall(self) -> Wall:
        wall = self.wall()
        if wall is None:
            pytest.skip("`wall` gives no wall")
        return wall

    def _approach(self, rig: Rig, wall: Wall) -> None:
        """Move near the wall, come to rest and tare."""
        rig.go(wall.start_B_P, 0.15)
        gap = wall.gap_m(rig.kinematics.fk(rig.q))
        rig.shift(-wall.normal_B * (gap - APPROACH_GAP_M), 0.1)
        rig.rest(0.3)
        rig.ask(Tare())

    @staticmethod
    def _felt_B(o: Observation, wall: Wall, rig: Rig) -> Array:
        """Return the force (n,) along the wall's normal, N, at every sample."""
        E_P = rig.robot.description.gripper.pose_E_P
        turns = [(Pose(p, q) @ E_P.inverse()).rotation for p, q in zip(o.position_B_P, o.quat_B_P, strict=True)]
        return np.array([(r @ w[:3]) @ wall.normal_B for r, w in zip(turns, o.wrench_S, strict=True)])

    def _until_touch(self, rig: Rig, wall: Wall) -> tuple[float, float]:
        """Approach until the guard trips in motion; return the gap there, m, and the largest force before, N."""
        before: list[float] = []

        def trips(o: Observation) -> bool:
            felt = self._felt_B(o, wall, rig)
            if (np.linalg.norm(o.wrench_S[:, :3], axis=1) > TOUCH_FORCE_N).any():
                return True
            before.append(float(np.abs(felt).max()))
            return False

        here = rig.kinematics.fk(rig.q)
        goal = Pose(here.position_m - wall.normal_B * (APPROACH_GAP_M + OVERTRAVEL_M), here.quat)
        rig.go(goal, SPEED_M_S, until=trips)
        return wall.gap_m(rig.last.pose_B_P), max(before[:-3], default=0.0)

    def test_a_guarded_move_stops_at_a_wall(self) -> None:
        """No force before the wall, a force out of the wall at it, in time; then the arm stands near it."""
        wall = self._wall()
        with self.own() as rig:
            self._approach(rig, wall)
            gap_m, before_N = self._until_touch(rig, wall)
            assert before_N < TOUCH_FORCE_N, "something was felt before the wall"
            assert abs(gap_m) < wall.tolerance_m + 0.002, f"felt {gap_m * 1e3:.1f} mm before the wall"
            felt = self._felt_B(rig.last, wall, rig)
            assert felt.max() > 0.8 * TOUCH_FORCE_N, "the hand must feel the wall pushing it back"
            assert felt.max() > -felt.min()
            seen = rig.hold(0.3)
            deepest = min(wall.gap_m(Pose(p, q)) for o in seen for p, q in zip(o.position_B_P, o.quat_B_P, strict=True))
            assert deepest > gap_m - 0.002, "it pressed on"
            force = np.linalg.norm(stack(seen, "wrench_S")[:, :3], axis=1)
            assert force.max() < rig.robot.limits.hard_force_N
            still = stack(seen[-10:], "position_B_P")
            assert np.linalg.norm(still - still[-1], axis=1).max() < 1e-3
            rig.rest(0.05)
            rig.shift(0.02 * wall.normal_B)
            assert np.linalg.norm(rig.mean_wrench()[:3]) < self.rest_force_N + 0.3, "the force stayed after parting"

    def test_the_hard_limit_stops_the_arm(self) -> None:
        """SafetyStop in this and every later cycle, whatever is commanded; the arm stands; hold never raises."""
        wall = self._wall()
        with self.own() as rig:
            self._approach(rig, wall)
            self._until_touch(rig, wall)
            here = rig.kinematics.fk(rig.q)
            with pytest.raises(SafetyStop) as stop:
                rig.go(Pose(here.position_m - 0.06 * wall.normal_B, here.quat), SPEED_M_S)
            assert stop.value.value > stop.value.limit
            at = rig.robot.observe().position_B_P[-1].copy()
            zero = np.zeros_like(rig.q)
            onward = JointSetpoint(rig.q, zero, zero, rig.kinematics.fk(rig.q))
            gaps = []
            for _ in range(30):
                with pytest.raises(SafetyStop):
                    rig.robot.cycle(Command(motion=onward))
                gaps.append(rig.robot.observe())
            rig.robot.hold()
            far = np.linalg.norm(stack(gaps[5:], "position_B_P") - at, axis=1)
            assert far.max() < 0.003, f"it moved {far.max() * 1e3:.1f} mm after the stop"
            peak = np.linalg.norm(stack([*rig.seen[-20:], *gaps], "wrench_S")[:, :3], axis=1).max()
            assert peak < 2.0 * rig.robot.limits.hard_force_N, f"{peak:.0f} N"
