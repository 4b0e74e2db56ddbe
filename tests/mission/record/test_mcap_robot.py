"""Robot, frames and log in the record, as an MCAP viewer reads them; the frames against the kinematics."""

from __future__ import annotations

import json
from collections import defaultdict
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader

from glotouch_backends.robots import load_robot, shipped_robots
from glotouch_bt.mission.record import Recorder
from glotouch_bt.motion import Kinematics
from glotouch_bt.robot import HOLD, GripperState, Observation, Pose, RobotDescription

K = Pose.planar([0.6, 0.1, -0.2], 0.3)
OPENING_M = 0.03


@pytest.fixture(scope="module", params=sorted(shipped_robots()))
def robot(request: pytest.FixtureRequest) -> RobotDescription:
    return load_robot(request.param)


@pytest.fixture(scope="module")
def shown(robot: RobotDescription, tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[dict[str, Any]]]:
    """The messages of a record of ten cycles with a moving arm, by topic."""
    path = tmp_path_factory.mktemp("shown") / "run.mcap"
    container = {"pose_B_K": K, "interior_m": (0.3, 0.4, 0.1)}
    rng = np.random.default_rng(3)
    with Recorder(path, {"robot": {"description": robot}, "container": container}) as record:
        for k in range(10):
            q = np.tile(rng.uniform(-1.0, 1.0, 7), (1, 1))
            at, turn = np.array([[0.5, 0.1, 0.2]]), np.array([[0.0, 1.0, 0.0, 0.0]])
            jaws = GripperState(0.01 * (k + 1), OPENING_M, 5.0, False)
            record.block(
                Observation(np.array([0.01 * (k + 1)]), q, 0 * q, at, turn, np.zeros((1, 6)), jaws, None), HOLD
            )
        record.event("failure", 0.05, {"node": "a/grasp", "code": "slipped", "message": "it slipped"})
        record.event("sweep", 0.06, {"path_K_m": []})
    found: dict[str, list[dict[str, Any]]] = defaultdict(list)
    with path.open("rb") as f:
        for _, channel, message in make_reader(f).iter_messages():
            if channel.message_encoding == "json":
                found[channel.topic].append(json.loads(message.data))
    return found


def pose_of(transform: dict[str, Any]) -> Pose:
    t, r = transform["translation"], transform["rotation"]
    return Pose(np.array([t["x"], t["y"], t["z"]]), np.array([r["w"], r["x"], r["y"], r["z"]]))


def test_the_frames_are_those_of_the_kinematics(
    robot: RobotDescription, shown: dict[str, list[dict[str, Any]]]
) -> None:
    assert len(shown["/tf"]) == len(shown["/joints"]) == 3
    for frames, joints in zip(shown["/tf"], shown["/joints"], strict=True):
        by_name = {t["child_frame_id"]: t for t in frames["transforms"]}
        pose, name = pose_of(by_name["E"]), by_name["E"]["parent_frame_id"]
        while name != "B":
            pose, name = pose_of(by_name[name]) @ pose, by_name[name]["parent_frame_id"]
        q = np.array([j["position"] for j in joints["joints"]])
        pads = pose @ robot.gripper.pose_E_P
        true = Kinematics(robot).fk(q)
        np.testing.assert_allclose(pads.position_m, true.position_m, atol=5e-6)
        np.testing.assert_allclose(pads.rotation, true.rotation, atol=5e-6)
        np.testing.assert_allclose(pose_of(by_name["K"]).position_m, K.position_m, atol=1e-6)
        assert by_name["left"]["translation"]["y"] - by_name["right"]["translation"]["y"] == pytest.approx(OPENING_M)
        assert {t["timestamp"]["nsec"] for t in frames["transforms"]} == {joints["timestamp"]["nsec"]}


def test_the_shapes_stand_in_known_frames(robot: RobotDescription, shown: dict[str, list[dict[str, Any]]]) -> None:
    (world,) = shown["/scene/world"]
    frames = {t["child_frame_id"] for t in shown["/tf"][0]["transforms"]} | {"B"}
    assert {e["frame_id"] for e in world["entities"]} <= frames
    drawn = sum(len(e["cylinders"]) + len(e["spheres"]) + len(e["cubes"]) for e in world["entities"])
    capsules = [*robot.base.capsules, *(c for j in robot.joints for c in j.link.capsules)]
    assert drawn == 3 * len(capsules) + len(robot.gripper.body) + 2 + 5


def test_the_log_has_events_in_words(shown: dict[str, list[dict[str, Any]]]) -> None:
    (line,) = shown["/log"]
    assert (line["level"], line["message"], line["name"]) == (4, "failure: grasp: it slipped", "a/grasp")
