"""Sides, jaws and look-alikes of shapes whose answer is known."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh

from glotouch_bt.mission import feasible
from glotouch_bt.mission.read import load_world, shipped_root
from glotouch_bt.objects import Prepared, RefusedFile, look_alikes, prepare
from glotouch_bt.perception import model_for
from glotouch_bt.perception.recognition import TargetModel
from glotouch_bt.robot import Gripper, load_backend
from glotouch_bt.robot.scene import load_mesh, stl_files

TURN = trimesh.transformations.rotation_matrix


@pytest.fixture(scope="module")
def gripper() -> Gripper:
    description = load_backend("mujoco").description
    assert description is not None
    return description.gripper


def made(solid: trimesh.Trimesh, folder: Path, side: int | None = None, gripper: Gripper | None = None) -> Prepared:
    solid.export(folder / "a.stl")
    found = prepare(folder / "a.stl", None, side, gripper)
    assert isinstance(found, Prepared), found
    return found


def test_a_box_has_six_sides_with_the_shares_of_their_solid_angles(tmp_path: Path) -> None:
    size = np.array([0.03, 0.05, 0.08])
    found = made(trimesh.creation.box(size), tmp_path)
    assert found.mesh.extents_m == pytest.approx(size, abs=1e-6)  # stays as it is
    a, b, c = size
    top = 4 * math.asin(a * b / math.sqrt((a * a + c * c) * (b * b + c * c))) / (4 * math.pi)
    assert sum(s.share for s in found.sides) == pytest.approx(1.0)
    assert found.sides[found.side or 0].share == pytest.approx(top, rel=1e-6)


def test_a_side_can_be_chosen(tmp_path: Path) -> None:
    heights = {
        round(float(made(trimesh.creation.box((0.03, 0.05, 0.08)), tmp_path, n).mesh.extents_m[2]), 4)
        for n in range(1, 7)
    }
    assert heights == {0.03, 0.05, 0.08}
    refused = prepare(tmp_path / "a.stl", None, 7)
    assert isinstance(refused, RefusedFile)
    assert refused.reason == "has no side 7 (it has 6 sides on which it stands)"


@pytest.mark.parametrize(
    ("lean_deg", "said"), [(0.0, ""), (9.0, "leaned by 9.0 deg; stood upright"), (40.0, "would not stand")]
)
def test_a_leaning_box_is_stood_up(lean_deg: float, said: str, tmp_path: Path) -> None:
    solid = trimesh.creation.box((0.05, 0.05, 0.05))
    solid.apply_transform(TURN(math.radians(lean_deg), (1, 0, 0)))
    found = made(solid, tmp_path)
    assert found.mesh.extents_m == pytest.approx([0.05] * 3, abs=1e-6)
    assert any(said in note for note in found.notes) or not said


def test_a_ball_may_roll(tmp_path: Path) -> None:
    assert made(trimesh.creation.icosphere(3, 0.03), tmp_path).notes == ("stands firmly on no side: it may roll",)


@pytest.mark.parametrize(
    ("size_m", "said", "fault"),
    [
        ((0.06, 0.05, 0.03), "every yaw, 50 to 78 mm", ""),
        ((0.12, 0.05, 0.03), "of yaws: 1", ""),
        ((0.12, 0.11, 0.03), "too wide: 110 mm, the jaws open 85 mm", "a is 110 mm across at its narrowest"),
        ((0.03, 0.03, 0.135), "every yaw", "is 135 mm high: above 131 mm the hand's body"),
        ((0.06, 0.06, 0.008), "", "a cannot be felt: it is 8.0 mm high"),
    ],
)
def test_jaws(size_m: tuple[float, ...], said: str, fault: str, gripper: Gripper, tmp_path: Path) -> None:
    found = made(trimesh.creation.box(size_m), tmp_path, gripper=gripper)
    assert said in (found.fit.in_words() if found.fit is not None else "")
    assert [f for f in found.faults if fault in f] if fault else found.faults == ()


def models(folder: Path, gripper: Gripper, *solids: trimesh.Trimesh) -> list[TargetModel]:
    for i, solid in enumerate(solids):
        solid.export(folder / f"o{i}.stl")
    return [model_for(load_mesh(p), gripper) for p in sorted(folder.glob("o*.stl"))]


def test_look_alikes(gripper: Gripper, tmp_path: Path) -> None:
    """The larger the difference, the fewer closures; a copy is not told apart; another size is no look-alike."""
    other, waists = trimesh.creation.box((0.1, 0.04, 0.03)), []
    for depth in (0.0, 0.0, 0.0004, 0.008):
        rings = [(0.02, 0.0), (0.02, 0.01), (0.02 - depth, 0.015), (0.02, 0.02), (0.02, 0.03)]
        profile = np.array([(0.0, 0.0), *rings, (0.0, 0.03)])
        waists.append(trimesh.creation.revolve(profile, sections=24))
    found = {(p.first, p.second): p.closures for p in look_alikes(models(tmp_path, gripper, other, *waists))}
    assert not [pair for pair in found if "o0" in pair]
    assert found["o1", "o2"] is None
    assert (found["o1", "o3"] or math.inf) > (found["o1", "o4"] or math.inf)
    assert found["o1", "o4"] is not None


def test_the_shipped_objects_need_no_check(gripper: Gripper) -> None:
    """`check_feasible` skips them: they fit into every shipped world's box and between the jaws."""
    for path in stl_files(shipped_root() / "objects").values():
        assert not feasible.ungraspable(load_mesh(path), gripper)
    for world in ("container_five", "close_five"):
        scene = load_world(world)
        feasible.draw_layout(feasible.load_folder(scene.objects.folder), scene, feasible.SEED)
