"""A vendor without physics, for tests of the driver alone: the arm is where the last pose says.

Only what the driver uses, with the vendor's names (flexivrdk 1.9). Tests switch on faults, silence and losses.
"""

from __future__ import annotations

from enum import Enum
from types import SimpleNamespace
from typing import Any

import numpy as np

from glotouch_backends.flexiv_xense.driver.clock import SteppedClock, WallClock
from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.robot.fake import forward


class Mode(Enum):
    UNKNOWN = 0
    IDLE = 1
    NRT_PRIMITIVE_EXECUTION = 8
    NRT_CARTESIAN_MOTION_FORCE = 10


class Status(Enum):
    READY = 1
    MINOR_FAULT = 6


class ToolParams:
    def __init__(self) -> None:
        self.mass, self.CoM, self.inertia, self.tcp_location = 0.0, [0.0] * 3, [0.0] * 6, [0.0] * 7


class ScriptedVendor:
    """All devices in one.

    Attributes:
        calls: Names of all calls to the arm but `states` and the flags, in order.
        sent: (pose, twist) of every Cartesian command.
        wrench: What the arm reports, TCP frame.
        flags: connected, fault, operational, reduced, recovery, estop_released.
    """

    def __init__(self, *, stepped: bool = True, zero_s: float | None = None) -> None:
        self.time_s = 0.0
        self.clock: Any = SteppedClock(self._advance) if stepped else WallClock(zero_s)
        self.calls: list[str] = []
        self.sent: list[tuple[list[float], list[float]]] = []
        self.mode = Mode.IDLE
        home = forward(RIZON4_XENSE, RIZON4_XENSE.home_q)
        self.pose = [*home.position_m.tolist(), *home.quat.tolist()]
        self.wrench = [0.0] * 6
        self.flags = dict(connected=True, fault=False, operational=True, reduced=False, recovery=False)
        self.flags["estop_released"] = True
        self.frozen = False
        self.broken: dict[str, Exception] = {}
        self.slow_s: dict[str, float] = {"SwitchMode": 0.05, "Stop": 0.05}
        self.events: list[Any] = []
        self.zeroed_at_s = -1.0
        self._stamp = 0.0
        self.gripper = ScriptedGripper(self)
        self.sensors: list[ScriptedSensor] = []
        vendor = self

        class Robot(ScriptedRobot):
            def __init__(self, serial: str, network: list[str], verbose: bool) -> None:
                vendor.call("Robot")
                super().__init__(vendor)

        self.flexivrdk = SimpleNamespace(
            __version__="1.9.4.1", Robot=Robot, Tool=ScriptedTool, ToolParams=ToolParams, Mode=Mode
        )
        types = Enum("OutputType", {"Rectify": 1, "Depth": 3, "TimeStamp": 17})
        self.xensesdk = SimpleNamespace(Sensor=SimpleNamespace(OutputType=types, create=self._sensor))
        self.xensegripper = SimpleNamespace(XenseGripper=SimpleNamespace(create=lambda address: self.gripper))

    def _advance(self, stamp_s: float) -> None:
        self.time_s = stamp_s

    def _sensor(self, serial: str) -> ScriptedSensor:
        self.sensors.append(ScriptedSensor(self))
        return self.sensors[-1]

    def call(self, name: str) -> None:
        self.calls.append(name)
        if name in self.broken:
            raise self.broken[name]
        if name in self.slow_s:
            self.clock.sleep_until(self.clock.now_s() + self.slow_s[name])

    def stamp(self) -> tuple[int, int]:
        if not self.frozen:
            self._stamp = self.clock.now_s()
        return int(self._stamp), round((self._stamp % 1.0) * 1e9)


class ScriptedRobot:
    def __init__(self, vendor: ScriptedVendor) -> None:
        self._vendor = vendor

    def __getattr__(self, name: str) -> Any:
        vendor = self._vendor
        if name in vendor.flags:
            return lambda: vendor.flags[name]
        return lambda *arguments: vendor.call(name)

    def info(self) -> Any:
        joints = RIZON4_XENSE.joints
        return SimpleNamespace(
            model_name="Rizon4",
            serial_num="Rizon4-000000",
            software_ver="scripted",
            license_type="none",
            has_FT_sensor=True,
            K_x_nom=[10000.0] * 3 + [1500.0] * 3,
            q_min=[j.lower_rad for j in joints],
            q_max=[j.upper_rad for j in joints],
        )

    def states(self) -> Any:
        v = self._vendor
        if "states" in v.broken:
            raise v.broken["states"]
        return SimpleNamespace(
            timestamp=v.stamp(),
            q=list(RIZON4_XENSE.home_q),
            dq=[0.0] * 7,
            tcp_pose=list(v.pose),
            ext_wrench_in_tcp=[0.0] * 6,
            ext_wrench_in_tcp_raw=list(v.wrench),
        )

    def operational_status(self) -> Status:
        return Status.MINOR_FAULT if self._vendor.flags["fault"] else Status.READY

    def event_log(self) -> list[Any]:
        return self._vendor.events

    def ClearFault(self, timeout_sec: int = 30) -> bool:
        self._vendor.call("ClearFault")
        self._vendor.flags["fault"] = False
        return True

    def Enable(self) -> None:
        self._vendor.call("Enable")
        self._vendor.flags["operational"] = True

    def SwitchMode(self, mode: Mode) -> None:
        self._vendor.call("SwitchMode")
        self._vendor.calls[-1] = mode.name
        self._vendor.mode = mode

    def Stop(self) -> None:
        self._vendor.call("Stop")
        self._vendor.mode = Mode.IDLE

    def ExecutePrimitive(self, name: str, params: dict[str, float]) -> None:
        self._vendor.call("ExecutePrimitive")
        self._vendor.calls[-1] = name
        self._vendor.zeroed_at_s = self._vendor.clock.now_s() + params["dataCollectTime"]

    def primitive_states(self) -> dict[str, int]:
        return {"terminated": int(self._vendor.clock.now_s() >= self._vendor.zeroed_at_s)}

    def SendCartesianMotionForce(self, pose: list[float], wrench: list[float], twist: list[float], *_: float) -> None:
        v = self._vendor
        if "SendCartesianMotionForce" in v.broken:
            raise v.broken["SendCartesianMotionForce"]
        if v.mode is not Mode.NRT_CARTESIAN_MOTION_FORCE:
            raise RuntimeError("wrong mode")
        v.pose = list(pose)
        v.sent.append((list(pose), list(twist)))


class ScriptedTool:
    def __init__(self, robot: ScriptedRobot) -> None:
        self._vendor = robot._vendor
        self.known: dict[str, ToolParams] = {}

    def exist(self, name: str) -> bool:
        return name in self.known

    def Add(self, name: str, params: ToolParams) -> None:
        self._vendor.call("Tool.Add")
        self.known[name] = params

    def Update(self, name: str, params: ToolParams) -> None:
        self._vendor.call(f"Tool.Update {params.mass:.3f}")
        self.known[name] = params

    def Switch(self, name: str) -> None:
        assert self._vendor.mode is Mode.IDLE
        self._vendor.call("Tool.Switch")


class ScriptedGripper:
    """Moves 0.5 mm towards its target at every read; `dead` repeats the last status for ever."""

    def __init__(self, vendor: ScriptedVendor) -> None:
        self._vendor = vendor
        self.position, self.target, self.dead, self.released = 40.0, 40.0, False, False
        self.asked: list[tuple[float, float, float]] = []
        self._status = self._now(0.0)

    def _now(self, moved: float) -> dict[str, float]:
        return {"position": self.position, "velocity": 100.0 * moved, "force": 0.0, "temperature": 30.0}

    def set_position(self, position: float, vmax: float = 80, fmax: float = 27) -> None:
        self.asked.append((position, vmax, fmax))
        self.target = position

    def get_gripper_status(self) -> dict[str, float]:
        if not self.dead:
            step = float(np.clip(self.target - self.position, -0.5, 0.5))
            self.position += step
            self._status = self._now(step)
        return self._status

    def release(self) -> None:
        self.released = True


IMAGE_MM = 1e-3 * np.arange(700)[:, None] + 1e-6 * np.arange(400)

PICTURE = np.zeros((700, 400, 3), dtype=np.uint8) + np.array([1, 2, 3], dtype=np.uint8)
PICTURE[:, 200:, 2] = 50  # more red in the right half


class ScriptedSensor:
    """30 frames a second; row and column of a pixel are in its value."""

    def __init__(self, vendor: ScriptedVendor) -> None:
        self._vendor = vendor
        self.silent = self.released = False

    def calibrateSensor(self) -> None:
        pass

    def selectSensorInfo(self, *types: Any) -> Any:
        if self.silent:
            return (None,) * len(types)
        stamp = np.floor(self._vendor.clock.now_s() * 30.0) / 30.0
        given = {"Rectify": PICTURE, "Depth": IMAGE_MM, "TimeStamp": stamp}
        return tuple(given[kind.name] for kind in types)

    def release(self) -> None:
        self.released = True
