"""The effect of faults on the simulated world, against mechanics and the simulator's other outputs."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from glotouch_backends.mujoco import MujocoBackend
from glotouch_bt.faults import FaultInjector
from glotouch_bt.mission.load import load_mission
from glotouch_bt.mission.read.library import shipped_root
from glotouch_bt.mission.read.worlds import load_conditions
from glotouch_bt.robot import HOLD, BadInput
from tests.faults.conftest import plan_of

LAYOUT = {"apple": (0.0, -0.08, 0.0), "train": (0.0, 0.08, 0.3)}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    source, target = shipped_root() / "objects", tmp_path_factory.mktemp("two")
    for name in LAYOUT:
        (target / f"{name}.stl").write_bytes((source / f"{name}.stl").read_bytes())
    return target


class Cell:
    def __init__(self, folder: Path, text: str, seed: int = 3, **options: object) -> None:
        self.backend = MujocoBackend()
        world = load_mission("calibrate", objects=folder).world
        conditions = load_conditions("ideal")
        self.device = self.backend.open(world, conditions, seed, {"layout": LAYOUT, **options})
        self.referee = self.backend.referee(self.device)
        disturber = self.backend.disturber(self.device)
        self.injector = FaultInjector(self.device, plan_of(text), seed, disturber=disturber)

    def places(self) -> np.ndarray:
        return np.array([o.pose_B_O.position_m for o in self.referee.objects()])

    def probe_B_m(self) -> np.ndarray:
        return np.array(self.device.data.xpos[self.device.handles.probe_body])

    def walls(self) -> np.ndarray:
        """Where the container's geoms are when they collide."""
        robot = self.device
        mine = robot.model.geom_bodyid == robot.handles.container_body
        return np.array(robot.data.geom_xpos[mine])

    def run(self, cycles: int) -> None:
        for _ in range(cycles):
            self.injector.cycle(HOLD)


def test_a_shoved_object_slides_as_friction_lets_it(folder: Path) -> None:
    """v^2 / (2 mu g) with mu the object's own (0.6 in ideal conditions); the other one stays."""
    cell = Cell(
        folder, "  - {fault: object_shoved, with: {which: nearest, speed_m_s: 0.5}, when: {cycle: 5}, for: 1 s}"
    )
    before = cell.places()
    cell.run(70)
    moved = np.linalg.norm(cell.places() - before, axis=1)
    expected = 0.5**2 / (2 * 0.6 * 9.81)
    proof = cell.injector.proofs()[0]
    assert proof.actions.moved_m == pytest.approx(moved.max(), rel=0.1)  # centre of mass here, mesh frame there
    assert 0.5 * expected < moved.max() < 1.6 * expected
    assert moved.min() < 1e-4


def test_a_toppled_object_lies_on_the_floor_turned_by_a_quarter(folder: Path) -> None:
    cell = Cell(folder, "  - {fault: object_toppled, with: {which: nearest}, when: {cycle: 5}, for: 1 s}")
    before = cell.referee.objects()
    cell.run(6)
    after = cell.referee.objects()
    turns = [float((a.pose_B_O.rotation.T @ b.pose_B_O.rotation)[2, 2]) for a, b in zip(after, before, strict=True)]
    assert min(turns) == pytest.approx(0.0, abs=0.05)
    assert max(turns) == pytest.approx(1.0, abs=1e-3)
    cell.run(60)
    floor = cell.referee.pose_B_K().position_m[2]
    for item, mesh in zip(cell.referee.objects(), cell.device.truth.objects, strict=True):
        lowest = item.pose_B_O.apply(mesh.mesh.vertices_m)[:, 2].min()
        assert -0.002 < lowest - floor < 0.01


def test_taken_away_and_put_back(folder: Path) -> None:
    cell = Cell(folder, "  - {fault: object_added, with: {which: nearest}, when: {cycle: 20}, for: 1 s}")
    inside = 0.25
    away = np.linalg.norm(cell.places()[:, :2] - cell.referee.pose_B_K().position_m[:2], axis=1)
    assert (away > inside).sum() == 1
    cell.run(60)
    again = np.linalg.norm(cell.places()[:, :2] - cell.referee.pose_B_K().position_m[:2], axis=1)
    assert (again < inside).all()
    cell = Cell(folder, "  - {fault: object_removed, with: {which: farthest}, when: {cycle: 2}, for: 1 s}")
    cell.run(60)
    away = np.linalg.norm(cell.places()[:, :2] - cell.referee.pose_B_K().position_m[:2], axis=1)
    assert (away > inside).sum() == 1
    assert cell.injector.proofs()[0].actions.moved_m > 0.5


def test_the_container_takes_its_content_along(folder: Path) -> None:
    cell = Cell(folder, "  - {fault: container_offset, with: {shift_m: [10 mm, 5 mm]}, when: {cycle: 5}, for: 1 s}")
    before, box = cell.places(), cell.referee.pose_B_K().position_m
    walls = cell.walls()
    cell.run(60)
    assert np.allclose(cell.walls() - walls, [0.01, 0.005, 0.0]), "its walls, as they collide"
    assert np.allclose(cell.referee.pose_B_K().position_m - box, [0.01, 0.005, 0.0])
    assert np.allclose(cell.places() - before, [0.01, 0.005, 0.0], atol=5e-4)


NEARER = {"apple": (0.0, -0.06, 0.0), "train": (0.0, 0.10, 0.3)}


def put(cell: Cell, body: int, at_B_m: np.ndarray) -> None:
    """A body stands elsewhere from now on, behind the faults' back."""
    robot = cell.device
    start = robot.model.jnt_qposadr[robot.model.body_jntadr[body]]
    robot.data.qpos[start : start + 3] = at_B_m
    robot.data.qvel[:] = 0.0
    mujoco.mj_kinematics(robot.model, robot.data)


def touch_with_the_probe(cell: Cell, index: int) -> None:
    """The ball a tenth of a millimetre in an object's top, the probe upright as in the hand."""
    robot = cell.device
    probe, item = robot.world.probe, cell.referee.objects()[index].pose_B_O
    vertices = item.apply(robot.truth.objects[index].mesh.vertices_m)
    top = vertices[vertices[:, 2].argmax()]
    up = np.array([0.0, 0.0, probe.grasp_to_tip_m + probe.tip_radius_m - 1e-4])
    put(cell, robot.handles.probe_body, top + up)


@pytest.mark.parametrize("fault", ["container_offset", "object_shoved", "object_toppled", "object_removed"])
def test_what_the_robot_touches_waits(folder: Path, fault: str) -> None:
    """A touched object is not moved; once the probe is off it, it is, and the report says when and why so late."""
    cell = Cell(folder, f"  - {{fault: {fault}, when: {{cycle: 5}}, for: 1 s}}", layout=NEARER)
    proof, box, stowed = cell.injector.proofs()[0], cell.referee.pose_B_K().position_m, cell.probe_B_m()
    before = cell.places()
    for _ in range(20):
        touch_with_the_probe(cell, 0)
        cell.injector.cycle(HOLD)
    assert np.allclose(cell.places(), before, atol=5e-4)
    assert np.array_equal(cell.referee.pose_B_K().position_m, box)
    assert proof.changes == 0
    assert len(proof.begun_s) == 1
    put(cell, cell.device.handles.probe_body, stowed)
    cell.run(60)
    assert proof.actions.count == 1
    assert proof.first_s == pytest.approx(proof.begun_s[0] + 0.15, abs=0.05)
    assert "without room: " in proof.actions.notes[-1]
    assert "probe" in proof.actions.notes[-1]
    assert proof.actions.moved_m > 0.002


def test_what_never_has_room_is_void_and_says_why(folder: Path) -> None:
    text = "  - {fault: container_offset, when: {cycle: 5}, for: 100 ms}"
    cell = Cell(folder, text, layout=NEARER)
    for _ in range(30):
        touch_with_the_probe(cell, 0)
        cell.injector.cycle(HOLD)
    (report,) = cell.injector.report()
    assert not report["effective"]
    (note,) = report["notes"]
    assert note.startswith("never had room: ")
    assert "probe" in note
    assert "object0" in note


def test_what_hangs_in_the_hand_does_not_go_with_the_container(folder: Path) -> None:
    cell = Cell(folder, "  - {fault: container_offset, with: {shift_m: [0, 10 mm]}, when: {cycle: 5}, for: 1 s}")
    before = cell.places()[1]
    for _ in range(10):
        put(cell, cell.device.handles.object_bodies[0], cell.device.observe().position_B_P[-1])
        hangs = cell.places()[0]
        cell.injector.cycle(HOLD)
        assert np.linalg.norm((cell.places()[0] - hangs)[:2]) < 0.002, "but for what its overlap with a finger does"
    assert np.allclose(cell.places()[1] - before, [0.0, 0.01, 0.0], atol=5e-4)


@pytest.mark.parametrize("gap_m", [0.003, 0.030])
def test_nothing_is_moved_through_the_probe(folder: Path, gap_m: float) -> None:
    """A wall that would jump over the shaft (6 mm) by 60 mm: the way there is looked at, not only its end."""
    text = "  - {fault: container_offset, with: {shift_m: [0 mm, 60 mm]}, when: {cycle: 5}, for: 1 s}"
    cell = Cell(folder, text)
    robot = cell.device
    K, interior = cell.referee.pose_B_K(), robot.world.container.interior_m
    wall = K.apply([0.0, 0.5 * interior[1] + robot.world.container.wall_m, 0.0])
    up = robot.world.probe.grasp_to_tip_m + 0.03
    for _ in range(10):  # upright in the air outside of the wall
        put(cell, robot.handles.probe_body, np.array([wall[0], wall[1] + gap_m + 0.003, K.position_m[2] + up]))
        cell.injector.cycle(HOLD)
    assert cell.injector.proofs()[0].changes == 0
    assert np.array_equal(cell.referee.pose_B_K().position_m, K.position_m)


def test_bolted_objects_cannot_be_moved(folder: Path) -> None:
    with pytest.raises(BadInput, match="bolted"):
        Cell(folder, "  - {fault: object_added}", fixed=True)
