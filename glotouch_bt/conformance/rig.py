"""Motions and measurements that the tests share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from glotouch_bt.motion import Kinematics, Line, ProfileLimits, plan_piece
from glotouch_bt.robot import HOLD, Array, Command, JointSetpoint, Observation, Pose, Request, Robot

MAX_REQUEST_S = 10.0
"""Longest wait for a request."""


@dataclass(frozen=True)
class Wall:
    """A plane that the bare hand can touch from free space.

    Attributes:
        point_B_m: (3,) any point of it.
        normal_B: (3,) unit normal into free space.
        tip_P_m: (3,) point of the hand that touches it, in P.
        tolerance_m: Uncertainty of the plane.
        start_B_P: Pose of P at the start of the approach; free space lies between.
    """

    point_B_m: Array
    normal_B: Array
    tip_P_m: Array
    tolerance_m: float
    start_B_P: Pose

    def gap_m(self, pose_B_P: Pose) -> float:
        """Return the distance from the hand's point to the plane; negative behind it."""
        return float((pose_B_P.apply(self.tip_P_m) - self.point_B_m) @ self.normal_B)


class Rig:
    """A robot with its last setpoint and everything it sensed.

    Args:
        robot: At rest.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.kinematics = Kinematics(robot.description)
        self.seen: list[Observation] = [robot.observe()]
        self.q: Array = np.array(self.last.q[-1])
        self.dq: Array = np.zeros_like(self.q)
        k = self.kinematics
        inside = (self.q > k.lower - 0.05) & (self.q < k.upper + 0.05)
        assert inside.all(), f"q = {self.q.round(3).tolist()} is outside the joints' ranges; is it in rad?"

    @property
    def last(self) -> Observation:
        """The newest block."""
        return self.seen[-1]

    @property
    def period_s(self) -> float:
        """Control period."""
        return self.robot.period_s

    def cycle(self, command: Command = HOLD) -> Observation:
        """Run one control period."""
        self.seen.append(self.robot.cycle(command))
        return self.last

    def hold(self, duration_s: float, *, tactile: bool = False) -> list[Observation]:
        """Run periods without a motion; return their blocks."""
        command = Command(tactile=tactile)
        return [self.cycle(command) for _ in range(max(1, round(duration_s / self.period_s)))]

    def send(self, setpoint: JointSetpoint) -> Observation:
        """Send one setpoint."""
        observation = self.cycle(Command(motion=setpoint))
        self.q, self.dq = np.array(setpoint.q), np.array(setpoint.dq)
        return observation

    def go(
        self, goal_B_P: Pose, speed_m_s: float = 0.1, until: Callable[[Observation], bool] | None = None
    ) -> list[tuple[JointSetpoint, Observation]]:
        """Move P straight to a pose in B; stop sending at full speed when `until` returns True."""
        limits = self.robot.limits
        track: list[tuple[JointSetpoint, Observation]] = []
        piece = Line(self.kinematics.fk(self.q), goal_B_P)
        if piece.length_m < 1e-5:
            return track
        plan = plan_piece(
            self.kinematics,
            piece,
            self.q,
            limits=ProfileLimits(speed_m_s, limits.tcp_acceleration_m_s2, limits.tcp_jerk_m_s3),
            period_s=self.period_s,
            posture_gain=0.0,
            what="conformance",
        )
        for setpoint in map(plan.setpoint, range(len(plan))):
            track.append((setpoint, self.send(setpoint)))
            if until is not None and until(self.last):
                break
        return track

    def shift(self, displacement_B_m: Array, speed_m_s: float = 0.1) -> list[tuple[JointSetpoint, Observation]]:
        """Move P straight by a displacement (3,) in B."""
        here = self.kinematics.fk(self.q)
        return self.go(Pose(here.position_m + displacement_B_m, here.quat), speed_m_s)

    def tilt(self, angle_rad: float) -> Pose:
        """Return the last commanded pose of P, turned by an angle about its own x axis."""
        half = 0.5 * angle_rad
        turn = Pose(np.zeros(3), np.array([np.cos(half), np.sin(half), 0.0, 0.0]))
        return self.kinematics.fk(self.q) @ turn

    def rest(self, duration_s: float = 0.5) -> Observation:
        """Hold for a while; the next motion starts from the measured joints."""
        self.hold(duration_s)
        self.q, self.dq = np.array(self.last.q[-1]), np.zeros_like(self.q)
        return self.last

    def ask(self, request: Request, wait_s: float = MAX_REQUEST_S) -> int:
        """Start a request, cycle until it is done, and return the number of periods."""
        before = self.robot.observe().now_s
        ticket = self.robot.start(request)
        assert self.robot.observe().now_s == before, "starting a request may not block"
        for n in range(round(wait_s / self.period_s)):
            if ticket.done:
                assert ticket.error is None, f"{request} failed: {ticket.error}"
                self.rest(self.period_s)
                return n
            self.cycle()
        raise AssertionError(f"{request} was not done after {wait_s} s")

    def mean_wrench(self, duration_s: float = 0.3) -> Array:
        """Return the mean wrench (6,) at rest."""
        return np.asarray(np.concatenate([o.wrench_S for o in self.hold(duration_s)]).mean(axis=0))


def stack(observations: list[Observation], name: str) -> Array:
    """Concatenate one field of all blocks."""
    return np.concatenate([np.asarray(getattr(o, name), dtype=np.float64) for o in observations])
