"""The sides on which the target may stand: which feel alike, their weights, and a lying target that is found."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh

from glotouch_bt.perception.recognition import MATCHERS, PadSpec
from glotouch_bt.perception.sides import TOPPLED_PRIOR, model_with_sides
from glotouch_bt.robot.scene import UPRIGHT, Mesh, load_mesh, standing
from tests.support.acquisition import IDEAL, acquire

PAD = PadSpec()


def written(folder, name: str, solid: trimesh.Trimesh) -> Mesh:
    solid.export(folder / f"{name}.stl")
    return load_mesh(folder / f"{name}.stl")


@pytest.fixture
def brick(tmp_path) -> Mesh:
    """A brick of 70 x 45 x 28 mm, standing on its largest side."""
    return written(tmp_path, "brick", trimesh.creation.box([0.070, 0.045, 0.028]))


def test_a_cube_is_the_same_on_every_side(tmp_path) -> None:
    (only,) = model_with_sides(written(tmp_path, "cube", trimesh.creation.box([0.05] * 3)), PAD, "any").hypotheses
    assert (only.quat, only.weight) == (UPRIGHT, pytest.approx(1.0))


def test_a_brick_has_three_sides_by_solid_angle(brick) -> None:
    """The solid angle of a rectangle a x b at distance h from its middle: 4 asin(ab / sqrt((a2+h2)(b2+h2)))."""
    found = {round(h.model.height_m, 3): h.weight for h in model_with_sides(brick, PAD, "any").hypotheses}

    def share(a: float, b: float, h: float) -> float:
        return 2 * math.asin(a * b / math.sqrt((a * a + h * h) * (b * b + h * h))) * 4 / (4 * math.pi)

    expected = {0.028: share(70, 45, 28), 0.045: share(70, 28, 45), 0.070: share(45, 28, 70)}
    assert sum(expected.values()) == pytest.approx(1.0)
    assert found == pytest.approx(expected, abs=1e-3)


def test_the_side_of_the_file_is_always_a_hypothesis(tmp_path) -> None:
    """A plate on its short edge, which is improbable (below 3 %). A plan that names no side has the file's."""
    plate = written(tmp_path, "plate", trimesh.creation.box([0.060, 0.006, 0.110]))
    model = model_with_sides(plate, PAD, "any")
    assert model.standing(UPRIGHT).height_m == pytest.approx(0.110)


def test_in_an_upright_world_it_stands_unless_it_toppled(brick) -> None:
    first, *others = model_with_sides(brick, PAD, "upright").hypotheses
    assert first.quat == UPRIGHT
    assert first.weight >= 1.0 - TOPPLED_PRIOR
    assert sum(h.weight for h in others) <= TOPPLED_PRIOR
    assert len(others) == 2


@pytest.mark.parametrize("stance", ["upright", "any"])
def test_a_lying_target_is_found_with_its_side(tmp_path, brick, stance: str) -> None:
    model = model_with_sides(brick, PAD, stance)
    lying = max((h for h in model.hypotheses if h.quat != UPRIGHT), key=lambda h: h.weight)
    other = written(tmp_path, "can", trimesh.creation.cylinder(0.025, 0.06, sections=64))
    meshes = (other, standing(brick, lying.quat))
    sets = [acquire(m, (0.08 * i, 0.02, 0.4), IDEAL, np.random.default_rng(i), i)[0] for i, m in enumerate(meshes)]
    best = MATCHERS["likelihood"](model, sets).best
    assert (best.index, best.quat) == (1, lying.quat)
    assert best.probability > 0.8
    np.testing.assert_allclose(best.pose_K_O[:2], [0.08, 0.02], atol=4e-3)
    assert model.standing(best.quat).height_m == pytest.approx(lying.model.height_m)


def test_a_standing_mesh_keeps_its_shape(brick) -> None:
    lying = model_with_sides(brick, PAD, "any").hypotheses[1]
    mesh = standing(brick, lying.quat)
    low, high = mesh.vertices_m.min(axis=0), mesh.vertices_m.max(axis=0)
    np.testing.assert_allclose([*(low + high)[:2], low[2]], 0.0, atol=1e-12)
    assert mesh.as_trimesh().volume == pytest.approx(brick.as_trimesh().volume)
    assert mesh.digest != brick.digest
