"""The dictionary interface of flexivrdk 2.0 behind the same adapter."""

from __future__ import annotations

from enum import Enum
from types import SimpleNamespace
from typing import Any

import pytest

from glotouch_backends.flexiv_xense.client.backend import FlexivXenseBackend
from glotouch_backends.flexiv_xense.client.options import read_options
from glotouch_backends.flexiv_xense.driver.devices.arm_20 import Arm20
from glotouch_backends.flexiv_xense.driver.messages import Setpoint
from tests.backends.flexiv_xense.scripted import Mode, ScriptedVendor


class JointGroup(Enum):
    ARMS = 2


class Command:
    pass


class Robot20:
    """Records every call with its arguments."""

    def __init__(self, vendor: ScriptedVendor, old: Any) -> None:
        self._vendor, self._old, self.calls = vendor, old, list[tuple[str, tuple[Any, ...]]]()

    def __getattr__(self, name: str) -> Any:
        if name in self._vendor.flags or name in ("info", "event_log", "operational_status"):
            return getattr(self._old, name)
        return lambda *arguments: self.calls.append((name, arguments))

    def states(self) -> dict[JointGroup, Any]:
        s = self._old.states()
        return {
            JointGroup.ARMS: SimpleNamespace(
                timestamp=s.timestamp, q=s.q, dq=s.dq, tcp_pose=s.tcp_pose,
                tcp_wrench_local=[1.0] * 6, raw_tcp_wrench_local=[2.0] * 6,
            )
        }  # fmt: skip

    def primitive_states(self) -> dict[JointGroup, Any]:
        return {JointGroup.ARMS: SimpleNamespace(names_and_values={"terminated": 1})}


@pytest.fixture
def arm() -> Arm20:
    vendor = ScriptedVendor()
    old = vendor.flexivrdk.Robot("Rizon4-000000", [], False)
    rdk = SimpleNamespace(
        JointGroup=JointGroup, Mode=Mode, NrtCartesianCmd=Command, PrimitiveArgs=lambda name, values: (name, values)
    )
    request = FlexivXenseBackend()._request(*read_options({"devices": "simulated"}), "", 1, True)
    return Arm20(rdk, Robot20(vendor, old), vendor.clock, request)


def test_states_are_the_arms_group_and_raw(arm: Arm20) -> None:
    assert arm.state().wrench == [2.0] * 6


def test_a_setpoint_is_a_command_for_the_group(arm: Arm20) -> None:
    arm.send(Setpoint((0.0,) * 7, (0.0,) * 7, (0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0), (0.0, 0.1, 0.0, 0.0, 0.0, 0.0)))
    ((name, (commands,)),) = arm.robot.calls
    command = commands[JointGroup.ARMS]
    assert name == "SendCartesianMotionForce"
    assert command.pose_d == [0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0]
    assert command.twist_d == [0.0, 0.1, 0.0, 0.0, 0.0, 0.0]
    assert command.max_linear_vel >= 0.25


def test_zeroing_and_entering_name_the_group(arm: Arm20) -> None:
    arm.zero(0.2)
    arm.enter_motion()
    calls = dict(arm.robot.calls)
    assert calls["ExecutePrimitive"] == ({JointGroup.ARMS: ("ZeroFTSensor", {"dataCollectTime": 0.2})},)
    assert calls["SetForceControlAxis"] == (JointGroup.ARMS, [False] * 6)
    assert calls["SetMaxContactWrench"][1] == pytest.approx([1.05 * 28.5] * 3 + [1.05 * 9.69] * 3)
    assert [c for c, _ in arm.robot.calls][-1] == "SetMaxContactWrench"
