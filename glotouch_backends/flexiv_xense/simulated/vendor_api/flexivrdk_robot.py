"""Stand-in for the vendor's `Robot` class of `flexivrdk` 1.9: its names, arguments, exceptions and blocking.

Only what the driver and the tests use. std::invalid_argument in the vendor's library is a ValueError here, logic_error
and runtime_error are a RuntimeError, a wrong length or type of an argument is a TypeError; NaN is accepted silently.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from glotouch_backends.flexiv_xense.simulated.arm import NOMINAL_STIFFNESS
from glotouch_backends.flexiv_xense.simulated.control_box import (
    BRAKES_S,
    CLEAR_CRITICAL_S,
    CLEAR_MINOR_S,
    CONNECT_S,
    PRIMITIVE_S,
    REQUEST_S,
    UNREACHABLE_S,
    ControlBox,
)
from glotouch_backends.flexiv_xense.simulated.vendor_api.checks import numbers, positive, within
from glotouch_backends.flexiv_xense.simulated.vendor_api.flexiv_types import (
    ArmReading,
    Mode,
    OperationalStatus,
    RobotEvent,
    RobotInfo,
    RobotStates,
)
from glotouch_bt.robot import Pose

SERIAL = re.compile(r"[A-Z][A-Za-z]*( ?[0-9]*[A-Za-z]*)?-[0-9]{6}")
CARTESIAN = Mode.NRT_CARTESIAN_MOTION_FORCE
FAULT_RAD = 0.02
"""A joint setpoint this far beyond its range is a fault. ASSUMED."""
Numbers = Sequence[float]


class Robot:
    """The arm."""

    _boxes: ClassVar[dict[str, ControlBox]] = {}

    def __init__(
        self, robot_sn: str, network_interface_whitelist: Sequence[str] = (), verbose: bool = True, lite: bool = False
    ) -> None:
        if not isinstance(robot_sn, str):
            raise TypeError(f"incompatible constructor arguments: robot_sn = {robot_sn!r}")
        box = self._boxes.get(robot_sn.replace(" ", ""))
        if box is None and SERIAL.fullmatch(robot_sn) is None:
            raise ValueError(f"[flexiv::rdk] invalid serial number {robot_sn!r}")
        if box is None or not box.linked:
            for any_box in self._boxes.values():
                any_box.clock.sleep_until(any_box.clock.now_s() + UNREACHABLE_S)
                break
            raise RuntimeError(f"[flexiv::rdk] robot {robot_sn} not found")
        box.clock.sleep_until(box.clock.now_s() + CONNECT_S)
        self._box = box
        box.events.clear()
        box.zeroed = False
        box.arm.find_link()
        self._kept: RobotStates | None = None

    # --- status: does not block ---------------------------------------------------------------------------------------

    def connected(self) -> bool:
        """Return True if the link is up."""
        return self._box.linked

    def fault(self) -> bool:
        """Return True if the robot has a fault."""
        return self._box.faulty

    def operational(self) -> bool:
        """Return True if it accepts commands."""
        return self._box.status() is OperationalStatus.READY

    def operational_status(self) -> OperationalStatus:
        """Return READY, or the reason why not."""
        return self._box.status()

    def mode(self) -> Mode:
        """Return the present control mode."""
        return self._box.mode

    def stopped(self) -> bool:
        """Return True if it stands still."""
        return self._box.arm.stopped

    def reduced(self) -> bool:
        """Return True if a safety input is active."""
        return self._box.reduced

    def recovery(self) -> bool:
        """Return True if a joint is beyond its limit."""
        return self._box.recovery

    def estop_released(self) -> bool:
        """Return True if the emergency stop is released."""
        return self._box.estop_released

    def event_log(self) -> list[RobotEvent]:
        """Return the events since this client connected, oldest first."""
        return [replace(e) for e in self._box.events]

    def info(self) -> RobotInfo:
        """Return general information."""
        d = self._box.arm.description
        return RobotInfo(
            serial_num=self._box.serial,
            software_ver="v3.11.1",
            model_name="Rizon4",
            license_type="Simulated",
            K_x_nom=NOMINAL_STIFFNESS.tolist(),
            q_min=[j.lower_rad for j in d.joints],
            q_max=[j.upper_rad for j in d.joints],
            has_FT_sensor=True,
        )

    def states(self) -> RobotStates:
        """Return the newest state; once the link is lost, always the last one."""
        box = self._box
        if self._kept is None or (box.linked and not box.frozen):
            self._kept = RobotStates._of(
                ArmReading(box.arm.sample, box.arm.sensors, box.arm.load, box.arm.description.gripper.pose_E_P)
            )
        return self._kept

    # --- enabling and stopping: these block ---------------------------------------------------------------------------

    def Enable(self) -> None:
        """Start releasing the brakes; return before they are released."""
        box = self._box
        box.wait(REQUEST_S)
        if not box.estop_released:
            raise RuntimeError("[flexiv::rdk] the emergency stop is not released")
        if not box.enabled and not box.faulty:
            box.enabled, box.brakes_done_s = True, box.clock.now_s() + BRAKES_S

    def ClearFault(self, timeout_sec: int = 30) -> bool:
        """Try to clear the fault."""
        box = self._box
        if not isinstance(timeout_sec, int):
            raise TypeError(f"incompatible function arguments: timeout_sec = {timeout_sec!r}")
        needed = CLEAR_CRITICAL_S if box.critical else CLEAR_MINOR_S
        box.wait(min(needed, timeout_sec))
        if needed <= timeout_sec:
            box.faulty = box.critical = False
        return not box.faulty

    def Stop(self) -> None:
        """Brake to standstill and enter IDLE."""
        box = self._box
        box.need_link()
        box.stand_still()
        box.finish_primitive()
        box.arm.limit_wrench(None)
        box.mode = Mode.IDLE

    def SwitchMode(self, mode: Mode) -> None:
        """Stop and enter a mode."""
        if not isinstance(mode, Mode):
            raise TypeError(f"incompatible function arguments: mode = {mode!r}")
        self._box.switch(mode)

    # --- primitives -------------------------------------------------------------------------------------------------

    def ExecutePrimitive(
        self, primitive_name: str, input_params: Mapping[str, object], block_until_started: bool = True
    ) -> None:
        """Start a primitive; only ZeroFTSensor is simulated."""
        if not isinstance(primitive_name, str) or not isinstance(input_params, Mapping):
            raise TypeError(f"incompatible function arguments: {primitive_name!r}, {input_params!r}")
        box = self._box
        box.need_mode(Mode.NRT_PRIMITIVE_EXECUTION)
        box.need_ready()
        if primitive_name != "ZeroFTSensor":
            raise RuntimeError(f"[flexiv::rdk] primitive {primitive_name} is not simulated")
        seconds = float(numbers("dataCollectTime", [input_params.get("dataCollectTime", 0.2)])[0])
        if not 0.1 <= seconds <= 1.0:
            raise RuntimeError(f"[flexiv::rdk] dataCollectTime {seconds} is outside 0.1 .. 1.0")
        box.wait(PRIMITIVE_S if block_until_started else REQUEST_S)
        box.start_primitive(seconds)

    def primitive_states(self) -> dict[str, int | float]:
        """Return the states of the running primitive."""
        box = self._box
        box.wait(REQUEST_S)
        started = box.primitive_started_s
        period = 0.0 if started is None else box.clock.now_s() - started
        return {"terminated": int(box.primitive_done()), "timePeriod": period}

    # --- streaming: neither blocks ----------------------------------------------------------------------------------

    def SendCartesianMotionForce(
        self,
        pose: Numbers,
        wrench: Numbers = (0.0,) * 6,
        velocity: Numbers = (0.0,) * 6,
        max_linear_vel: float = 0.5,
        max_angular_vel: float = 1.0,
        max_linear_acc: float = 2.0,
        max_angular_acc: float = 5.0,
    ) -> None:
        """Send a Cartesian setpoint; without a force axis the wrench has no effect."""
        box = self._box
        place, twist = numbers("pose", pose, 7), numbers("velocity", velocity, 6)
        numbers("wrench", wrench, 6)
        limits = numbers("limits", [max_linear_vel, max_angular_vel, max_linear_acc, max_angular_acc])
        positive("limits", limits)
        box.need_mode(CARTESIAN)
        box.need_ready()
        if not bool(np.isfinite(place).all() and np.isfinite(twist).all()):
            box.fail(200001, "the commanded pose is not a number", critical=True)
            return
        length = float(np.linalg.norm(place[3:]))
        if abs(length - 1.0) > 1e-2:
            raise ValueError("[flexiv::rdk] the quaternion is not a unit one")
        linear_vel, angular_vel, linear_acc, angular_acc = limits.tolist()
        goal = Pose(place[:3], place[3:] / length)
        if not box.arm.go_to_pose(goal, twist, (linear_vel, angular_vel, linear_acc, angular_acc)):
            box.fail(200002, "the commanded pose is out of reach")
            return
        q, joints = box.arm.trajectory.goal_q, box.arm.description.joints
        if not bool(np.isfinite(q).all()):
            box.fail(200001, "the commanded joint position is not a number", critical=True)
        elif any(not j.lower_rad - FAULT_RAD <= v <= j.upper_rad + FAULT_RAD for j, v in zip(joints, q, strict=True)):
            box.fail(200003, "the commanded joint position is beyond a joint's range")

    # --- settings: these block --------------------------------------------------------------------------------------

    def SetForceControlAxis(self, enabled_axes: Sequence[bool], max_linear_vel: Numbers = (1.0, 1.0, 1.0)) -> None:
        """Accept only pure motion control: all axes off."""
        axes = list(enabled_axes)
        if len(axes) != 6 or not all(isinstance(a, bool | np.bool_) for a in axes):
            raise TypeError(f"incompatible function arguments: enabled_axes = {enabled_axes!r}")
        within("max_linear_vel", numbers("max_linear_vel", max_linear_vel, 3), 0.005, 2.0)
        self._box.need_mode(CARTESIAN)
        self._box.wait(REQUEST_S)
        if any(axes):
            raise RuntimeError("[flexiv::rdk] force control is not simulated")

    def SetCartesianImpedance(self, K_x: Numbers, Z_x: Numbers = (0.7,) * 6) -> None:
        """Check the values; they have no effect, as the simulated arm is always as stiff as the MuJoCo backend's."""
        within("K_x", numbers("K_x", K_x, 6), 0.0, NOMINAL_STIFFNESS)
        within("Z_x", numbers("Z_x", Z_x, 6), 0.3, 0.8)
        self._box.need_mode(CARTESIAN)
        self._box.wait(REQUEST_S)

    def SetMaxContactWrench(self, max_wrench: Numbers) -> None:
        """Bound the contact wrench; an infinite value removes the bound."""
        most = within("max_wrench", numbers("max_wrench", max_wrench, 6), 0.0, np.inf)
        self._box.need_mode(CARTESIAN)
        self._box.wait(REQUEST_S)
        self._box.arm.limit_wrench(None if bool(np.isinf(most).all()) else most)

    def SetNullSpacePosture(self, ref_positions: Numbers) -> None:
        """Pull the redundant joint to a posture until the mode is entered again."""
        box = self._box
        joints = box.arm.description.joints
        q = numbers("ref_positions", ref_positions)
        if len(q) != len(joints):
            raise ValueError(f"[flexiv::rdk] [ref_positions] must have {len(joints)} items")
        within("ref_positions", q, np.array([j.lower_rad for j in joints]), np.array([j.upper_rad for j in joints]))
        box.need_mode(CARTESIAN)
        box.wait(REQUEST_S)
        box.arm.reference_q = q
