"""What a fault does to the simulated world, against mechanics and against what else the simulator says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from backends.mujoco import MujocoBackend
from glotouch_bt.faults import FaultInjector
from glotouch_bt.mission.library import shipped_root
from glotouch_bt.mission.load import load_mission
from glotouch_bt.mission.worlds import load_conditions
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
    assert proof.acts.moved_m == pytest.approx(moved.max(), rel=0.1)  # centre of mass here, mesh frame there
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
    assert cell.injector.proofs()[0].acts.moved_m > 0.5


def test_the_container_takes_its_content_along(folder: Path) -> None:
    cell = Cell(folder, "  - {fault: container_offset, with: {shift_m: [10 mm, 5 mm]}, when: {cycle: 5}, for: 1 s}")
    before, box = cell.places(), cell.referee.pose_B_K().position_m
    walls = cell.walls()
    cell.run(60)
    assert np.allclose(cell.walls() - walls, [0.01, 0.005, 0.0]), "its walls, as they collide"
    assert np.allclose(cell.referee.pose_B_K().position_m - box, [0.01, 0.005, 0.0])
    assert np.allclose(cell.places() - before, [0.01, 0.005, 0.0], atol=5e-4)


def test_bolted_objects_cannot_be_moved(folder: Path) -> None:
    with pytest.raises(BadInput, match="bolted"):
        Cell(folder, "  - {fault: object_added}", fixed=True)
