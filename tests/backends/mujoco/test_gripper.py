"""The jaws: force and speed limits, reports, and picking up and returning the probe."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import pytest

from glotouch_backends.mujoco import MujocoBackend
from glotouch_backends.mujoco.control.jaws import JawReports
from glotouch_backends.mujoco.model.gripper import PAD_PROUD_M
from glotouch_backends.mujoco.robot import MujocoRobot
from glotouch_backends.mujoco.sensing.gel import BOTTOM_M
from glotouch_backends.mujoco.sensing.tactile import PadContacts
from glotouch_bt.robot import Command, Conditions, GripperState, GripperTarget, ParamError, SetPayload
from tests.backends.mujoco.conftest import BLOCK_M

Open = Callable[..., MujocoRobot]
Drive = Callable[[MujocoRobot], Any]


@pytest.fixture
def over_block(open_robot: Open, drive: Drive) -> Any:
    """A driver with the open jaws round the block."""
    driver = drive(open_robot())
    driver.jaws(0.085, time_s=0.4)
    driver.line((0.63, 0.08, -0.10))
    driver.line((0.63, 0.08, -0.165))
    return driver


@pytest.mark.parametrize("force_N", [5.0, 10.0, 30.0])
def test_force_limit(over_block: Any, force_N: float) -> None:
    """Each pad presses with the commanded force, in balance, without overshoot; the block sinks into the gel only."""
    robot, pads = over_block.robot, PadContacts(over_block.robot.model, over_block.robot.data, over_block.robot.handles)
    over_block.cycle(Command(gripper=GripperTarget(0.0, 0.04, force_N)))
    peak = 0.0
    for _ in range(150):
        over_block.cycle(Command())
        peak = max(peak, *pads.touch()[0])
    (left, right), bodies = pads.touch()
    assert bodies == set(robot.handles.object_bodies)
    assert left == pytest.approx(force_N, rel=0.02)
    assert right == pytest.approx(force_N, rel=0.02)
    assert peak < 1.3 * force_N + 1.0
    contacts = robot.data.contact
    on_pads = np.isin(contacts.geom, robot.handles.pad_geoms).any(axis=1)
    assert 1e-4 < -contacts.dist[on_pads].min() < BOTTOM_M
    assert over_block.last.gripper.force_N == pytest.approx(force_N, rel=1e-3)
    assert not over_block.last.gripper.moving
    assert np.abs(over_block.last.wrench_S[-1, :2]).max() < 0.2  # a squeeze is no force on the wrist


def test_aperture_on_a_block_is_its_width_minus_both_indentations(over_block: Any) -> None:
    """A flat face over the whole window indents x with k x / (1 - (x/X)^2) A = F (Winkler), once on each side."""
    last = over_block.jaws(0.0, 10.0, 0.04, 1.5)
    area, k, rigid = 17.2 * 28.5, 0.2, 1.6
    x = np.linspace(0.0, 1.5, 200001)
    sink_mm = float(np.interp(10.0, k * x / (1 - (x / rigid) ** 2) * area, x))
    assert last.gripper.aperture_m * 1e3 == pytest.approx(36.0 - 2 * sink_mm, abs=0.02)


def test_jaws_keep_their_speed_and_reach_the_target(open_robot: Open, drive: Drive) -> None:
    driver = drive(open_robot())
    driver.cycle(Command(gripper=GripperTarget(0.080, 0.040, 30.0)))
    apertures = [driver.cycle(Command()).gripper.aperture_m for _ in range(130)]
    rates = np.diff(apertures) / driver.robot.period_s
    assert rates.max() < 0.040 * 1.1
    assert np.median(rates[10:80]) == pytest.approx(0.040, rel=0.05)
    assert apertures[-1] == pytest.approx(0.080, abs=2e-5)


@pytest.mark.parametrize(
    "target", [GripperTarget(0.2, 0.04, 10.0), GripperTarget(0.02, 0.0, 10.0), GripperTarget(0.02, 0.04, np.nan)]
)
def test_targets_beyond_the_gripper_are_refused(open_robot: Open, target: GripperTarget) -> None:
    with pytest.raises(ParamError, match="within"):
        open_robot().cycle(Command(gripper=target))


def test_reports_are_late_biased_and_quantised() -> None:
    conditions = Conditions(
        gripper_latency_s=0.02, aperture_bias_m=(0.0003, 0.0003), aperture_noise_sd_m=0.0, aperture_resolution_m=1e-5
    )
    reports = JawReports(conditions, 0, 0.01, GripperState(0.0, 0.05, 0.0, False))
    got = [reports.report(0.01 * i, 0.05 + 0.0012345 * i, 0.1, 2.0) for i in range(1, 6)]
    assert [g.stamp_s for g in got] == pytest.approx([0.0, 0.0, 0.01, 0.02, 0.03])
    np.testing.assert_allclose(got[-1].aperture_m, 0.05 + 0.0012345 * 3 + 0.0003, atol=5.1e-6)
    assert abs(got[-1].aperture_m / 1e-5 - round(got[-1].aperture_m / 1e-5)) < 1e-6
    assert got[-1].moving


def test_probe_is_picked_carried_and_returned(open_robot: Open, drive: Drive) -> None:
    robot = open_robot(Conditions(tip_offset_sd_m=2e-4, tip_tilt_sd_deg=0.3), seed=4)
    referee = MujocoBackend().referee(robot)
    assert referee is not None
    driver = drive(robot)
    assert referee.probe_in_holder()
    nominal = robot.world.probe.grasp_to_tip_m

    def tip_P() -> Any:
        data, site = robot.data, robot.handles.pads_site
        return data.site_xmat[site].reshape(3, 3).T @ (referee.tip_B_m() - data.site_xpos[site])

    driver.pick()
    driver.request(SetPayload(0.060, np.array([0.0, 0.0, 0.030])))
    assert not referee.probe_in_holder()
    taken = tip_P()
    offset = robot.truth.pose_handle_shaft.apply((0.0, 0.0, nominal))
    np.testing.assert_allclose(taken, offset, atol=1e-4)  # the grasp offset is the body's own
    assert np.linalg.norm(taken[:2]) > 5e-5
    driver.line((0.60, 0.0, 0.10))
    driver.line((0.60, 0.0, 0.03))
    driver.line((0.66, 0.1, 0.03), speed_m_s=0.06)
    assert np.linalg.norm(tip_P() - taken) < 1e-4
    x, y, z = robot.world.holder.pose_B_grasp.position_m
    driver.line((x, y, z + 0.18))
    driver.line((x, y, z + 0.0005), speed_m_s=0.06)
    driver.jaws(0.040)
    driver.line((x, y, z + 0.10))
    assert referee.probe_in_holder()
    assert referee.peak_force_N() < 10.0


def test_a_lifted_block_does_not_creep(over_block: Any) -> None:
    robot = over_block.robot
    referee = MujocoBackend().referee(robot)
    assert referee is not None
    assert not referee.objects()[0].in_gripper
    over_block.jaws(0.0, 30.0, 0.04, 1.0)
    over_block.line((0.63, 0.08, -0.05))
    before = referee.objects()[0]
    assert before.in_gripper
    over_block.wait(2.0)
    after = referee.objects()[0].pose_B_O.position_m - before.pose_B_O.position_m
    assert np.linalg.norm(after) < 5e-5  # friction holds, it does not creep
    over_block.jaws(0.085, 30.0, 0.2, 0.5)
    assert not referee.objects()[0].in_gripper


def test_an_object_between_the_fingers_is_held_also_beside_the_pads(open_robot: Open, drive: Drive) -> None:
    """The fingers are longer than the pads: an object may hang between them and miss a pad."""
    driver = drive(open_robot())
    driver.line((0.60, 0.0, 0.10))
    robot, referee = driver.robot, MujocoBackend().referee(driver.robot)
    assert referee is not None
    gripper, (block,) = robot.description.gripper, robot.handles.object_bodies
    above_pads_m = 0.5 * gripper.pad_window_m[1] + BLOCK_M[2] + 0.002  # the block's origin is in its base
    site, data = robot.handles.pads_site, robot.data
    data.qpos[robot.handles.jaw_qpos] = 0.5 * BLOCK_M[1] - PAD_PROUD_M - 0.0005  # the fingers press into the block
    address = int(robot.model.jnt_qposadr[robot.model.body_jntadr[block]])
    rotation = data.site_xmat[site].reshape(3, 3)
    data.qpos[address : address + 3] = data.site_xpos[site] - above_pads_m * rotation[:, 2]
    mujoco.mju_mat2Quat(data.qpos[address + 3 : address + 7], data.site_xmat[site])
    mujoco.mj_forward(robot.model, data)
    assert not {*robot.handles.pad_geoms} & {*data.contact.geom.ravel().tolist()}
    assert referee.objects()[0].in_gripper
