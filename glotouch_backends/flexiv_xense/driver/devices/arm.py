"""The arm as the driver uses it: one interface over the vendor's incompatible versions.

Order of a session (vendor's documentation): connect, clear a fault, enable, wait until operational, switch the tool in
IDLE, zero the wrist sensor, enter Cartesian motion-force, stream. A tare returns to primitive mode, a payload to IDLE.
The sensor must be zeroed BEFORE Cartesian motion-force is entered; otherwise the arm raises event 301004.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from ..checks import MAX_TURN_RAD_S
from ..clock import Clock
from ..faults import DeviceFault, vendor_call
from ..messages import ArmEvent, Numbers, Open, Setpoint

TOOL_NAME = "glotouch"
"""Name of our tool in the arm's memory."""
CLEAR_FAULT_S = 30
"""Longest wait for clearing a fault. Source: vendor default."""
ENABLE_S = 30.0
"""Longest wait for the arm to become operational. Source: ours."""
TARE_WAIT_S = 5.0
"""Longest wait for a tare beyond its duration. Source: ours."""
MODE_POLL_S = 0.01
"""Interval between two checks while waiting."""
MAX_EVENTS = 12
"""Number of log entries attached to an error."""
MAX_ANGULAR_RAD_S2 = 40.0
"""Angular acceleration limit of the arm's own smoothing, far above the plan's 7.5 rad/s2: setpoints come 10 ms apart,
so a small error needs much acceleration. Source: measured; with 10 rad/s2 the simulated hand lagged by 0.1 rad."""
SMOOTHING_HEADROOM = 1.5
"""Limits of the arm's own smoothing over those of the plan; with 1 it could never catch up. Source: ours."""
DEVICE_WRENCH_SHARE = 1.05
"""The device's contact limit over the driver's: the driver stops the arm, the device bounds the peak. Source: ours."""


class ArmState(NamedTuple):
    """A reading: the device's stamp, q, dq (7,), TCP pose (7,) in B, wrench (6,) on the TCP in P."""

    stamp: object
    q: Sequence[float]
    dq: Sequence[float]
    pose: Sequence[float]
    wrench: Sequence[float]


class DriverArm(ABC):
    """A Flexiv arm; each subclass adapts one version of the vendor's interface.

    Args:
        rdk: The vendor's module.
        robot: Its `Robot`, connected.
        clock: Time.
        request: The client's request: tool, limits, posture (7,) of the null space, and settings.
    """

    api = ""

    def __init__(self, rdk: Any, robot: Any, clock: Clock, request: Open) -> None:
        self.rdk, self.robot, self.clock = rdk, robot, clock
        self._tool, self._limits, self._posture = request.tool, request.arm, list(request.posture)
        settings = request.devices.settings
        self._raw, self._feed_forward = settings.wrench == "raw", settings.feed_forward
        self._tools: Any = None
        with vendor_call("reading the arm's data", "connect"):
            self.info = robot.info()
        self._still = [0.0] * 6

    # -- what differs between the versions ---------------------------------------------------------------------------

    @abstractmethod
    def state(self) -> ArmState:
        """Return the newest reading without blocking."""

    @abstractmethod
    def _send(self, pose: Sequence[float], twist: Sequence[float]) -> None:
        """Send a Cartesian setpoint without blocking."""

    @abstractmethod
    def _zero_sensor(self, duration_s: float) -> None:
        """Start the primitive that zeroes the wrist sensor."""

    @abstractmethod
    def _primitive_ended(self) -> bool:
        """Return True once the primitive has ended."""

    @abstractmethod
    def _configure_motion(self, stiffness: list[float], posture: list[float], wrench: list[float]) -> None:
        """Configure Cartesian motion-force after entering it: no force axis, impedance, null space, contact limit."""

    # -- reading -----------------------------------------------------------------------------------------------------

    def check(self) -> None:
        """Check that the arm can move. Cheap: reads flags that the link keeps up to date.

        Raises:
            DeviceFault: link, fault or state, with the event log.
        """
        robot = self.robot
        with vendor_call("reading the arm's status", "link"):
            if not robot.connected():
                raise DeviceFault("link", "the arm is not connected any more", self.events())
            if robot.fault():
                raise DeviceFault("fault", f"the arm has a fault ({self._status()})", self.events())
            if robot.operational():
                return
            if robot.recovery():
                why = "is in recovery: a joint is beyond its limit; move it back by hand or by the vendor's recovery"
            elif robot.reduced():
                why = "is in reduced state: a safety input is active"
            elif not robot.estop_released():
                why = "has its emergency stop pressed"
            else:
                why = "is not operational"
            raise DeviceFault("state", f"the arm {why} ({self._status()})", self.events())

    def events(self) -> tuple[ArmEvent, ...]:
        """Return the last entries of the arm's event log; never raises."""
        try:
            log = list(self.robot.event_log())[-MAX_EVENTS:]
            return tuple(
                ArmEvent(
                    str(getattr(e.level, "name", e.level)), int(e.id), str(e.description), str(e.recommended_actions)
                )
                for e in log
            )
        except Exception:  # an unreadable log must not hide the fault
            return ()

    def _status(self) -> str:
        status = self.robot.operational_status()
        return str(getattr(status, "name", status))

    # -- coming up ---------------------------------------------------------------------------------------------------

    def enable(self, progress: Callable[[str], None]) -> None:
        """Clear a fault, release the brakes, and wait until the arm is operational; every wait is bounded.

        Raises:
            DeviceFault: The arm did not come up.
        """
        robot = self.robot
        with vendor_call("enabling the arm", "connect"):
            if robot.fault():
                progress("clearing the arm's fault")
                if not robot.ClearFault(CLEAR_FAULT_S):
                    raise DeviceFault("fault", f"the arm's fault cannot be cleared ({self._status()})", self.events())
            if not robot.operational():
                if not robot.estop_released():
                    raise DeviceFault("state", "the arm's emergency stop is pressed: release it", self.events())
                progress("enabling the arm, releasing brakes")
                robot.Enable()
                self._wait(robot.operational, ENABLE_S, "the arm to become operational")

    def ready(self, progress: Callable[[str], None]) -> None:
        """Switch to our tool, zero the wrist sensor, enter Cartesian motion-force."""
        progress("switching tool, zeroing the wrist sensor")
        self.idle()
        self.load(0.0, (0.0, 0.0, 0.0))
        self.zero(0.2)
        self.enter_motion()

    def _wait(self, reached: Callable[[], bool], limit_s: float, what: str) -> None:
        until = self.clock.now_s() + limit_s
        while not reached():
            now = self.clock.now_s()
            if now >= until:
                raise DeviceFault("connect", f"waited {limit_s:g} s for {what} ({self._status()})", self.events())
            if self.robot.fault():
                raise DeviceFault("fault", f"a fault while waiting for {what} ({self._status()})", self.events())
            self.clock.sleep_until(now + MODE_POLL_S)

    # -- slow changes: each blocks, and runs beside the loop -----------------------------------------------------------

    def idle(self) -> None:
        """Stop the arm and enter IDLE."""
        with vendor_call("stopping the arm"):
            self.robot.Stop()

    def load(self, mass_kg: float, com_E_m: Sequence[float]) -> None:
        """Set mass and centre of mass in E of the hand with its payload; needs IDLE.

        A mass of 0 means the bare hand.
        """
        if mass_kg <= 0.0:
            mass_kg, com_E_m = self._tool.mass_kg, self._tool.com_E_m
        with vendor_call("setting the tool"):
            if self._tools is None:
                self._tools = self.rdk.Tool(self.robot)
            params = self.rdk.ToolParams()
            params.mass, params.CoM = mass_kg, list(com_E_m)
            params.inertia = [1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0]
            params.tcp_location = list(self._tool.pose_E_P)
            if self._tools.exist(TOOL_NAME):
                self._tools.Update(TOOL_NAME, params)
            else:
                self._tools.Add(TOOL_NAME, params)
            self._tools.Switch(TOOL_NAME)

    def zero(self, duration_s: float) -> None:
        """Zero the wrist sensor by the vendor's primitive; the arm stays in primitive mode.

        Raises:
            DeviceFault: The primitive did not end in time.
        """
        with vendor_call("zeroing the wrist sensor"):
            self.robot.SwitchMode(self.rdk.Mode.NRT_PRIMITIVE_EXECUTION)
            self._zero_sensor(min(max(duration_s, 0.1), 1.0))
            self._wait(self._primitive_ended, duration_s + TARE_WAIT_S, "the wrist sensor's zeroing")

    def enter_motion(self) -> None:
        """Enter Cartesian motion-force with motion control only and the device's contact limit."""
        limits = self._limits
        wrench = [DEVICE_WRENCH_SHARE * limits.force_N] * 3 + [DEVICE_WRENCH_SHARE * limits.torque_Nm] * 3
        with vendor_call("entering Cartesian motion-force"):
            self.robot.SwitchMode(self.rdk.Mode.NRT_CARTESIAN_MOTION_FORCE)
            self._configure_motion(list(self.info.K_x_nom), self._posture, wrench)

    # -- fast: nothing below blocks ------------------------------------------------------------------------------------

    def send(self, setpoint: Setpoint) -> None:
        """Send a (checked) setpoint."""
        with vendor_call("sending a setpoint"):
            self._send(setpoint.pose, setpoint.twist if self._feed_forward else self._still)

    def hold_at(self, pose: Sequence[float]) -> None:
        """Bring the arm to rest at a pose of P in B."""
        with vendor_call("holding the arm"):
            self._send(pose, self._still)

    @property
    def _speed_limits(self) -> tuple[float, float, float, float]:
        """Limits of the arm's own smoothing: linear and angular velocity, linear and angular acceleration."""
        limits = self._limits
        return (
            SMOOTHING_HEADROOM * limits.speed_m_s,
            MAX_TURN_RAD_S,
            SMOOTHING_HEADROOM * max(limits.acceleration_m_s2, limits.stop_acceleration_m_s2),
            MAX_ANGULAR_RAD_S2,
        )

    def describe(self) -> dict[str, str]:
        """Return facts about the arm for display."""
        i = self.info
        return {
            "arm": str(i.model_name),
            "serial": str(i.serial_num),
            "software": str(i.software_ver),
            "licence": str(i.license_type),
            "wrist sensor": "yes" if i.has_FT_sensor else "no: the wrench is estimated from joint torques",
            "flexivrdk": f"{getattr(self.rdk, '__version__', 'unknown')} (as {self.api})",
        }

    def joint_limits(self) -> tuple[Numbers, Numbers]:
        """Return the device's joint ranges (7,), rad; infinite if it gives none."""
        low, high = list(self.info.q_min), list(self.info.q_max)
        if len(low) != 7 or len(high) != 7:
            return (-math.inf,) * 7, (math.inf,) * 7
        return tuple(low), tuple(high)
