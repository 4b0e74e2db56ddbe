"""Adapter of flexivrdk 2.0: all calls name a joint group; ours is ARMS, a single arm."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .arm import ArmState, DriverArm


class Arm20(DriverArm):
    """See `DriverArm`."""

    api = "2.0"

    @property
    def _group(self) -> Any:
        return self.rdk.JointGroup.ARMS

    def state(self) -> ArmState:
        """See `DriverArm`."""
        s: Any = self.robot.states()[self._group]
        wrench = s.raw_tcp_wrench_local if self._raw else s.tcp_wrench_local
        return ArmState(s.timestamp, s.q, s.dq, s.tcp_pose, wrench)

    def _send(self, pose: Sequence[float], twist: Sequence[float]) -> None:
        command = self.rdk.NrtCartesianCmd()
        command.pose_d, command.twist_d = list(pose), list(twist)
        (
            command.max_linear_vel,
            command.max_angular_vel,
            command.max_linear_acc,
            command.max_angular_acc,
        ) = self._speed_limits
        self.robot.SendCartesianMotionForce({self._group: command})

    def _zero_sensor(self, duration_s: float) -> None:
        args = self.rdk.PrimitiveArgs("ZeroFTSensor", {"dataCollectTime": duration_s})
        self.robot.ExecutePrimitive({self._group: args})

    def _primitive_ended(self) -> bool:
        return bool(self.robot.primitive_states()[self._group].names_and_values.get("terminated", 0))

    def _configure_motion(self, stiffness: list[float], posture: list[float], wrench: list[float]) -> None:
        group = self._group
        self.robot.SetForceControlAxis(group, [False] * 6)
        self.robot.SetCartesianImpedance(group, stiffness)
        self.robot.SetNullSpacePosture(group, posture)
        self.robot.SetMaxContactWrench(group, wrench)
