"""Every axis of the conditions alters what is sensed, is drawn from the seed alone, and is part of snapshots."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import trimesh

from glotouch_backends.mujoco import MujocoBackend
from glotouch_backends.mujoco.axis_proof import AxisProof
from glotouch_backends.mujoco.robot import MujocoRobot
from glotouch_bt.mission.checkpoint.codec import decode, encode
from glotouch_bt.mission.read import load_conditions
from glotouch_bt.robot import Command, Conditions, GripperTarget, Observation, World
from glotouch_bt.robot.scene import AXES

Drive = Callable[[MujocoRobot], Any]
Open = Callable[..., MujocoRobot]
REALISTIC = load_conditions("realistic")
PROBE_AXES = ("probe_compliance_about_m_per_N", "probe_compliance_across_m_per_N")


def alone(axis: str) -> Conditions:
    return Conditions(name=axis, **{axis: getattr(REALISTIC, axis)})


@pytest.fixture(scope="module")
def world(world: World, tmp_path_factory: pytest.TempPathFactory) -> World:
    """The small world with a cone: its touched surface has no plane that a shift would leave unchanged."""
    folder = tmp_path_factory.mktemp("round")
    trimesh.creation.cone(0.026, 0.12, sections=48).export(folder / "block.stl")
    return replace(world, objects=replace(world.objects, folder=folder))


def squeeze(robot: MujocoRobot, drive: Drive) -> list[Observation]:
    """Squeeze the block and open again."""
    driver = drive(robot)
    driver.jaws(0.070, time_s=0.3)
    driver.line((0.63, 0.08, -0.165), speed_m_s=0.4)
    for target in (GripperTarget(0.020, 0.1, 10.0), GripperTarget(0.070, 0.1, 10.0)):
        driver.wait(0.7, Command(gripper=target, tactile=True))
    observations: list[Observation] = driver.observations
    return observations


def press_floor(robot: MujocoRobot, drive: Drive) -> list[Observation]:
    """Press the fingertips 0.3 mm into the floor."""
    driver = drive(robot)
    driver.line((0.55, -0.08, -0.17), speed_m_s=0.4)
    driver.line((0.55, -0.08, -0.1843), speed_m_s=0.02)
    observations: list[Observation] = driver.observations
    return observations


def photograph(robot: MujocoRobot, drive: Drive) -> list[Observation]:
    """Squeeze the block and take an image of the pads."""
    driver = drive(robot)
    driver.jaws(0.070, time_s=0.3)
    driver.line((0.63, 0.08, -0.165), speed_m_s=0.4)
    driver.wait(0.6, Command(gripper=GripperTarget(0.020, 0.1, 10.0), tactile=True))
    driver.wait(robot.period_s, Command(images=True))
    driver.wait(0.1)
    observations: list[Observation] = driver.observations
    return observations


MOTIONS = {
    **dict.fromkeys(PROBE_AXES, "push_probe"),
    "housing_softness_s": "press_floor",
    **{axis: "photograph" for axis in AXES if axis.startswith("image_")},
}
"""Motions in which an axis' sensor is used; `squeeze` for all others."""


def push_probe(robot: MujocoRobot, drive: Drive) -> list[Observation]:
    """Take the probe and pull its ball along x and y."""
    driver = drive(robot)
    driver.pick()
    referee = MujocoBackend().referee(robot)
    assert referee is not None
    referee.push_tip(np.array([1.0, 1.0, 0.0]))
    driver.wait(0.3)
    observations: list[Observation] = driver.observations
    return observations


def bits(observations: list[Observation]) -> bytes:
    return encode(observations)


@pytest.fixture(scope="module")
def plain(request: pytest.FixtureRequest) -> dict[str, bytes]:
    """Observations without any axis, by motion; filled by the first test that needs them."""
    return {}


@pytest.mark.parametrize("axis", AXES)
def test_an_axis_alone_alters_what_is_sensed(
    axis: str, open_robot: Open, drive: Drive, plain: dict[str, bytes]
) -> None:
    motion = globals()[MOTIONS.get(axis, "squeeze")]
    if motion.__name__ not in plain:
        plain[motion.__name__] = bits(motion(open_robot(Conditions(), seed=2), drive))
    robot = open_robot(alone(axis), seed=2)
    assert bits(motion(robot, drive)) != plain[motion.__name__]
    assert robot.proof.silent() == ()
    assert robot.proof._altered[AXES.index(axis)]


def test_an_axis_that_alters_nothing_is_told() -> None:
    proof = AxisProof(Conditions(gel_blur_m=0.001, tactile_gain=(1.1, 1.1)))
    proof.saw("gel_blur_m", np.zeros(3), np.zeros(3))
    proof.saw("gel_blur_m", 0.0, np.zeros(3))
    proof.saw("gel_bulge_fraction", 1.0, 1.0)  # not set
    assert proof.silent() == ("gel_blur_m",)
    proof.saw("gel_blur_m", np.zeros(3), np.array([0.0, 5e-324, 0.0]))
    proof.saw("gel_blur_m", 0.0, 0.0)
    assert proof.silent() == ()


def test_too_small_a_jitter_is_told(open_robot: Open, drive: Drive) -> None:
    robot = open_robot(Conditions(latency_jitter_s=1e-4, wrench_gain_sd=1e-18), seed=2)
    squeeze(robot, drive)
    referee = MujocoBackend().referee(robot)
    assert referee is not None
    assert referee.silent_axes() == ("wrench_gain_sd",)  # the jitter still moves the frames


def test_the_same_seed_gives_the_same_world_and_another_one_not(open_robot: Open, drive: Drive) -> None:
    first, again, other = (bits(squeeze(open_robot(REALISTIC, seed=s), drive)) for s in (5, 5, 6))
    assert first == again
    assert first != other


def test_an_axis_shifts_no_draw_of_another_one(open_robot: Open) -> None:
    """All axes of a trial but one: the rest of its truth stays."""
    whole = open_robot(REALISTIC, seed=7)
    for axis in ("object_scale", "object_lean_deg", "kinematic_error_sd_m", PROBE_AXES[0]):
        less = open_robot(Conditions(**(vars(REALISTIC) | {axis: getattr(Conditions(), axis)})), seed=7)
        one, two = whole.truth.objects[0], less.truth.objects[0]
        for name in ("mass_kg", "friction", "offset_m", "lean_about_rad"):
            assert getattr(one, name) == getattr(two, name)
        assert np.array_equal(one.com_error_m, two.com_error_m)
        assert (one.scale == two.scale) == (axis != "object_scale")
        assert (one.lean_rad == two.lean_rad) == (axis != "object_lean_deg")
        assert whole.truth.contact_s == less.truth.contact_s
        assert np.array_equal(whole.truth.pose_B_K.quat, less.truth.pose_B_K.quat)
        assert np.array_equal(whole._depth._gain, less._depth._gain)
        assert np.array_equal(whole._wrist._gain_error, less._wrist._gain_error)


def test_a_snapshot_holds_what_the_sensors_remember(open_robot: Open, drive: Drive) -> None:
    """In the middle of a squeeze, through the bytes of a checkpoint."""
    one, other = open_robot(REALISTIC, seed=4), open_robot(REALISTIC, seed=4)
    driver = drive(one)
    driver.jaws(0.070, time_s=0.3)
    driver.line((0.63, 0.08, -0.165), speed_m_s=0.4)
    driver.wait(0.5, Command(gripper=GripperTarget(0.020, 0.1, 10.0), tactile=True))
    kept = encode(one.snapshot())
    release = [Command(gripper=GripperTarget(0.070, 0.05, 10.0), tactile=True)] * 60
    expected = bits([one.cycle(c) for c in release])
    other.restore(decode(kept))
    assert bits([other.cycle(c) for c in release]) == expected
    assert encode(one.snapshot()) == encode(other.snapshot())
