"""The drawn robot moves as Pinocchio says, and its parts are where the description has them."""

from __future__ import annotations

from functools import reduce

import numpy as np
import pytest

from glotouch_backends.robots import load_robot, shipped_robots
from glotouch_bt.motion import Kinematics
from glotouch_bt.report.scene import shapes
from glotouch_bt.robot import Probe, RobotDescription


@pytest.fixture(params=sorted(shipped_robots()))
def robot(request: pytest.FixtureRequest) -> RobotDescription:
    return load_robot(request.param)


@pytest.mark.parametrize("seed", range(5))
def test_the_hand_is_where_the_kinematics_have_it(robot: RobotDescription, seed: int) -> None:
    q = np.random.default_rng(seed).uniform(-1.2, 1.2, robot.dof)
    chain = [*shapes.joint_poses(robot, q), robot.pose_last_E, robot.gripper.pose_E_P]
    drawn = reduce(lambda a, b: a @ b, chain)
    true = Kinematics(robot).fk(q)
    np.testing.assert_allclose(drawn.position_m, true.position_m, atol=1e-9)
    np.testing.assert_allclose(drawn.rotation, true.rotation, atol=1e-9)


def test_a_capsule_reaches_from_its_start_to_its_end(robot: RobotDescription) -> None:
    solids = {(s.frame, s.name): s for s in shapes.robot_solids(robot)}
    for frame, joint in zip(shapes.joint_frames(robot), robot.joints, strict=True):
        for i, capsule in enumerate(joint.link.capsules):
            vertices = solids[frame, f"housing{i}"].vertices_m
            a, b = np.array(capsule.start_m), np.array(capsule.end_m)
            along = np.clip((vertices - a) @ (b - a) / max((b - a) @ (b - a), 1e-12), 0.0, 1.0)
            distance = np.linalg.norm(vertices - a - along[:, None] * (b - a), axis=1)
            np.testing.assert_allclose(distance, capsule.radius_m, rtol=0.02)


def test_the_gels_face_each_other_at_the_opening(robot: RobotDescription) -> None:
    solids = {(s.frame, s.name): s for s in shapes.robot_solids(robot)}
    faces = {}
    for frame, side in (("left", 1.0), ("right", -1.0)):
        y = solids[frame, "gel"].vertices_m[:, 1] + shapes.finger_shift_m(0.06, side)[1]
        faces[frame] = y.min() if side > 0 else y.max()
    assert faces["left"] - faces["right"] == pytest.approx(0.06)


def test_the_ball_ends_where_the_probe_does() -> None:
    probe = Probe()
    ball = next(s for s in shapes.probe_solids(probe) if s.name == "ball")
    assert ball.vertices_m[:, 2].max() == pytest.approx(0.5 * probe.handle_m[2] + probe.length_m, abs=1e-4)


def test_a_band_is_as_wide_as_told() -> None:
    outline = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [1.0, 0.0]])
    vertices, faces = shapes.band(outline, 0.1 * outline, 0.5)
    radius = np.linalg.norm(vertices[:, :2], axis=1)
    np.testing.assert_allclose(radius, [0.9] * 5 + [1.1] * 5)
    assert faces.max() == len(vertices) - 1
    assert (vertices[:, 2] == 0.5).all()
