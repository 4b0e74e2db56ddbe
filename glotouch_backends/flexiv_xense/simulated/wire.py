"""Messages between a simulated cell and its clients: MessagePack over a Unix socket that only its owner can open.

(NEW, class, args, kwargs) creates an object and answers with a `Reference`; (CALL, key, method, args, kwargs) calls it;
(REFEREE, request) asks the referee. An answer is (True, value) or (False, exception). Beside plain data, a message
holds only the types below, each with a number; decoding makes nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime
from enum import Enum
from functools import lru_cache
from typing import Any

import msgspec
import numpy as np

from glotouch_backends.flexiv_xense.simulated.arm import Load, Sample
from glotouch_backends.flexiv_xense.simulated.vendor_api.flexiv_types import (
    ArmReading,
    Mode,
    OperationalStatus,
    RobotEvent,
    RobotEvent_Level,
    RobotInfo,
    RobotStates,
    ToolParams,
    seven,
)
from glotouch_backends.flexiv_xense.simulated.vendor_api.xensesdk import Sensor
from glotouch_backends.mujoco.model import SensorMap
from glotouch_backends.trial_message import pose_of

NEW, CALL, REFEREE = "new", "call", "referee"
MAX_BYTES = 16 * 1024 * 1024
"""Largest message; a depth map has 2 MB. Source: ours."""
ENUMS: tuple[type[Enum], ...] = (Mode, OperationalStatus, RobotEvent_Level, Sensor.OutputType)
ERRORS = {kind.__name__: kind for kind in (ValueError, TypeError, RuntimeError, KeyError, AttributeError, OSError)}
"""Errors that keep their class; any other becomes an Exception with its text."""
SLICES = tuple(SensorMap.__annotations__)


@dataclass(frozen=True)
class Reference:
    """Reference to an object in the cell."""

    key: int


def encode(value: object) -> bytes:
    """Return a value as bytes.

    Raises:
        TypeError: It holds an object of another type.
    """
    return msgspec.msgpack.encode(_plain(value))


def decode(body: bytes) -> Any:
    """Return the value of bytes from the other side; tuples come back as lists.

    Raises:
        ConnectionError: The bytes are damaged.
    """
    try:
        return msgspec.msgpack.decode(body, ext_hook=_read)
    except (msgspec.MsgspecError, ValueError, TypeError, LookupError, RecursionError, OverflowError) as e:
        raise ConnectionError(f"a message of the cell cannot be read: {type(e).__name__}: {e}") from e


def _plain(value: Any) -> Any:
    kind = type(value)
    if kind in (list, tuple):
        return [_plain(v) for v in value]
    if isinstance(value, Mapping):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, BaseException):
        return msgspec.msgpack.Ext(_NUMBERS[BaseException], encode([kind.__name__, str(value)]))
    number = _NUMBERS.get(kind)
    return value if number is None else msgspec.msgpack.Ext(number, encode(_TYPES[number][1](value)))


def _read(number: int, data: memoryview) -> Any:
    return _TYPES[number][2](decode(bytes(data)))


def _enum(kind: type[Enum]) -> tuple[type, Callable[[Any], Any], Callable[[Any], Any]]:
    return kind, lambda value: value.name, lambda name: kind[name]


def _record(kind: type, *names: str) -> tuple[type, Callable[[Any], Any], Callable[[Any], Any]]:
    return kind, lambda value: [getattr(value, name) for name in names], lambda values: kind(*values)


def _array_of(parts: list[Any]) -> Any:
    name, shape, content = parts
    dtype = np.dtype(str(name))
    if dtype.kind not in "biuf":
        raise ValueError(f"an array of {dtype}")
    return np.frombuffer(content, dtype).reshape(shape)


def _set_tool(parts: list[Any]) -> ToolParams:
    made = ToolParams()
    made.mass, made.CoM, made.inertia, made.tcp_location = parts
    return made


def _states_parts(states: RobotStates) -> list[Any]:
    r = states._reading
    if r is None:
        return []
    load, sensors = r.load, r.sensors
    tool = [load.mass_kg, load.com_E_m.tolist(), seven(load.pose_E_T), seven(r.pose_E_P)]
    slices = [[s.start, s.stop] for s in (getattr(sensors, name) for name in SLICES)]
    return [encode([tool, slices]), r.sample.step, r.sample.row, r.sample.wrench_S, r.sample.filtered_S]


@lru_cache(maxsize=8)
def _tool_of(body: bytes) -> tuple[Load, Any, SensorMap]:
    """Return the part of a reading that changes only with the tool."""
    (mass, com, pose_E_T, pose_E_P), slices = decode(body)
    return Load(mass, np.array(com), pose_of(pose_E_T)), pose_of(pose_E_P), SensorMap(*(slice(*s) for s in slices))


def _states_of(parts: list[Any]) -> RobotStates:
    if not parts:
        return RobotStates()
    tool, step, row, wrench_S, filtered_S = parts
    load, pose_E_P, sensors = _tool_of(tool)
    return RobotStates._of(ArmReading(Sample(step, row, wrench_S, filtered_S), sensors, load, pose_E_P))


_TYPES: dict[int, tuple[type, Callable[[Any], Any], Callable[[Any], Any]]] = dict(
    enumerate(
        (
            (BaseException, str, lambda parts: ERRORS.get(parts[0], Exception)(parts[1])),
            (np.ndarray, lambda a: [a.dtype.str, list(a.shape), a.tobytes()], _array_of),
            (np.float64, float, float),
            (datetime, datetime.isoformat, datetime.fromisoformat),
            (ToolParams, lambda t: [t.mass, t.CoM, t.inertia, t.tcp_location], _set_tool),
            (RobotStates, _states_parts, _states_of),
            _record(Reference, "key"),
            _record(RobotEvent, *RobotEvent.__annotations__),
            _record(RobotInfo, *RobotInfo.__annotations__),
            *map(_enum, ENUMS),
        )
    )
)
"""(type, parts of a value, value of its parts) by number."""
_NUMBERS = {kind: number for number, (kind, _, _) in _TYPES.items()}
