"""Enumerations and data structures of the flat `flexivrdk` 1.9 API, with the vendor's names.

As in the vendor's library, a list taken from an object is a copy.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from enum import Enum

from glotouch_backends.flexiv_xense.simulated.arm import Load, Sample
from glotouch_backends.flexiv_xense.simulated.vendor_api.checks import numbers
from glotouch_backends.mujoco.model import STEP_S, SensorMap
from glotouch_bt.robot import Array, Pose

EPOCH_S = 1_700_000_000
"""Time of the simulated control box at its start."""


class _Numbered(Enum):
    """A pybind enumeration: not equal to its number, but convertible to it."""

    def __int__(self) -> int:
        return int(self.value)


class Mode(_Numbered):
    """Control modes."""

    UNKNOWN = 0
    IDLE = 1
    NRT_JOINT_IMPEDANCE = 4
    NRT_JOINT_POSITION = 6
    NRT_PLAN_EXECUTION = 7
    NRT_PRIMITIVE_EXECUTION = 8
    NRT_CARTESIAN_MOTION_FORCE = 10
    NRT_SUPER_PRIMITIVE = 11


class OperationalStatus(_Numbered):
    """Readiness of the robot."""

    UNKNOWN = 0
    READY = 1
    BOOTING = 2
    ESTOP_NOT_RELEASED = 3
    NOT_ENABLED = 4
    RELEASING_BRAKE = 5
    MINOR_FAULT = 6
    CRITICAL_FAULT = 7
    IN_REDUCED_STATE = 8
    IN_RECOVERY_STATE = 9
    IN_MANUAL_MODE = 10
    IN_AUTO_MODE = 11


class RobotEvent_Level(_Numbered):
    """Severity of an event."""

    UNKNOWN = 0
    INFO = 1
    WARNING = 2
    ERROR = 3
    CRITICAL = 4


@dataclass(slots=True)
class RobotEvent:
    """One line of the event log."""

    level: RobotEvent_Level = RobotEvent_Level.UNKNOWN
    id: int = 0
    description: str = ""
    consequences: str = ""
    probable_causes: str = ""
    recommended_actions: str = ""
    timestamp: datetime = datetime(1970, 1, 1)

    Level = RobotEvent_Level


@dataclass(slots=True)
class RobotInfo:
    """General information."""

    serial_num: str = ""
    software_ver: str = ""
    model_name: str = ""
    license_type: str = ""
    K_x_nom: list[float] = field(default_factory=lambda: [0.0] * 6)
    q_min: list[float] = field(default_factory=list)
    q_max: list[float] = field(default_factory=list)
    has_FT_sensor: bool = False


def _numbers(name: str, length: int) -> property:
    """Return a property of `length` numbers: it returns a copy, and refuses anything else (TypeError)."""

    def _get(self: ToolParams) -> list[float]:
        return [*self._values[name]]

    def _put(self: ToolParams, value: Sequence[float]) -> None:
        self._values[name] = numbers(name, value, length).tolist()

    return property(_get, _put)


class ToolParams:
    """Tool on the flange: kg, m and kg m2; `tcp_location` is x y z qw qx qy qz in the flange frame."""

    __slots__ = ("_mass", "_values")
    CoM = _numbers("CoM", 3)
    inertia = _numbers("inertia", 6)
    tcp_location = _numbers("tcp_location", 7)

    def __init__(self) -> None:
        self._mass = 0.0
        self._values = {"CoM": [0.0] * 3, "inertia": [0.0] * 6, "tcp_location": [0.0] * 7}

    @property
    def mass(self) -> float:
        """Mass, kg."""
        return self._mass

    @mass.setter
    def mass(self, value: float) -> None:
        """Set the mass; TypeError if it is not a number."""
        self._mass = float(numbers("mass", [value])[0])

    def _copy(self) -> ToolParams:
        """Return a copy (not in the vendor's API, whose functions copy by themselves)."""
        other = ToolParams()
        other._mass, other._values = self._mass, {k: [*v] for k, v in self._values.items()}
        return other


def seven(pose: Pose) -> list[float]:
    """Return a pose in the vendor's order: x y z qw qx qy qz."""
    return [*pose.position_m.tolist(), *pose.quat.tolist()]


@dataclass(frozen=True)
class ArmReading:
    """A sample with the data to interpret it: MuJoCo's columns, the tool in use, P in the flange frame."""

    sample: Sample
    sensors: SensorMap
    load: Load
    pose_E_P: Pose

    def stamp(self) -> tuple[int, int]:
        """Return the seconds since the epoch, and the nanoseconds since the last full second."""
        seconds, rest = divmod(self.sample.step, round(1.0 / STEP_S))
        return EPOCH_S + seconds, rest * round(STEP_S * 1e9)

    def flange(self) -> Pose:
        """Return the pose of the flange in B."""
        row = self.sample.row
        return Pose(row[self.sensors.position], row[self.sensors.quat]) @ self.pose_E_P.inverse()

    def tool(self) -> list[float]:
        """Return the pose of the tool centre point in B."""
        if _same(self.load.pose_E_T, self.pose_E_P):
            row = self.sample.row
            return [*row[self.sensors.position].tolist(), *row[self.sensors.quat].tolist()]
        return seven(self.flange() @ self.load.pose_E_T)

    def in_tool(self, wrench_S: Array) -> list[float]:
        """Return a wrench at the tool centre point, in the tool's axes."""
        return _list(self.load.in_T @ wrench_S)

    def in_world(self, wrench_S: Array) -> list[float]:
        """Return a wrench at the tool centre point, in B's axes."""
        at_T, turn = self.load.at_T @ wrench_S, self.flange().rotation
        return [*_list(turn @ at_T[:3]), *_list(turn @ at_T[3:])]


def _same(a: Pose, b: Pose) -> bool:
    return bool((a.position_m == b.position_m).all() and (a.quat == b.quat).all())


def _read(empty: Callable[[], object], of: Callable[[ArmReading], object]) -> property:
    """Return a property of a state: computed from its reading, or `empty` if it has none."""

    def _get(self: RobotStates) -> object:
        return empty() if self._reading is None else of(self._reading)

    return property(_get)


class RobotStates:
    """State of the arm at one millisecond; only values that the simulation has. Wrenches in N and Nm, poses in m."""

    __slots__ = ("_reading",)
    timestamp = _read(lambda: (0, 0), lambda r: r.stamp())
    q = _read(list, lambda r: _list(r.sample.row[r.sensors.q]))
    dq = _read(list, lambda r: _list(r.sample.row[r.sensors.dq]))
    flange_pose = _read(lambda: [0.0] * 7, lambda r: seven(r.flange()))
    tcp_pose = _read(lambda: [0.0] * 7, lambda r: r.tool())
    ext_wrench_in_tcp = _read(lambda: [0.0] * 6, lambda r: r.in_tool(r.sample.filtered_S))
    ext_wrench_in_tcp_raw = _read(lambda: [0.0] * 6, lambda r: r.in_tool(r.sample.wrench_S))
    ext_wrench_in_world = _read(lambda: [0.0] * 6, lambda r: r.in_world(r.sample.filtered_S))
    ext_wrench_in_world_raw = _read(lambda: [0.0] * 6, lambda r: r.in_world(r.sample.wrench_S))

    def __init__(self) -> None:
        self._reading: ArmReading | None = None

    @classmethod
    def _of(cls, reading: ArmReading) -> RobotStates:
        states = cls()
        states._reading = reading
        return states


def _list(a: Array) -> list[float]:
    return [*a.tolist()]
