"""A client that is not trusted: it cannot choose the devices, and none of its requests ends the driver."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from glotouch_backends.flexiv_xense.client.backend import FlexivXenseBackend
from glotouch_backends.flexiv_xense.client.link import failure
from glotouch_backends.flexiv_xense.client.options import read_options
from glotouch_backends.flexiv_xense.driver import messages
from glotouch_backends.flexiv_xense.driver.devices import Served, connect_devices
from glotouch_backends.flexiv_xense.driver.faults import DeviceFault
from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.robot import BadInput
from tests.backends.flexiv_xense.conftest import Open
from tests.backends.flexiv_xense.scripted import ScriptedVendor


@pytest.mark.parametrize(
    ("kind", "world", "served"),
    [
        ("simulated", b"", Served()),
        ("real", b"a world", Served()),
        ("real", b"", Served("simulated")),
        ("simulated", b"a world", Served("cell", "socket")),
    ],
)
def test_a_client_cannot_choose_the_devices(kind: str, world: bytes, served: Served) -> None:
    """They are those of the driver's command line; a driver for real devices builds no world."""
    options, settings = read_options({"devices": kind, "robot": "Rizon4-000001"})
    request = FlexivXenseBackend()._request(options, settings, world, 1, True)
    with pytest.raises(DeviceFault, match=f"serves {served.kind} devices only"):
        connect_devices(request, served, lambda _: None)


def test_a_world_that_cannot_be_built_is_bad_input() -> None:
    options, settings = read_options({"devices": "simulated"})
    request = FlexivXenseBackend()._request(options, settings, b"rubbish", 1, True)
    with pytest.raises(DeviceFault, match="cannot be read from its message") as e:
        connect_devices(request, Served("simulated"), lambda _: None)
    assert isinstance(failure(e.value.answer(1)), BadInput)


def test_no_request_ends_the_driver(open_robot: Open) -> None:
    """Neither damaged bytes nor requests with extreme numbers: the driver answers, and its client can still hold."""
    robot = open_robot(ScriptedVendor())
    rng = np.random.default_rng(0)
    extremes = [float("nan"), float("inf"), -1e308, 0.0, 5e-324]
    seeds = [
        messages.Cycle(number=1, setpoint=messages.Setpoint(RIZON4_XENSE.home_q, (0.0,) * 7, (0.0,) * 7, (0.0,) * 6)),
        messages.Cycle(number=2, jaws=messages.JawTarget(0.05, 0.05, 10.0), tactile=True),
        *(messages.Cycle(number=3, jaws=messages.JawTarget(e, e, e)) for e in extremes),
        *(messages.Cycle(number=3, setpoint=messages.Setpoint(*((e,) * 7,) * 4)) for e in extremes),
        messages.PayloadRequest(number=4, ticket=4, mass_kg=-1e308, com_P_m=(float("nan"),) * 3),
        messages.TareRequest(number=5, ticket=5, duration_s=5e-324),
        messages.RefereeRequest(number=6, method="objects"),
        messages.HoldRequest(number=7),
    ]
    for trial in range(1500):
        body = bytearray(messages.encode(seeds[trial % len(seeds)]))
        for _ in range(trial // len(seeds) % 4):
            body[rng.integers(len(body))] = rng.integers(256)
        robot.link._socket.send(bytes(body))
    link = robot.link
    link._socket.send(messages.encode(messages.HoldRequest(number=10**9)))
    answers = iter(lambda: link._receive(5.0), None)
    assert any(getattr(a, "number", 0) == 10**9 for a in answers)


def test_no_limit_of_a_client_limits_nothing() -> None:
    """NaN passes every comparison, so it is refused as a message."""
    limits = messages.ArmLimits(
        q_min=(-3.0,) * 7, q_max=(3.0,) * 7, dq_max=(2.0,) * 7, speed_m_s=0.25, acceleration_m_s2=1.0,
        stop_acceleration_m_s2=2.0, force_N=28.5, torque_Nm=10.0, max_age_s=0.2,
    )  # fmt: skip
    read = messages._reader(messages.ArmLimits)
    assert read(messages.encode(limits)) == limits
    for name, value in (("dq_max", float("nan")), ("dq_max", 11.0), ("q_min", float("nan")), ("q_max", 1e3)):
        with pytest.raises(messages.BadMessage):
            read(messages.encode(msgspec.structs.replace(limits, **{name: (value,) * 7})))
    for mass_kg, at_m in ((float("nan"), 0.0), (-1.0, 0.0), (0.1, float("nan")), (0.1, 2.0)):
        body = messages.encode(messages.PayloadRequest(number=1, ticket=1, mass_kg=mass_kg, com_P_m=(at_m,) * 3))
        with pytest.raises(messages.BadMessage):
            messages.decode_request(body)
