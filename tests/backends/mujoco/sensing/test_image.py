"""Gel images against closed forms, and the images that a robot takes on request."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.special import ndtr

from glotouch_backends.mujoco.axis_proof import AxisProof
from glotouch_backends.mujoco.robot import MujocoRobot
from glotouch_backends.mujoco.sensing.gel import GelSensor, pad_pose_P
from glotouch_backends.mujoco.sensing.image import BRIGHTNESS, GelImager, lit
from glotouch_backends.mujoco.sensing.rays import SurfaceRays
from glotouch_backends.mujoco.sensing.tactile import imager_of_trial
from glotouch_backends.rizon4 import XENSE_GRIPPER
from glotouch_bt.mission.checkpoint.codec import decode, encode
from glotouch_bt.mission.read import load_conditions
from glotouch_bt.robot import Command, Conditions, GelImages, GripperTarget, Pose
from glotouch_bt.robot.scene import Mesh, load_mesh

PITCH_M = (1e-4, 2e-4)
CAMERA = XENSE_GRIPPER.camera
assert CAMERA is not None
LIGHTS = CAMERA.directions(right=False)


def imager(**axes: object) -> GelImager:
    conditions = Conditions(name="test", **axes)  # type: ignore[arg-type]
    made = imager_of_trial(XENSE_GRIPPER, conditions, 0, AxisProof(conditions))
    assert made is not None
    return made


def test_a_ball_is_lit_by_lamberts_law() -> None:
    """The normal of a sphere of radius R at (u, v) is (u, v, sqrt(R^2 - u^2 - v^2)) / R."""
    radius = 0.012
    v, u = np.meshgrid(*(p * np.arange(-30, 31) for p in PITCH_M), indexing="ij")
    height = np.sqrt(radius**2 - u**2 - v**2)
    normal = np.stack([u, v, height], axis=-1) / radius
    found = lit(height, PITCH_M, LIGHTS)
    expected = np.maximum(normal @ LIGHTS.T, 0.0)
    assert np.abs(found - expected)[1:-1, 1:-1].max() < 1e-3


def test_a_flat_gel_has_the_brightness_of_its_lights() -> None:
    model = imager()
    images = model.images(0.5, model.flat(), model.flat(), np.random.default_rng(0))
    expected = round(255 * BRIGHTNESS * float(np.sin(np.pi / 4)))
    assert images.stamp_s == 0.5
    for image in (images.left, images.right):
        assert image.shape == (*XENSE_GRIPPER.camera.shape, 3)  # type: ignore[union-attr]
        assert np.unique(image).tolist() == [expected]


def test_noise_has_its_spread_and_lights_have_their_gain() -> None:
    quiet, noisy = imager(image_light_gain=(0.8, 0.8)), imager(image_noise_sd=0.01)
    rng = np.random.default_rng(0)
    dim = quiet.images(0.0, quiet.flat(), quiet.flat(), rng).left
    assert np.unique(dim).tolist() == [round(255 * BRIGHTNESS * 0.8 * float(np.sin(np.pi / 4)))]
    image = noisy.images(0.0, noisy.flat(), noisy.flat(), rng).left.astype(float)
    assert image.std() == pytest.approx(np.hypot(2.55, np.sqrt(1 / 12)), rel=0.01)


def test_a_blurred_step_is_the_normal_integral() -> None:
    """A box's edge, D deep, becomes D Phi(r / s)."""
    depth, sd = 4e-4, 3e-4
    model = imager(image_blur_m=sd)
    x = np.where(np.arange(200)[None, :] < 100, depth, 0.0) * np.ones((350, 1))
    smooth = model._smoothed(x, sd)
    r = (99.5 - np.arange(200)) * XENSE_GRIPPER.image_pitch_m[1]
    assert np.abs(smooth[175] - depth * ndtr(r / sd)).max() < 0.01 * depth


def test_the_indentation_agrees_with_the_depth_map(mesh_of_ball: Mesh) -> None:
    """Averaged over the cells of a depth map, the image's indentation is that of the map."""
    gel = GelSensor(XENSE_GRIPPER.pad_window_m, XENSE_GRIPPER.pad_shape, XENSE_GRIPPER.pad_depth_m)
    rays, pose = SurfaceRays(mesh_of_ball), Pose(np.zeros(3)) @ pad_pose_P("right", 0.0195)
    map_m, shift_m = gel.press("right", [(rays, pose)], 10.0)
    fine = imager().indentation("right", [(rays, pose)], shift_m)

    deep = map_m > 3e-4  # elsewhere, a cell lies partly beyond the edge of the contact
    assert np.abs(fine.reshape(35, 10, 20, 10).mean(axis=(1, 3)) - map_m)[deep].max() < 2e-5


@pytest.fixture
def mesh_of_ball(tmp_path: Any) -> Mesh:
    ball = trimesh.creation.icosphere(4, 0.020)
    ball.apply_translation([0.0, 0.0, 0.020])
    ball.export(tmp_path / "ball.stl")
    return load_mesh(tmp_path / "ball.stl")


def squeezed(robot: MujocoRobot, drive: Callable[[MujocoRobot], Any], images: bool) -> list[Any]:
    driver = drive(robot)
    driver.jaws(0.070, time_s=0.3)
    driver.line((0.63, 0.08, -0.165), speed_m_s=0.2)
    driver.wait(0.6, Command(gripper=GripperTarget(0.020, 0.1, 10.0), tactile=True))
    if images:
        driver.wait(robot.period_s, Command(tactile=True, images=True))
    driver.wait(0.1, Command(tactile=True))
    return list(driver.observations)


def test_a_request_brings_one_pair_that_shows_the_block(
    open_robot: Callable[..., MujocoRobot], drive: Callable[[MujocoRobot], Any]
) -> None:
    """The flat side of a block leaves its edges in the image; snapshots hold pairs that are on their way."""
    robot = open_robot(load_conditions("realistic"), seed=3)
    seen = squeezed(robot, drive, images=True)
    pairs: list[GelImages] = [o.images for o in seen if o.images is not None]
    assert len(pairs) == 1
    assert pairs[0].left.std() > 2.0
    robot.cycle(Command(tactile=True, images=True))
    robot.cycle(Command(tactile=True))
    robot.cycle(Command(tactile=True))
    kept = encode(robot.snapshot())
    after = [robot.cycle(Command(tactile=True)) for _ in range(6)]
    assert any(o.images is not None for o in after)
    robot.restore(decode(kept))  # type: ignore[arg-type]
    assert encode([robot.cycle(Command(tactile=True)) for _ in range(6)]) == encode(after)
