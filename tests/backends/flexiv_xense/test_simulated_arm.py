"""The simulated arm through the vendor's API: order of a session, units, signs, frames, limits and faults."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from glotouch_backends.flexiv_xense.simulated import ROBOT_SN
from glotouch_backends.flexiv_xense.simulated.arm import LINK_LOST_S
from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.robot import Conditions, Pose
from glotouch_bt.robot.geometry import quat_to_matrix
from tests.backends.flexiv_xense.simulated_rig import LIMITS, Bench


@pytest.fixture(scope="module")
def cartesian() -> Bench:
    return Bench().cartesian()


def test_connecting_takes_its_time() -> None:
    bench = Bench()
    began = bench.clock.now_s()
    assert began > 0.1
    with pytest.raises(ValueError, match="serial"):
        bench.rdk.Robot("Rizon4")
    assert bench.clock.now_s() == began, "a wrong serial number is refused at once"
    with pytest.raises(RuntimeError, match="not found"):
        bench.rdk.Robot("Rizon4-999999")
    assert bench.clock.now_s() - began > 3.0


def test_the_order_of_a_session() -> None:
    bench = Bench()
    robot, mode = bench.robot, bench.rdk.Mode
    assert robot.operational_status() is bench.rdk.OperationalStatus.NOT_ENABLED
    with pytest.raises(RuntimeError, match="operational"):
        robot.SwitchMode(mode.NRT_JOINT_POSITION)
    robot.Enable()
    assert robot.operational_status() is bench.rdk.OperationalStatus.RELEASING_BRAKE
    bench.wait(robot.operational)
    with pytest.raises(RuntimeError, match="mode IDLE"):
        robot.SendCartesianMotionForce(bench.pose.tolist())
    with pytest.raises(ValueError, match="unlicensed"):
        robot.SwitchMode(mode.NRT_PLAN_EXECUTION)
    robot.SwitchMode(mode.NRT_JOINT_POSITION)
    with pytest.raises(RuntimeError, match="IDLE"):
        bench.rdk.Tool(robot).Switch("Flange")
    robot.Stop()
    assert robot.mode() is mode.IDLE
    with pytest.raises(ValueError, match="does not exist"):
        bench.rdk.Tool(robot).Switch("other")


def test_cartesian_mode_needs_a_zeroed_sensor() -> None:
    bench = Bench().enable().tool()
    with pytest.raises(RuntimeError):
        bench.robot.SwitchMode(bench.rdk.Mode.NRT_CARTESIAN_MOTION_FORCE)
    assert bench.robot.fault()
    event = bench.robot.event_log()[-1]
    assert event.id == 301004
    assert event.level is bench.rdk.RobotEvent.Level.ERROR
    assert bench.robot.ClearFault()
    bench.zero()
    bench.robot.SwitchMode(bench.rdk.Mode.NRT_CARTESIAN_MOTION_FORCE)


def test_the_flange_alone_feels_the_hands_weight() -> None:
    """Without a tool the hand's weight shows as an external force: m g down, in the requested axes."""
    bench = Bench().enable().zero()
    at = np.array(bench.robot.states().flange_pose)
    bench.robot.Stop()
    mass, com = RIZON4_XENSE.gripper.mass_and_com_E()
    bench.sleep(0.001)
    zeroed = np.array(bench.robot.states().ext_wrench_in_world_raw)
    assert np.abs(zeroed).max() < 0.05, "zeroed with the weight on"
    tools, params = bench.rdk.Tool(bench.robot), bench.rdk.ToolParams()
    params.mass, params.CoM, params.tcp_location = mass, com.tolist(), [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    tools.Add("hand", params)
    tools.Switch("hand")
    bench.sleep(0.3)
    lifted = np.array(bench.robot.states().ext_wrench_in_world_raw)
    np.testing.assert_allclose(lifted[:3], [0.0, 0.0, mass * 9.81], atol=0.05)
    lever = quat_to_matrix(at[3:]) @ com
    np.testing.assert_allclose(lifted[3:], np.cross(lever, [0.0, 0.0, mass * 9.81]), atol=0.01)


def test_wrenches_agree_between_frames(cartesian: Bench) -> None:
    """The same wrench at the tool centre point, in its axes and in the world's; filtered lags behind raw."""
    bench = cartesian
    s = bench.robot.states()
    turn = quat_to_matrix(np.array(s.tcp_pose[3:]))
    for world, tool in (
        (s.ext_wrench_in_world_raw, s.ext_wrench_in_tcp_raw),
        (s.ext_wrench_in_world, s.ext_wrench_in_tcp),
    ):
        np.testing.assert_allclose(turn @ np.array(tool[:3]), world[:3], atol=1e-9)
        np.testing.assert_allclose(turn @ np.array(tool[3:]), world[3:], atol=1e-9)
    flange = Pose(np.array(s.flange_pose[:3]), np.array(s.flange_pose[3:]))
    np.testing.assert_allclose(flange.apply([0.0, 0.0, 0.2]), s.tcp_pose[:3], atol=1e-9)


def test_stamps_count_milliseconds(cartesian: Bench) -> None:
    def now() -> float:
        seconds, nanoseconds = cartesian.robot.states().timestamp
        return float(seconds - 1_700_000_000 + nanoseconds * 1e-9)

    assert now() == pytest.approx(cartesian.clock.now_s(), abs=1e-9)
    before = cartesian.robot.states()
    cartesian.sleep(0.001)
    assert cartesian.robot.states().timestamp != before.timestamp
    assert before.q == before.q
    assert before.q is not before.q, "a copy each time"


def test_it_follows_streamed_setpoints(cartesian: Bench) -> None:
    start = cartesian.pose[:3]
    track = cartesian.stream((0.0, 0.05, 0.0), 0.6)
    expected = start + np.outer(0.01 * np.arange(1, 61), [0.0, 0.05, 0.0])
    assert np.linalg.norm(track - expected, axis=1)[10:].max() < 5e-4
    cartesian.robot.Stop()
    assert cartesian.robot.stopped()
    assert np.abs(cartesian.robot.states().dq).max() < 1e-3
    cartesian.robot.SwitchMode(cartesian.rdk.Mode.NRT_CARTESIAN_MOTION_FORCE)


def test_a_setpoints_velocity_is_kept() -> None:
    """As the vendor documents: without a further setpoint the arm continues; one with velocity 0 ends it."""
    bench = Bench().cartesian()
    bench.stream((0.0, 0.05, 0.0), 0.4)
    at = bench.pose
    bench.sleep(0.2)
    assert bench.pose[1] - at[1] == pytest.approx(0.01, abs=5e-4)
    here = bench.pose
    bench.robot.SendCartesianMotionForce(here.tolist(), [0.0] * 6, [0.0] * 6, *LIMITS)
    bench.sleep(0.5)
    assert np.linalg.norm(bench.pose[:3] - here[:3]) < 1e-3


def test_limits_of_a_setpoint_are_obeyed(cartesian: Bench) -> None:
    """A far setpoint is reached at the speed limit that came with it."""
    start = cartesian.pose
    goal = (start + np.eye(7)[2] * 0.05).tolist()
    cartesian.robot.SendCartesianMotionForce(goal, [0.0] * 6, [0.0] * 6, 0.05, 1.0, 1.0, 5.0)
    begin, heights = cartesian.clock.now_s(), []
    while cartesian.clock.now_s() < begin + 2.5:
        cartesian.sleep(0.01)
        heights.append(cartesian.pose[2])
    speed = np.diff(heights) / 0.01
    assert 0.03 < speed.max() < 0.053
    assert abs(heights[-1] - goal[2]) < 2e-4


@pytest.mark.parametrize(
    ("change", "critical"),
    [({0: float("nan")}, True), ({0: 3.0}, False)],
    ids=["not a number", "out of reach"],
)
def test_a_bad_pose_is_a_fault(change: dict[int, float], critical: bool) -> None:
    """It is accepted silently, as by the real interface; then the arm stops by itself."""
    bench = Bench().cartesian()
    pose = bench.pose.tolist()
    for i, value in change.items():
        pose[i] = value
    bench.robot.SendCartesianMotionForce(pose)
    assert bench.robot.fault()
    status = bench.rdk.OperationalStatus
    assert bench.robot.operational_status() is (status.CRITICAL_FAULT if critical else status.MINOR_FAULT)
    with pytest.raises(RuntimeError):
        bench.robot.SendCartesianMotionForce(bench.pose.tolist())


def test_a_lost_link_stops_the_arm() -> None:
    bench = Bench().cartesian()
    bench.stream((0.0, 0.08, 0.0), 0.5)
    at = bench.vendor.world.data.site_xpos[bench.vendor.world.handles.pads_site].copy()
    last = bench.robot.states().timestamp
    bench.vendor.box.linked = False
    bench.vendor.world.arm.lose_link()
    bench.sleep(0.4)
    assert not bench.robot.connected()
    assert bench.robot.states().timestamp == last, "the last state is repeated for ever"
    with pytest.raises(RuntimeError):
        bench.robot.Stop()
    went = np.linalg.norm(bench.vendor.world.data.site_xpos[bench.vendor.world.handles.pads_site] - at)
    assert 0.08 * LINK_LOST_S * 0.9 < went < 0.08 * LINK_LOST_S + 0.08**2 / 2 / 2.0 * 2 + 1e-3
    bench.sleep(0.2)
    assert bench.vendor.world.arm.trajectory.at_rest


def test_the_contact_wrench_is_bounded() -> None:
    """Pressed 15 mm into the floor at 20 mm/s: without a bound, and with 8 N."""
    peaks, pressed = [], []
    for most in (None, 8.0):
        bench = Bench().cartesian()
        if most is not None:
            bench.robot.SetMaxContactWrench([most] * 3 + [5.0] * 3)
        tip = RIZON4_XENSE.gripper.fingertip_below_P_m
        down = bench.pose[2] - tip + 0.20 - 0.003
        goal = (bench.pose - np.eye(7)[2] * down).tolist()
        bench.robot.SendCartesianMotionForce(goal, [0.0] * 6, [0.0] * 6, 0.2, 1.0, 1.0, 5.0)
        bench.wait(bench.robot.stopped)
        start, forces = bench.pose, []
        for k in range(1, 91):
            goal = [*(start[:3] - [0.0, 0.0, 0.0002 * k]), *start[3:]]
            bench.robot.SendCartesianMotionForce(goal, [0.0] * 6, [0.0, 0.0, -0.02, 0.0, 0.0, 0.0], *LIMITS)
            bench.sleep(0.01)
            forces.append(bench.robot.states().ext_wrench_in_world_raw[2])
        pressed.append(max(forces[40:]))
        peaks.append(max(forces))
    assert pressed[0] > 100.0
    assert 4.0 < pressed[1] < 8.5
    assert peaks[1] < 50.0, "the first impact"


@pytest.mark.parametrize(
    ("call", "arguments", "error"),
    [
        ("SetCartesianImpedance", ([1e5] * 6,), ValueError),
        ("SetCartesianImpedance", ([1e3] * 5,), TypeError),
        ("SetMaxContactWrench", ([-1.0] * 6,), ValueError),
        ("SetNullSpacePosture", ([0.0] * 6,), ValueError),
        ("SetNullSpacePosture", ([9.0] * 7,), ValueError),
        ("SetForceControlAxis", ([0.0] * 6,), TypeError),
        ("SwitchMode", (10,), TypeError),
        ("SendCartesianMotionForce", ([0.0] * 6,), TypeError),
        ("SendCartesianMotionForce", ("abcdefg",), TypeError),
    ],
)
def test_invalid_arguments_are_refused(
    cartesian: Bench, call: str, arguments: tuple[Any, ...], error: type[Exception]
) -> None:
    with pytest.raises(error):
        getattr(cartesian.robot, call)(*arguments)


def test_noise_has_the_spread_of_the_conditions() -> None:
    """White noise of the sensor at 1 kHz in the raw wrench; the filtered one has less."""
    bench = Bench(Conditions(force_noise_sd_N=0.05, torque_noise_sd_Nm=0.003)).cartesian()
    bench.sleep(0.2)
    raw, filtered = [], []
    for _ in range(1500):
        bench.sleep(0.001)
        s = bench.robot.states()
        raw.append(s.ext_wrench_in_world_raw)
        filtered.append(s.ext_wrench_in_world)
    assert np.std(raw, axis=0)[:3] == pytest.approx([0.05] * 3, rel=0.1)
    assert np.std(filtered, axis=0)[:3].max() < 0.02


def test_a_second_client_starts_a_new_session() -> None:
    """Zeroing and the event log belong to a client's session."""
    bench = Bench().cartesian()
    bench.vendor.box.fail(1, "made up")
    assert bench.robot.ClearFault()
    again = bench.rdk.Robot(ROBOT_SN)
    assert again.event_log() == []
    with pytest.raises(RuntimeError):
        again.SwitchMode(bench.rdk.Mode.NRT_CARTESIAN_MOTION_FORCE)
