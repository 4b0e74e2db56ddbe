"""The first run_doctor to a robot: what it finds is compared with what is true."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glotouch_bt.commissioning.doctor import (
    DoctorFinding,
    _pressed,
    jaws,
    nearly_empty,
    pads,
    place,
    rates,
    run_doctor,
    walls,
    wrist,
)
from glotouch_bt.commissioning.registration import WallContact, solve
from glotouch_bt.mission.load import load_mission
from glotouch_bt.robot import Conditions, GripperState, Observation, Pose, TactileFrame, World, load_backend
from glotouch_bt.robot.fake import FakeBackend, FakeRobot

HALF = np.array([0.15, 0.20])


@pytest.fixture(scope="module")
def world() -> World:
    return nearly_empty(load_mission("retrieve", {}).world)


@given(st.floats(-5e-3, 5e-3), st.floats(-5e-3, 5e-3), st.floats(-0.02, 0.02), st.floats(-3e-3, 3e-3))
def test_a_shifted_and_turned_box_is_found_from_four_touches(x: float, y: float, yaw: float, z: float) -> None:
    true = Pose.planar((x, y, 0.0), yaw)
    touches = []
    for axis, side, along in ((0, 1.0, -0.06), (0, 1.0, 0.06), (1, 1.0, 0.0), (1, -1.0, 0.0)):
        normal = np.zeros(2)
        normal[axis] = side
        # Along the nominal normal from the inside, at the nominal place: where is the true wall?
        n = true.rotation[:2, :2] @ normal
        begin = np.zeros(2)
        begin[1 - axis] = along
        reach = (HALF[axis] + n @ true.position_m[:2] - n @ begin) / (n @ normal)
        touches.append(WallContact("wall", normal, np.array([*(begin + reach * normal), 0.0]), HALF[axis], 3.0))
    found = solve(touches, z, Pose(np.zeros(3)))
    assert found.yaw_rad == pytest.approx(yaw, abs=1e-4)  # linear in the turn
    assert found.shift_K_m == pytest.approx([x, y, z], abs=1.5e-4)
    assert found.residual_m < 1.5e-4


def test_a_box_of_another_length_shows() -> None:
    touches = [
        WallContact("wall", np.array([0.0, s]), np.array([0.0, 0.21 * s, 0.0]), 0.20, 3.0) for s in (1.0, -1.0)
    ] + [WallContact("wall", np.array([1.0, 0.0]), np.array([0.15, a, 0.0]), 0.15, 3.0) for a in (-0.06, 0.06)]
    assert solve(touches, 0.0, Pose(np.zeros(3))).residual_m == pytest.approx(0.01)


def a_press(side: str, row: int, column: int) -> DoctorFinding:
    flat = {"left_m": np.zeros((35, 20)), "right_m": np.zeros((35, 20))}
    map_m = np.zeros((35, 20))
    map_m[row, column] = 5e-4
    return _pressed(TactileFrame(0.0, **flat), TactileFrame(1.0, **{**flat, f"{side}_m": map_m}))


def test_a_press_tells_how_the_pads_are_mounted() -> None:
    assert a_press("left", 30, 15).good
    assert "swapped" in a_press("right", 30, 15).text
    assert "rows" in a_press("left", 3, 15).text
    assert "mirrored" in a_press("left", 30, 3).text
    flat = TactileFrame(0.0, np.zeros((35, 20)), np.zeros((35, 20)))
    assert _pressed(flat, flat).good is False


def bad(findings: Iterator[DoctorFinding]) -> list[str]:
    return [f"{f.step} {f.what}" for f in findings if f.good is False]


def test_a_good_robot_is_good(world: World) -> None:
    robot = FakeRobot()
    for step in (rates(robot), wrist(robot, "tared"), place(robot, world), jaws(robot, lambda _: True)):
        assert bad(step) == []
    assert bad(pads(robot, None)) == []


class Wrong(FakeRobot):
    """Slow sensing, jaws that go the other way, a wrench that is never zero."""

    def cycle(self, command: object) -> Observation:
        o = super().cycle(command)  # type: ignore[arg-type]
        g = o.gripper
        aperture = self.description.gripper.stroke_m - g.aperture_m
        wrench = o.wrench_S + np.array([0.0, 0.0, 7.0, 0.0, 0.0, 0.0])
        return replace(o, wrench_S=wrench, gripper=GripperState(g.stamp_s, aperture, g.force_N, g.moving))


def test_what_is_wrong_is_found() -> None:
    robot = Wrong(samples=2)
    assert bad(rates(robot)) == ["rates samples"]
    assert bad(wrist(robot, "tared")) == ["wrist bias"]
    assert bad(wrist(robot, "as found")) == []
    assert "jaws answer" in bad(jaws(robot, None))
    assert bad(jaws(FakeRobot(), lambda _: False)) == ["jaws direction"]


def test_nothing_is_moved_without_a_yes(world: World) -> None:
    robots: list[FakeRobot] = []

    class Kept(FakeBackend):
        def open(self, *arguments: object) -> FakeRobot:  # type: ignore[override]
            robots.append(FakeRobot())
            return robots[-1]

    asked: list[str] = []

    def no(question: str) -> bool:
        asked.append(question)
        return False

    list(run_doctor(Kept(), world, Conditions(), {}, no, sure=True))
    assert len(asked) == 3
    assert all(c.motion is None and c.gripper is None for c in robots[0].commands)


def test_the_container_is_where_the_simulation_has_it(world: World) -> None:
    backend = load_backend("mujoco")
    conditions = Conditions(registration_sd_m=0.002, registration_sd_deg=0.5)
    with backend.open(world, conditions, 3, {}) as robot:
        referee = backend.referee(robot)
        assert referee is not None
        true = referee.pose_B_K()
        (finding,) = walls(robot, world)
        assert referee.peak_force_N() < 12.0
    assert finding.good
    assert np.asarray(finding.values["position_m"]) == pytest.approx(true.position_m, abs=7e-4)
    assert finding.values["pose_yaw_deg"] == pytest.approx(np.degrees(true.yaw_rad), abs=0.15)
