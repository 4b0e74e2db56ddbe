"""State of the simulated control box: modes, permissions, faults and the event log."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np

from glotouch_backends.flexiv_xense.driver import Clock
from glotouch_backends.flexiv_xense.simulated.arm import FLANGE, Load, SimulatedArm
from glotouch_backends.flexiv_xense.simulated.vendor_api import (
    EPOCH_S,
    Mode,
    OperationalStatus,
    RobotEvent,
    RobotEvent_Level,
    ToolParams,
)
from glotouch_bt.robot import Pose

# All durations are ASSUMED: the vendor documents only that these calls block, and "a few seconds" for the brakes.
CONNECT_S = 0.5
"""Duration of connecting to an arm."""
UNREACHABLE_S = 3.1
"""Time until an unreachable arm is reported."""
REQUEST_S = 0.005
"""Duration of a short request."""
BRAKES_S = 2.0
"""Duration of releasing the brakes."""
SWITCH_S = 0.05
"""Duration of switching the mode or the tool."""
PRIMITIVE_S = 0.1
"""Duration of starting a primitive."""
CLEAR_MINOR_S = 1.0
"""Duration of clearing a minor fault."""
CLEAR_CRITICAL_S = 10.0
"""Duration of clearing a critical fault."""
POLL_S = 0.001
"""Interval between two checks while waiting."""
UNLICENSED = (Mode.NRT_PLAN_EXECUTION, Mode.NRT_SUPER_PRIMITIVE)
NOT_ZEROED = 301004
"""Event when the force sensor was not zeroed. Source: user reports of a Rizon 4s; the text is ours."""


class ControlBox:
    """One arm's control box.

    Args:
        serial: Serial number.
        arm: The arm.
        clock: What blocking calls wait on.
    """

    def __init__(self, serial: str, arm: SimulatedArm, clock: Clock) -> None:
        self.serial, self.arm, self.clock = serial, arm, clock
        self.mode = Mode.IDLE
        self.linked = True
        self.enabled = False
        self.estop_released = True
        self.reduced = False
        self.recovery = False
        self.critical = False
        self.zeroed = False
        self.frozen = False
        self.brakes_done_s = 0.0
        self.tools: dict[str, ToolParams] = {"Flange": _flange()}
        self.tool = "Flange"
        self.events: list[RobotEvent] = []
        self.primitive_started_s: float | None = None
        self.primitive_s = 0.0
        self.faulty = False

    # --- status -----------------------------------------------------------------------------------------------------

    def status(self) -> OperationalStatus:
        """Return READY, or the reason why not."""
        if self.faulty:
            return OperationalStatus.CRITICAL_FAULT if self.critical else OperationalStatus.MINOR_FAULT
        if not self.estop_released:
            return OperationalStatus.ESTOP_NOT_RELEASED
        if self.recovery:
            return OperationalStatus.IN_RECOVERY_STATE
        if self.reduced:
            return OperationalStatus.IN_REDUCED_STATE
        if not self.enabled:
            return OperationalStatus.NOT_ENABLED
        if self.clock.now_s() < self.brakes_done_s:
            return OperationalStatus.RELEASING_BRAKE
        return OperationalStatus.READY

    def log(self, level: RobotEvent_Level, number: int, description: str, advice: str = "") -> None:
        """Append an event to the log."""
        stamp = datetime.fromtimestamp(EPOCH_S + self.clock.now_s(), UTC).replace(tzinfo=None)
        self.events.append(
            RobotEvent(
                level=level,
                id=number,
                description=description,
                consequences="the robot has stopped" if level is not RobotEvent_Level.INFO else "none",
                recommended_actions=advice,
                timestamp=stamp,
            )
        )

    def fail(self, number: int, description: str, *, critical: bool = False) -> None:
        """Set a fault: the arm stops and accepts no command until the fault is cleared."""
        level = RobotEvent_Level.CRITICAL if critical else RobotEvent_Level.ERROR
        self.log(level, number, description, "clear the fault")
        self.faulty, self.critical = True, critical
        self.halt()

    def halt(self) -> None:
        """Brake at once in any mode."""
        self.arm.brake()
        self.arm.limit_wrench(None)
        self.mode = Mode.IDLE
        self.primitive_started_s = None

    def leave(self) -> None:
        """End the client's requests; the arm brakes once the loss is noticed."""
        self.mode = Mode.IDLE
        self.primitive_started_s = None
        self.arm.lose_link()

    # --- requests ---------------------------------------------------------------------------------------------------

    def wait(self, seconds: float) -> None:
        """Block the caller for a time.

        Raises:
            RuntimeError: The link is lost, before or after the wait.
        """
        self.need_link()
        self.clock.sleep_until(self.clock.now_s() + seconds)
        self.need_link()

    def need_link(self) -> None:
        """Raise RuntimeError if the link is lost."""
        if not self.linked:
            raise RuntimeError("[flexiv::rdk] failed to deliver the request to the connected robot")

    def need_mode(self, *modes: Mode) -> None:
        """Raise RuntimeError (the vendor's logic_error) if the robot is in none of these modes."""
        self.need_link()
        if self.mode not in modes:
            names = ", ".join(m.name for m in modes)
            raise RuntimeError(f"[flexiv::rdk] robot is in mode {self.mode.name}, the call needs {names}")

    def need_ready(self) -> None:
        """Raise RuntimeError if the robot is not operational."""
        self.need_link()
        if self.status() is not OperationalStatus.READY:
            raise RuntimeError(f"[flexiv::rdk] robot is not operational: {self.status().name}")

    def stand_still(self) -> None:
        """Brake if the arm moves, and wait for standstill."""
        if not self.arm.trajectory.at_rest:
            self.arm.brake()
        while not self.arm.stopped:
            self.wait(POLL_S)

    def switch(self, mode: Mode) -> None:
        """Stop and change the mode."""
        if mode is Mode.UNKNOWN or mode in UNLICENSED:
            raise ValueError(f"[flexiv::rdk] requested mode {mode.name} is invalid or unlicensed")
        self.need_ready()
        self.stand_still()
        self.finish_primitive()
        self.wait(SWITCH_S)
        self.need_ready()
        if mode is Mode.NRT_CARTESIAN_MOTION_FORCE and not self.zeroed:
            self.fail(NOT_ZEROED, "the force sensor has not been zeroed since this client connected")
            raise RuntimeError(f"[flexiv::rdk] failed to switch to {mode.name}")
        self.mode = mode
        self.arm.limit_wrench(None)
        self.arm.reference_q = self.arm.trajectory.q.copy()

    def use_tool(self, name: str) -> None:
        """Make a tool the current one."""
        self.tool = name
        params = self.tools[name]
        self.arm.set_load(FLANGE if name == "Flange" else load_of(params))

    def start_primitive(self, seconds: float) -> None:
        """Start zeroing the force sensor."""
        self.arm.begin_zeroing()
        self.primitive_started_s, self.primitive_s = self.clock.now_s(), seconds

    def primitive_done(self) -> bool:
        """Return True once the zeroing's time has passed, and end it."""
        if self.primitive_started_s is None:
            return self.zeroed
        if self.clock.now_s() - self.primitive_started_s < self.primitive_s - 1e-9:
            return False
        self.finish_primitive()
        return True

    def finish_primitive(self) -> None:
        """End a running zeroing."""
        if self.primitive_started_s is not None:
            self.arm.end_zeroing()
            self.primitive_started_s = None
            self.zeroed = True


def _flange() -> ToolParams:
    params = ToolParams()
    params.tcp_location = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    return params


def load_of(params: ToolParams) -> Load:
    """Return tool parameters as a load of the arm."""
    place = np.array(params.tcp_location)
    return Load(float(params.mass), np.array(params.CoM), Pose(place[:3], place[3:]))
