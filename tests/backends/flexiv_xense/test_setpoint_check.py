"""Checks of setpoints and requests before the driver sends them to the arm."""

from __future__ import annotations

import numpy as np
import pytest

from glotouch_backends.flexiv_xense.client.backend import _arm_limits
from glotouch_backends.flexiv_xense.driver import messages
from glotouch_backends.flexiv_xense.driver.checks import SetpointCheck
from glotouch_backends.flexiv_xense.driver.faults import CommandRefused
from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.robot import Command, Limits, Pose, SetPayload, Tare
from glotouch_bt.robot.fake import forward
from tests.backends.flexiv_xense.conftest import Open
from tests.backends.flexiv_xense.scripted import ScriptedVendor
from tests.backends.flexiv_xense.test_driver import HOME, rest, setpoint


def test_after_a_stop_at_full_speed_the_next_motion_begins_where_the_arm_stands(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    robot = open_robot(vendor)
    radius_m = float(np.hypot(*forward(RIZON4_XENSE, HOME).position_m[:2]))
    dq = np.eye(7)[0] * 0.24 / radius_m
    robot.cycle(Command(setpoint(HOME + 0.005 * dq, dq)))
    rest(robot, 40)
    braked = HOME + (0.005 + 0.24 / (2 * 2.0)) * dq  # 14 mm on: v / 2a at v
    robot.cycle(Command(setpoint(braked)))
    assert np.allclose(vendor.sent[-1][0][:3], forward(RIZON4_XENSE, braked).position_m)


def test_a_setpoint_may_not_turn_faster_than_the_arm() -> None:
    """The pose and the twist are what the arm is sent; its joints are only compared."""
    check = SetpointCheck(_arm_limits(RIZON4_XENSE, Limits()), 0.01)
    pose = forward(RIZON4_XENSE, HOME)
    x, q, still = tuple(pose.position_m.tolist()), tuple(HOME.tolist()), (0.0,) * 7
    check.reset_to(q, (*x, *pose.quat.tolist()))
    for angle_rad, w_rad_s in ((0.0, 0.0), (0.04, 4.0), (0.0, 0.0)):
        turned = pose @ Pose(np.zeros(3), np.array([np.cos(angle_rad / 2), 0.0, 0.0, np.sin(angle_rad / 2)]))
        check.check(messages.Setpoint(q, still, (*x, *turned.quat.tolist()), (0.0,) * 5 + (w_rad_s,)))
    for quat, w_rad_s, text in (((0.0, 1.0, 0.0, 0.0), 0.0, "rad from the last"), (pose.quat.tolist(), 9.0, "rad/s")):
        with pytest.raises(CommandRefused, match=text):
            check.check(messages.Setpoint(q, still, (*x, *quat), (0.0,) * 5 + (w_rad_s,)))


def test_a_session_that_only_observes_switches_nothing(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    robot = open_robot(vendor, moves=False)
    n = len(vendor.calls)
    tickets = [robot.start(Tare()), robot.start(SetPayload(0.1, np.zeros(3)))]
    rest(robot, 3)
    assert all(t.done and t.error is not None and "read-only" in t.error for t in tickets)
    assert vendor.calls[n:] == []
