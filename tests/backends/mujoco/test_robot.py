"""The whole backend: reproducibility, hard limits, failures, free bodies and tactile frames."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from glotouch_backends.mujoco import MujocoBackend
from glotouch_backends.mujoco.robot import MujocoRobot, carrying_torques
from glotouch_backends.mujoco.sensing.tactile import PadContacts
from glotouch_bt.robot import (
    HOLD,
    BackendError,
    BadInput,
    Command,
    Conditions,
    GripperTarget,
    Observation,
    ParamError,
    SafetyStop,
    Tare,
    UnknownName,
    World,
    load_backend,
)

Open = Callable[..., MujocoRobot]
Drive = Callable[[MujocoRobot], Any]
NOISY = Conditions(
    name="noisy",
    force_noise_sd_N=0.05,
    torque_noise_sd_Nm=0.003,
    force_drift_N_per_sqrt_min=0.03,
    wrench_latency_s=0.003,
    payload_mass_error=0.02,
    payload_com_error_m=0.002,
    tip_offset_sd_m=2e-4,
    tip_tilt_sd_deg=0.3,
    registration_sd_m=5e-4,
    registration_sd_deg=0.2,
    aperture_noise_sd_m=5e-5,
    aperture_bias_m=(-4e-4, 4e-4),
    gripper_latency_s=0.010,
    tactile_noise_sd_m=2e-5,
    tactile_offset_m=(-2e-5, 2e-5),
    tactile_dead_fraction=0.05,
    tactile_latency_s=0.030,
    object_mass_kg=(0.15, 0.40),
    object_friction=(0.45, 0.80),
    pad_friction=(0.8, 1.2),
)


def bytes_of(o: Observation) -> bytes:
    arrays = [o.stamp_s, o.q, o.dq, o.position_B_P, o.quat_B_P, o.wrench_S]
    if o.tactile is not None:
        arrays += [o.tactile.left_m, o.tactile.right_m]
    return b"".join(a.tobytes() for a in arrays) + repr(o.gripper).encode()


def run(robot: MujocoRobot, driver: Any) -> bytes:
    """Run a short trial: jaws, a line to the block, and a squeeze with frames."""
    driver.request(Tare(0.05))
    driver.jaws(0.070, time_s=0.2)
    driver.line((0.63, 0.08, -0.10), speed_m_s=0.2)
    driver.line((0.63, 0.08, -0.165), speed_m_s=0.1)
    driver.cycle(Command(gripper=GripperTarget(0.0, 0.08, 10.0), tactile=True))
    driver.wait(0.6, Command(tactile=True))
    return b"".join(bytes_of(o) for o in driver.observations)


def test_carrying_torques_are_those_of_mujocos_jacobian(open_robot: Open, drive: Drive) -> None:
    robot = open_robot(NOISY, 3)
    drive(robot).line((0.63, 0.08, -0.10), speed_m_s=0.2)
    com, weight_N = np.array([0.01, -0.02, 0.05]), 3.0
    origin, rotation = robot._pads_now
    jacobian = np.zeros((3, robot.model.nv))
    hand = robot.handles.hand_bodies.start
    mujoco.mj_jac(robot.model, robot.data, jacobian, None, origin + rotation @ com, hand)
    got = carrying_torques(*robot._joints_now, origin, rotation, com, weight_N)
    np.testing.assert_allclose(got, weight_N * jacobian[2, robot.handles.arm_dof], atol=1e-12)


def test_same_seed_same_bytes(open_robot: Open, drive: Drive) -> None:
    first, second, other = (run(r, drive(r)) for r in (open_robot(NOISY, s) for s in (3, 3, 4)))
    assert first == second
    assert first != other


def test_layout_does_not_depend_on_conditions(world: World) -> None:
    """The layout has its own random stream, so no other disturbance changes it."""
    poses = []
    for conditions in (Conditions(), replace(NOISY, registration_sd_m=0.0, registration_sd_deg=0.0)):
        robot = MujocoBackend().open(world, conditions, 7, {})
        assert isinstance(robot, MujocoRobot)
        poses.append(robot.truth.objects[0].place)
    assert poses[0] == poses[1]
    assert MujocoBackend().referee(robot).pose_B_K() == robot.truth.pose_B_K  # type: ignore[union-attr]


def test_frames_come_at_their_rate_and_late(open_robot: Open, drive: Drive) -> None:
    driver = drive(open_robot(NOISY, 1))
    run(driver.robot, driver)
    frames = [(o.now_s, o.tactile) for o in driver.observations if o.tactile is not None]
    assert len(frames) == pytest.approx(0.6 * 60, abs=3)
    for now, frame in frames:
        assert 0.030 - 1e-9 <= now - frame.stamp_s < 0.041
    left, right = frames[-1][1].left_m, frames[-1][1].right_m
    assert left.shape == right.shape == (35, 20)
    dead = np.isnan(np.stack([left, right]))
    assert 0.02 < dead.mean() < 0.08
    assert (dead == np.isnan(np.stack([frames[0][1].left_m, frames[0][1].right_m]))).all()
    # The block's flat faces are evenly indented, and the Winkler pressure carries each pad's force. The pads differ,
    # because the floor's friction holds the block off centre.
    deep = np.array([np.nanmedian(left), np.nanmedian(right)]) * 1e3
    forces = 0.2 * deep / (1 - (deep / 1.6) ** 2) * 17.2 * 28.5
    pressed, _ = PadContacts(driver.robot.model, driver.robot.data, driver.robot.handles).touch()
    assert forces == pytest.approx(pressed, rel=0.05)
    assert forces.mean() == pytest.approx(10.0, rel=0.03)
    assert driver.wait(0.1).tactile is None  # nobody asks any more


def test_hard_limit_stops_the_arm(open_robot: Open, drive: Drive) -> None:
    driver = drive(open_robot())
    robot = driver.robot
    driver.request(Tare())
    driver.jaws(0.02, time_s=0.3)
    x, y, _ = driver.pose.position_m
    driver.line((x, y, -0.16))
    with pytest.raises(SafetyStop, match="force_N") as caught:
        driver.line((x, y, -0.26), speed_m_s=0.06)
    assert caught.value.value > robot.limits.hard_force_N
    truth = MujocoBackend().referee(robot)
    assert truth is not None
    assert truth.peak_force_N() < 4 * robot.limits.hard_force_N
    held = robot.observe().position_B_P[-1]
    for _ in range(20):
        now = robot.observe().now_s
        with pytest.raises(SafetyStop):
            robot.cycle(Command(motion=None, gripper=GripperTarget(0.05, 0.1, 10.0)))
        assert robot.observe().now_s > now  # time passes, the arm only holds
    assert np.linalg.norm(robot.observe().position_B_P[-1] - held) < 1e-3
    robot.hold()


def test_free_fall_and_rest(open_robot: Open) -> None:
    """z = g t^2 / 2, then it lies still on the floor."""
    robot = open_robot()
    joint = robot.model.joint("object0")
    z, v = int(joint.qposadr[0]) + 2, int(joint.dofadr[0]) + 2
    robot.data.qpos[z] += 0.05
    start = robot.data.qpos[z]
    for _ in range(8):
        robot.cycle(HOLD)
    assert start - robot.data.qpos[z] == pytest.approx(0.5 * 9.81 * 0.08**2, rel=0.02)
    assert robot.data.qvel[v] == pytest.approx(-9.81 * 0.08, rel=1e-3)
    for _ in range(200):
        robot.cycle(HOLD)
    assert robot.data.qpos[z] == pytest.approx(-0.20, abs=3e-4)
    assert np.abs(robot.data.qvel).max() < 1e-3


def test_a_simulation_that_diverges_is_an_error(
    open_robot: Open, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    robot = open_robot()
    robot.data.qvel[robot.handles.arm_dof] = np.nan
    with pytest.raises(BackendError, match=r"unstable|finite"):
        robot.cycle(HOLD)
    with pytest.raises(BackendError):
        robot.cycle(HOLD)
    assert list(tmp_path.iterdir()) == []  # no log file left behind
    assert capfd.readouterr().err == ""


def test_unknown_option_and_bad_layout(world: World) -> None:
    with pytest.raises(UnknownName, match="layout"):
        MujocoBackend().open(world, Conditions(), 0, {"layuot": {}})
    with pytest.raises(BadInput, match="block"):
        MujocoBackend().open(world, Conditions(), 0, {"layout": {"other": (0, 0, 0)}})
    with pytest.raises(ParamError, match="mapping"):
        MujocoBackend().open(world, Conditions(), 0, {"layout": 3})


def test_impossible_world(world: World) -> None:
    small = replace(world, container=replace(world.container, interior_m=(0.09, 0.09, 0.08)))
    with pytest.raises(BadInput, match="do not fit"):
        MujocoBackend().open(small, Conditions(), 0, {})


def test_the_backend_is_registered_and_a_closed_robot_refuses_cycles(open_robot: Open) -> None:
    assert isinstance(load_backend("mujoco"), MujocoBackend)
    with open_robot() as robot:
        robot.cycle(HOLD)
    robot.close()
    with pytest.raises(BackendError, match="closed"):
        robot.cycle(HOLD)


def test_fixed_objects_do_not_move(world: World) -> None:
    """20 N move a free block, but not a fixed one."""
    with pytest.raises(ParamError, match="fixed"):
        MujocoBackend().open(world, Conditions(), 0, {"fixed": "perhaps"})
    moved = {}
    for fixed in ("true", "false"):
        robot = MujocoBackend().open(world, Conditions(), 0, {"layout": {"block": (0.03, 0.08, 0.0)}, "fixed": fixed})
        assert isinstance(robot, MujocoRobot)
        body = robot.handles.object_bodies[0]
        assert bool(robot.model.body_dofnum[body]) is (fixed == "false")
        before = robot.data.xpos[body].copy()
        robot.data.xfrc_applied[body, 0] = 20.0
        for _ in range(20):
            robot.cycle(HOLD)
        moved[fixed] = float(np.linalg.norm(robot.data.xpos[body] - before))
        robot.close()
    assert moved["true"] == 0.0
    assert moved["false"] > 0.01
