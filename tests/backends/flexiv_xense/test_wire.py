"""The protocol of the cell's socket: plain data and a fixed list of types arrive unchanged; nothing else is decoded."""

from __future__ import annotations

from datetime import datetime

import msgspec
import numpy as np
import pytest

from glotouch_backends.flexiv_xense.simulated.vendor_api import Mode, OperationalStatus, RobotEvent, ToolParams
from glotouch_backends.flexiv_xense.simulated.vendor_api.flexiv_types import RobotInfo
from glotouch_backends.flexiv_xense.simulated.wire import Reference, decode, encode
from tests.backends.flexiv_xense.simulated_rig import Bench


@pytest.mark.parametrize(
    "value",
    [
        None,
        [1, 2.5, "a", True, b"\x00"],
        {"terminated": 1, "timePeriod": 0.25},
        Mode.IDLE,
        OperationalStatus.READY,
        Reference(7),
        RobotInfo(serial_num="s", q_min=[-1.0], q_max=[1.0]),
        [RobotEvent(id=3, description="d", timestamp=datetime(2026, 1, 2, 3, 4, 5))],
    ],
)
def test_values_come_back(value: object) -> None:
    assert decode(encode(value)) == value


def test_arrays_and_tools_come_back() -> None:
    depth = np.arange(6.0, dtype=np.float32).reshape(2, 3)
    back, stamp = decode(encode((depth, 1.5)))
    assert (back == depth).all()
    assert (back.dtype, stamp) == (depth.dtype, 1.5)
    tool = ToolParams()
    tool.mass, tool.tcp_location = 0.5, [0.0, 0.0, 0.2, 1.0, 0.0, 0.0, 0.0]
    back = decode(encode(tool))
    assert (back.mass, back.CoM, back.tcp_location) == (tool.mass, tool.CoM, tool.tcp_location)


def test_a_state_comes_back_to_the_bit() -> None:
    bench = Bench().enable().tool()
    bench.sleep(0.02)
    states = bench.robot.states()
    back = decode(encode(states))
    for name in type(states).__dict__:
        if isinstance(type(states).__dict__[name], property):
            assert getattr(back, name) == getattr(states, name), name


@pytest.mark.parametrize("error", [ValueError("v"), TypeError("t"), RuntimeError("r"), Exception("e"), OSError("o")])
def test_errors_keep_their_class(error: Exception) -> None:
    back = decode(encode((False, error)))[1]
    assert (type(back), str(back)) == (type(error), str(error))


@pytest.mark.parametrize(
    "body",
    [
        b"\x80\x04cos\nsystem\n(S'true'\ntR.",
        b"\x91" * 5000 + b"\xc0",
        msgspec.msgpack.encode(msgspec.msgpack.Ext(99, b"")),
        msgspec.msgpack.encode(msgspec.msgpack.Ext(1, msgspec.msgpack.encode(["|O", [1], b"12345678"]))),
        msgspec.msgpack.encode(msgspec.msgpack.Ext(1, msgspec.msgpack.encode(["<f8", [9], b"12345678"]))),
        b"\xa2\xff\xfe",
        b"",
    ],
)
def test_damaged_bytes_are_one_error(body: bytes) -> None:
    with pytest.raises(ConnectionError):
        decode(body)


def test_other_objects_are_not_sent() -> None:
    with pytest.raises(TypeError):
        encode(object())
