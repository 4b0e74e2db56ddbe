"""The driver on wall time: silence of its client or of a device. No test measures a time."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from glotouch_backends.flexiv_xense.driver.messages import Cycle, Setpoint
from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.robot import HOLD, BackendError, Command, JointSetpoint, Robot, Tare
from glotouch_bt.robot.fake import forward
from tests.backends.flexiv_xense.conftest import Open
from tests.backends.flexiv_xense.scripted import ScriptedVendor

HOME = np.array(RIZON4_XENSE.home_q)
PATIENCE_S = 20.0


def eventually(reached: Callable[[], bool]) -> bool:
    until = time.monotonic() + PATIENCE_S
    while not reached():
        if time.monotonic() > until:
            return False
        time.sleep(0.005)
    return True


def cycle_twice(robot: Robot) -> None:
    robot.cycle(HOLD)
    robot.cycle(HOLD)


def a_moving_setpoint() -> Command:
    dq = np.zeros(7)
    dq[0] = 0.1
    q = HOME + 0.005 * dq
    return Command(JointSetpoint(q, dq, np.zeros(7), forward(RIZON4_XENSE, q)))


def events(tmp_path: Path) -> list[str]:
    return [json.loads(line)["event"] for line in (tmp_path / "log.jsonl").read_text().splitlines()]


def test_blocks_are_consecutive(open_robot: Open) -> None:
    robot = open_robot(ScriptedVendor(stepped=False), pace="real")
    stamps = list(robot.observe().stamp_s)
    for _ in range(20):
        stamps.extend(robot.cycle(HOLD).stamp_s)
    assert np.all(np.diff(stamps) > 0.0)
    assert stamps[-1] - stamps[0] > 0.15


def test_without_setpoints_the_arm_is_held(open_robot: Open) -> None:
    vendor = ScriptedVendor(stepped=False)
    robot = open_robot(vendor, pace="real")
    robot.cycle(a_moving_setpoint())
    assert eventually(lambda: vendor.sent[-1][1] == [0.0] * 6)
    time.sleep(0.6)  # its heart still beats
    assert robot.cycle(HOLD).stamp_s.size > 100
    assert robot.late_periods > 10


def test_a_hold_that_the_arm_refuses_is_repeated(open_robot: Open) -> None:
    """The arm would go on with the velocity of its last setpoint."""
    vendor = ScriptedVendor(stepped=False)
    robot = open_robot(vendor, pace="real")
    robot.cycle(a_moving_setpoint())
    vendor.broken["SendCartesianMotionForce"] = RuntimeError("busy")
    with pytest.raises(BackendError, match="busy"):
        cycle_twice(robot)
    robot.hold()
    time.sleep(0.2)  # all that a silent client brings about has happened
    assert vendor.sent[-1][1] != [0.0] * 6
    vendor.broken.clear()
    assert eventually(lambda: vendor.sent[-1][1] == [0.0] * 6)


def test_losing_the_client_ends_the_session(open_robot: Open, tmp_path: Path) -> None:
    vendor = ScriptedVendor(stepped=False)
    robot = open_robot(vendor, pace="real")
    robot.cycle(a_moving_setpoint())
    vendor.calls.clear()
    robot.link._stop.set()  # its heart stops
    assert eventually(lambda: "Stop" in vendor.calls)
    assert eventually(lambda: vendor.gripper.released)
    assert eventually(lambda: "released" in events(tmp_path))
    assert "client lost" in events(tmp_path)
    assert vendor.sensors
    assert all(s.released for s in vendor.sensors)


def test_a_silent_driver_is_an_error(open_robot: Open) -> None:
    vendor = ScriptedVendor(stepped=False)
    robot = open_robot(vendor, pace="real")
    vendor.stamp = lambda: time.sleep(2.0)  # type: ignore[assignment,method-assign]
    with pytest.raises(BackendError, match="nothing heard"):
        cycle_twice(robot)


def test_a_tare_runs_concurrently_with_the_loop(open_robot: Open) -> None:
    robot = open_robot(ScriptedVendor(stepped=False), pace="real")
    ticket = robot.start(Tare(0.1))
    for _ in range(500):
        robot.cycle(HOLD)
        if ticket.done:
            break
    assert ticket.done
    assert ticket.error is None


def test_a_second_client_is_refused(open_robot: Open) -> None:
    from glotouch_backends.flexiv_xense.client.link import DriverLink
    from glotouch_backends.flexiv_xense.driver.messages import Block

    robot = open_robot(ScriptedVendor(stepped=False), pace="real")
    other = DriverLink(robot.link._address, lambda: None, paced=False)
    try:
        with pytest.raises(BackendError, match="another client"):
            other.ask(Cycle(number=1), Block, limit_s=PATIENCE_S)
    finally:
        other.close()
    robot.cycle(HOLD)


def test_an_undecodable_message_is_refused_and_the_driver_continues(open_robot: Open) -> None:
    robot = open_robot(ScriptedVendor(stepped=False), pace="real")
    robot.link._socket.send(b"\xc1 rubbish")
    with pytest.raises(BackendError, match="could not be read"):
        robot.cycle(HOLD)
    assert robot.process is None


def test_a_setpoint_of_another_length_is_refused(open_robot: Open) -> None:
    robot = open_robot(ScriptedVendor(), pace="lockstep")
    bad = Setpoint((0.0,) * 6, (0.0,) * 7, (0.0,) * 7, (0.0,) * 6)
    from glotouch_backends.flexiv_xense.driver.messages import Block
    from glotouch_bt.robot import ParamError

    with pytest.raises(ParamError, match="7 finite numbers"):
        robot.link.ask(Cycle(number=robot.link.number(), setpoint=bad), Block)
