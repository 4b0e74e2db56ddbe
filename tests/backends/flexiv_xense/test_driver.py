"""The driver and its client, with scripted devices in lock-step."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from glotouch_backends.flexiv_xense.driver.faults import DeviceFault
from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.robot import (
    HOLD,
    BackendError,
    Command,
    GripperTarget,
    JointSetpoint,
    ParamError,
    Pose,
    Robot,
    SafetyStop,
    SetPayload,
    StaleReading,
    Tare,
)
from glotouch_bt.robot.fake import forward
from tests.backends.flexiv_xense.conftest import Open
from tests.backends.flexiv_xense.scripted import ScriptedVendor

HOME = np.array(RIZON4_XENSE.home_q)


def setpoint(q: np.ndarray, dq: np.ndarray | None = None) -> JointSetpoint:
    return JointSetpoint(q, np.zeros(7) if dq is None else dq, np.zeros(7), forward(RIZON4_XENSE, q))


def rest(robot: Robot, periods: int, command: Command = HOLD) -> None:
    for _ in range(periods):
        robot.cycle(command)


def test_a_session_opens_in_the_order_of_the_vendor(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    vendor.flags.update(fault=True, operational=False)
    robot = open_robot(vendor)
    assert vendor.calls == [
        "Robot",
        "ClearFault",
        "Enable",
        "Stop",
        "Tool.Add",
        "Tool.Switch",
        "NRT_PRIMITIVE_EXECUTION",
        "ZeroFTSensor",
        "NRT_CARTESIAN_MOTION_FORCE",
        "SetForceControlAxis",
        "SetCartesianImpedance",
        "SetNullSpacePosture",
        "SetMaxContactWrench",
    ]
    robot.close()


def test_a_cycle_is_one_period_of_ten_samples(open_robot: Open) -> None:
    robot = open_robot(ScriptedVendor())
    before = robot.observe().now_s
    stamps = [before]
    for _ in range(5):
        stamps.extend(robot.cycle(HOLD).stamp_s.tolist())
    assert np.allclose(np.diff(stamps), 0.001)
    assert stamps[-1] == pytest.approx(before + 0.05)


def test_a_setpoint_is_sent_as_pose_and_twist(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    robot = open_robot(vendor)
    robot.cycle(HOLD)
    dq = np.array([0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 0.02])
    robot.cycle(Command(setpoint(HOME + 0.005 * dq, dq)))
    pose, twist = vendor.sent[-1]
    expected = forward(RIZON4_XENSE, HOME + 0.005 * dq)
    assert np.allclose(pose, [*expected.position_m, *expected.quat])
    step = 1e-6
    ahead = forward(RIZON4_XENSE, HOME + (0.005 + step) * dq)
    assert np.allclose(twist[:3], (ahead.position_m - expected.position_m) / step, atol=1e-6)
    turn = ahead.rotation @ expected.rotation.T / step
    assert np.allclose(twist[3:], [turn[2, 1], turn[0, 2], turn[1, 0]], atol=1e-6)


def test_a_hold_brakes_along_the_path(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    robot = open_robot(vendor)
    dq = np.zeros(7)
    dq[0] = 0.2
    robot.cycle(Command(setpoint(HOME + 0.001 * dq, dq)))
    (pose, twist), n = vendor.sent[-1], len(vendor.sent)
    robot.cycle(HOLD)
    robot.cycle(HOLD)
    (rest, still) = vendor.sent[-1]
    assert len(vendor.sent) == n + 2
    assert still == [0.0] * 6
    v = np.array(twist[:3])
    assert np.allclose(np.array(rest[:3]) - pose[:3], v * np.linalg.norm(v) / (2 * 2.0))


@pytest.mark.parametrize(
    "bad",
    [
        JointSetpoint(np.full(7, np.nan), np.zeros(7), np.zeros(7), forward(RIZON4_XENSE, HOME)),
        JointSetpoint(np.zeros(6), np.zeros(7), np.zeros(7), forward(RIZON4_XENSE, HOME)),
        setpoint(HOME, np.full(7, 9.0)),
        setpoint(HOME + np.array([0.0, 0.0, 0.0, 0.0, 0.3, 0.0, 0.0])),
        setpoint(np.array([3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])),
        JointSetpoint(HOME, np.zeros(7), np.zeros(7), Pose(np.array([0.5, 0.0, 0.2]))),
    ],
    ids=["nan", "shape", "joint speed", "jump", "range", "other pose"],
)
def test_an_invalid_setpoint_is_refused_and_not_sent(open_robot: Open, bad: JointSetpoint) -> None:
    vendor = ScriptedVendor()
    robot = open_robot(vendor)
    robot.cycle(Command(setpoint(HOME)))
    n = len(vendor.sent)
    with pytest.raises(ParamError):
        robot.cycle(Command(bad))
    assert all(twist == [0.0] * 6 for _, twist in vendor.sent[n:])
    assert np.allclose(vendor.sent[-1][0], vendor.sent[n - 1][0])
    robot.cycle(Command(setpoint(HOME)))


def test_a_tare_runs_as_a_primitive_while_samples_arrive(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    robot = open_robot(vendor)
    vendor.calls.clear()
    ticket = robot.start(Tare(0.2))
    with pytest.raises(ParamError, match="pending"):
        robot.cycle(Command(setpoint(HOME)))
    begin, cycles = robot.observe().now_s, 0
    while not ticket.done and cycles < 200:
        assert len(robot.cycle(HOLD).stamp_s) == 10
        cycles += 1
    assert ticket.error is None
    assert 0.2 <= robot.observe().now_s - begin < 0.5
    assert vendor.calls[:3] == ["NRT_PRIMITIVE_EXECUTION", "ZeroFTSensor", "NRT_CARTESIAN_MOTION_FORCE"]
    robot.cycle(Command(setpoint(HOME)))


def test_a_payload_is_switched_in_idle_and_added_to_the_hand(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    robot = open_robot(vendor)
    vendor.calls.clear()
    tickets = [robot.start(SetPayload(0.06, np.array([0.0, 0.0, 0.03]))), robot.start(Tare())]
    rest(robot, 200)
    assert all(t.done and t.error is None for t in tickets)
    assert vendor.calls[:4] == ["Stop", "Tool.Update 0.944", "Tool.Switch", "NRT_CARTESIAN_MOTION_FORCE"]


def test_a_failed_tare_says_why(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    robot = open_robot(vendor)
    vendor.broken["ExecutePrimitive"] = RuntimeError("no such primitive")
    ticket = robot.start(Tare())
    with pytest.raises(BackendError, match="no such primitive"):
        rest(robot, 50)
    assert ticket.done
    assert ticket.error is not None
    assert "no such primitive" in ticket.error


def test_the_hard_limit_stops_the_arm_below_the_client(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    robot = open_robot(vendor)
    robot.cycle(Command(setpoint(HOME)))
    vendor.wrench = [0.0, 0.0, -31.0, 0.0, 0.0, 0.0]
    with pytest.raises(SafetyStop) as e:
        robot.cycle(Command(setpoint(HOME)))
    assert e.value.quantity == "force_N"
    assert e.value.value == pytest.approx(31.0)
    n = len(vendor.sent)
    vendor.wrench = [0.0] * 6
    with pytest.raises(SafetyStop):
        robot.cycle(Command(setpoint(HOME)))
    assert len(vendor.sent) == n


def test_after_a_safety_stop_a_hold_keeps_the_stopped_pose(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    robot = open_robot(vendor)
    dq = np.zeros(7)
    dq[0] = 0.2
    robot.cycle(Command(setpoint(HOME + 0.001 * dq, dq)))
    stopped = list(vendor.pose)
    vendor.wrench = [0.0, 0.0, -31.0, 0.0, 0.0, 0.0]
    with pytest.raises(SafetyStop):
        robot.cycle(HOLD)
    robot.hold()
    assert vendor.sent[-1] == (vendor.pose, [0.0] * 6)
    assert np.linalg.norm(np.subtract(vendor.pose[:3], stopped[:3])) < 0.02


def test_without_feed_forward_the_twist_is_zero(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    robot = open_robot(vendor, feed_forward="false")
    dq = np.zeros(7)
    dq[0] = 0.2
    robot.cycle(Command(setpoint(HOME + 0.001 * dq, dq)))
    assert vendor.sent[-1][1] == [0.0] * 6


def test_the_error_names_the_effect_of_a_lost_gripper_link(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    robot = open_robot(vendor, link_loss="opens")
    vendor.gripper.get_gripper_status = lambda: None  # type: ignore[assignment,method-assign,return-value]
    with pytest.raises(BackendError, match="LETS GO"):
        robot.cycle(HOLD)


def test_one_sample_beyond_the_limit_is_noise(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    advance = vendor._advance

    def spike(stamp_s: float) -> None:
        advance(stamp_s)
        vendor.wrench = [50.0 if round(stamp_s * 1e3) % 5 else 0.0, 0, 0, 0, 0, 0]

    robot = open_robot(vendor)
    vendor.clock._advance = spike
    rest(robot, 10)


def test_wrenches_arrive_in_S_about_S(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    vendor.wrench = [1.0, 2.0, 3.0, 0.1, 0.2, 0.3]
    robot = open_robot(vendor)
    # P is 0.2 m along z from S, with the same axes: torque gains (0, 0, 0.2) x (1, 2, 3) = (-0.4, 0.2, 0).
    assert np.allclose(robot.cycle(HOLD).wrench_S, [1.0, 2.0, 3.0, -0.3, 0.4, 0.3])


def test_a_fault_comes_with_the_event_log(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    robot = open_robot(vendor)
    vendor.events.append(
        SimpleNamespace(
            level=SimpleNamespace(name="ERROR"), id=301004, description="collision", recommended_actions="look"
        )
    )
    vendor.flags["fault"] = True
    with pytest.raises(BackendError, match=r"fault.*301004 collision"):
        robot.cycle(HOLD)
    with pytest.raises(BackendError, match="301004"):
        robot.cycle(HOLD)


@pytest.mark.parametrize(
    ("flags", "text"),
    [
        ({"connected": False}, "not connected"),
        ({"operational": False, "reduced": True}, "reduced state"),
        ({"operational": False, "recovery": True}, "recovery"),
        ({"operational": False, "estop_released": False}, "emergency stop"),
    ],
)
def test_the_reason_why_the_arm_cannot_move_is_named(open_robot: Open, flags: dict[str, bool], text: str) -> None:
    vendor = ScriptedVendor()
    robot = open_robot(vendor)
    vendor.flags.update(flags)
    with pytest.raises(BackendError, match=text):
        robot.cycle(HOLD)


def test_an_arm_that_repeats_old_readings_is_stale(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    robot = open_robot(vendor)
    vendor.frozen = True
    with pytest.raises(StaleReading):
        rest(robot, 30)


def test_a_vendor_error_is_mapped(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    robot = open_robot(vendor)
    vendor.broken["SendCartesianMotionForce"] = RuntimeError("gone")
    with pytest.raises(BackendError, match="RuntimeError: gone"):
        robot.cycle(Command(setpoint(HOME)))


def test_an_arm_that_cannot_be_enabled_is_an_error(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    vendor.flags.update(operational=False, estop_released=False)
    with pytest.raises(BackendError, match="emergency stop"):
        open_robot(vendor)
    assert "Enable" not in vendor.calls


def test_the_gripper_takes_millimetres(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    robot = open_robot(vendor)
    for _ in range(80):
        observation = robot.cycle(Command(gripper=GripperTarget(0.060, 0.05, 12.0)))
    assert vendor.gripper.asked[-1] == pytest.approx((60.0, 50.0, 12.0))
    assert observation.gripper.aperture_m == pytest.approx(0.060)
    assert not observation.gripper.moving
    with pytest.raises(ParamError):
        robot.cycle(Command(gripper=GripperTarget(0.2, 0.05, 12.0)))


def test_a_gripper_that_repeats_old_readings_is_stale(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    robot = open_robot(vendor)
    vendor.gripper.dead = True
    robot.cycle(Command(gripper=GripperTarget(0.010, 0.05, 12.0)))
    with pytest.raises(StaleReading, match="gripper"):
        rest(robot, 120)


def test_a_link_lost_while_the_jaws_move_is_noticed(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    robot = open_robot(vendor)
    robot.cycle(Command(gripper=GripperTarget(0.010, 0.05, 12.0)))
    rest(robot, 10)
    vendor.gripper.dead = True
    with pytest.raises(StaleReading, match="again and again"):
        rest(robot, 25)


def test_frames_arrive_in_pairs_in_metres_with_one_mirrored(open_robot: Open) -> None:
    robot = open_robot(ScriptedVendor())
    frames = [robot.cycle(Command(tactile=True)).tactile for _ in range(30)]
    got = [f for f in frames if f is not None]
    assert 8 <= len(got) <= 10
    assert np.all(np.diff([f.stamp_s for f in got]) > 0.0)
    left, right = got[-1].left_m, got[-1].right_m
    assert left.shape == (35, 20)
    assert np.allclose(left, 1e-3 * (1e-3 * (20 * np.arange(35)[:, None] + 9.5) + 1e-6 * (20 * np.arange(20) + 9.5)))
    assert np.allclose(right, left[:, ::-1])
    assert robot.cycle(HOLD).tactile is None


def test_gel_images_come_once_a_request_with_the_right_one_mirrored(open_robot: Open) -> None:
    robot = open_robot(ScriptedVendor())
    seen = [robot.cycle(Command(tactile=True, images=k == 3)) for k in range(40)]
    (images,) = (o.images for o in seen if o.images is not None)
    assert images.left.shape == (*RIZON4_XENSE.gripper.camera.shape, 3)  # type: ignore[union-attr]
    assert images.left[0, 0].tolist() == [3, 2, 1], "red, green, blue"
    assert images.left[0, -1].tolist() == [50, 2, 1]
    assert images.right[0, 0].tolist() == [50, 2, 1]
    assert any(images.stamp_s == o.tactile.stamp_s for o in seen if o.tactile is not None)


def test_missing_frames_are_a_fault_only_while_requested(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    robot = open_robot(vendor)
    vendor.sensors[1].silent = True
    rest(robot, 150)
    with pytest.raises(StaleReading, match="tactile"):
        rest(robot, 150, Command(tactile=True))


def test_closing_stops_the_arm_and_releases_everything(open_robot: Open) -> None:
    vendor = ScriptedVendor()
    robot = open_robot(vendor)
    robot.cycle(HOLD)
    vendor.calls.clear()
    robot.close()
    robot.close()
    robot.hold()
    with pytest.raises(BackendError, match="closed"):
        robot.cycle(HOLD)


def test_an_unknown_version_is_refused() -> None:
    from glotouch_backends.flexiv_xense.driver.devices.connect import api_of

    with pytest.raises(DeviceFault, match="dropped the Rizon"):
        api_of(SimpleNamespace(__version__="2.1.0"), "")
    assert api_of(SimpleNamespace(__version__="1.9.4.1"), "").api == "1.9"
    assert api_of(SimpleNamespace(__version__="2.0.0"), "").api == "2.0"
