"""Adapter of flexivrdk 1.9: flat arguments, one arm."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .arm import ArmState, DriverArm

NO_WRENCH = [0.0] * 6


class Arm19(DriverArm):
    """See `DriverArm`."""

    api = "1.9"

    def state(self) -> ArmState:
        """See `DriverArm`."""
        s: Any = self.robot.states()
        wrench = s.ext_wrench_in_tcp_raw if self._raw else s.ext_wrench_in_tcp
        return ArmState(s.timestamp, s.q, s.dq, s.tcp_pose, wrench)

    def _send(self, pose: Sequence[float], twist: Sequence[float]) -> None:
        self.robot.SendCartesianMotionForce(list(pose), NO_WRENCH, list(twist), *self._speed_limits)

    def _zero_sensor(self, duration_s: float) -> None:
        self.robot.ExecutePrimitive("ZeroFTSensor", {"dataCollectTime": duration_s})

    def _primitive_ended(self) -> bool:
        return bool(self.robot.primitive_states().get("terminated", 0))

    def _configure_motion(self, stiffness: list[float], posture: list[float], wrench: list[float]) -> None:
        self.robot.SetForceControlAxis([False] * 6)
        self.robot.SetCartesianImpedance(stiffness)
        self.robot.SetNullSpacePosture(posture)
        self.robot.SetMaxContactWrench(wrench)
