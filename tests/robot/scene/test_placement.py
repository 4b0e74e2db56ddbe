"""Layouts against brute force: every pair of outlines is sampled densely."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from glotouch_bt.robot import Array, BadInput
from glotouch_bt.robot.scene.meshes import Mesh, load_mesh
from glotouch_bt.robot.scene.placement import Placement, gap, moved_apart, outline, place_objects, transformed
from glotouch_bt.robot.scene.streams import stream

SIZES = {"bar": (0.09, 0.03, 0.04), "cube": (0.05, 0.05, 0.05), "plate": (0.07, 0.04, 0.02), "peg": (0.02, 0.02, 0.06)}
INTERIOR = (0.30, 0.40)
STEP_M = 0.0005


@pytest.fixture(scope="module")
def meshes(tmp_path_factory: pytest.TempPathFactory) -> list[Mesh]:
    folder = tmp_path_factory.mktemp("stl")
    found = []
    for name, size in SIZES.items():
        solid = trimesh.creation.box(size)
        solid.export(folder / f"{name}.stl")
        mesh = load_mesh(Path(folder / f"{name}.stl"))
        off_centre = mesh.vertices_m + np.array([0.01, -0.02, 0.0])  # the frame is not the middle
        found.append(replace(mesh, vertices_m=off_centre))
    return found


def boundary(polygon: Array) -> Array:
    """Points at most STEP_M apart all along a closed polygon."""
    parts = []
    for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        n = max(2, int(np.ceil(np.linalg.norm(b - a) / STEP_M)))
        parts.append(a + np.linspace(0.0, 1.0, n, endpoint=False)[:, None] * (b - a))
    return np.concatenate(parts)


def inside(point: Array, polygon: Array) -> bool:
    """Crossing number."""
    x, y = point
    crossings = 0
    for (x0, y0), (x1, y1) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        if (y0 > y) != (y1 > y) and x < x0 + (y - y0) / (y1 - y0) * (x1 - x0):
            crossings += 1
    return crossings % 2 == 1


def sampled_gap(a: Array, b: Array) -> float:
    if inside(a[0], b) or inside(b[0], a):
        return 0.0
    p, q = boundary(a), boundary(b)
    return float(np.linalg.norm(p[:, None] - q[None], axis=-1).min())


@pytest.mark.parametrize("seed", range(50))
def test_gaps_hold(meshes: list[Mesh], seed: int) -> None:
    places = place_objects(meshes, INTERIOR, 0.030, 0.030, stream(seed, "layout"))
    polygons = [transformed(outline(m), p) for m, p in zip(meshes, places, strict=True)]
    for i, a in enumerate(polygons):
        assert (np.abs(a) <= 0.5 * np.array(INTERIOR) - 0.030 + 1e-12).all()
        for b in polygons[:i]:
            assert sampled_gap(a, b) >= 0.030


def test_gap_agrees_with_sampling() -> None:
    rng = np.random.default_rng(0)
    square = np.array([[-0.02, -0.01], [0.02, -0.01], [0.02, 0.01], [-0.02, 0.01]])
    overlapping = 0
    for _ in range(60):
        other = transformed(square, Placement(*rng.uniform(-0.05, 0.05, 2), float(rng.uniform(-3, 3))))
        exact, brute = gap(square, other), sampled_gap(square, other)
        overlapping += exact == 0.0
        assert exact <= brute + 1e-12
        assert brute <= exact + 2 * STEP_M
    assert 0 < overlapping < 60


def test_every_direction_and_place_is_drawn(meshes: list[Mesh]) -> None:
    one = meshes[1:2]
    draws = [place_objects(one, INTERIOR, 0.03, 0.03, stream(s, "layout"))[0] for s in range(200)]
    yaw, x = np.array([d.yaw_rad for d in draws]), np.array([d.x_m for d in draws])
    assert np.abs(np.exp(1j * yaw).mean()) < 0.15
    assert x.std() > 0.03


def test_too_many_are_refused(meshes: list[Mesh]) -> None:
    with pytest.raises(BadInput, match="do not fit") as caught:
        place_objects(meshes * 3, (0.15, 0.20), 0.030, 0.030, stream(0, "layout"))
    assert "fewer or smaller" in str(caught.value)


def test_an_object_far_from_its_files_origin_has_the_same_place(tmp_path: Path) -> None:
    found = []
    for name, shift_m in (("near", (0.0, 0.0, 0.0)), ("far", (3.0, -2.0, 1.5))):
        solid = trimesh.creation.box((0.06, 0.04, 0.05))
        solid.apply_translation(shift_m)
        solid.export(tmp_path / f"{name}.stl")
        mesh = load_mesh(tmp_path / f"{name}.stl")
        (place,) = place_objects([mesh], INTERIOR, 0.030, 0.030, stream(3, "layout"))
        found.append(transformed(outline(mesh), place))
    order = [np.lexsort(f.round(4).T) for f in found]
    assert found[0][order[0]] == pytest.approx(found[1][order[1]], abs=2e-6)


def test_objects_of_a_crowded_layout_touch_and_do_not_overlap(meshes: list[Mesh]) -> None:
    touching, half = [], 0.5 * np.array(INTERIOR)
    for seed in range(40):
        places = place_objects(meshes, INTERIOR, 0.0, 0.0, stream(seed, "layout"), touching_share=0.5)
        polygons = [transformed(outline(m), p) for m, p in zip(meshes, places, strict=True)]
        assert all((np.abs(a) < half).all() for a in polygons)
        gaps = [[sampled_gap(a, b) for b in polygons if b is not a] for a in polygons]
        assert min(map(min, gaps)) > 0.0
        walls = [float((half - np.abs(a)).min()) for a in polygons]
        touching += [min(*g, wall) < STEP_M for g, wall in zip(gaps, walls, strict=True)]
    assert 0.45 < np.mean(touching) < 0.75, "an object is also touched by another one that was moved to it"


def test_overlapping_outlines_are_moved_apart_by_little(meshes: list[Mesh]) -> None:
    for seed in range(20):
        places = place_objects(meshes, INTERIOR, 0.0, 0.0, stream(seed, "layout"), touching_share=1.0)
        grown = [1.02 * outline(m) for m in meshes]  # true solids are larger than their files
        apart = moved_apart(grown, places, INTERIOR)
        polygons = [transformed(o, p) for o, p in zip(grown, apart, strict=True)]
        assert all((np.abs(a) <= 0.5 * np.array(INTERIOR)).all() for a in polygons)
        assert min(sampled_gap(a, b) for i, a in enumerate(polygons) for b in polygons[:i]) > 0.0
        assert max(np.hypot(a.x_m - p.x_m, a.y_m - p.y_m) for a, p in zip(apart, places, strict=True)) < 0.006


def test_outlines_that_do_not_overlap_stay(meshes: list[Mesh]) -> None:
    places = place_objects(meshes, INTERIOR, 0.001, 0.001, stream(1, "layout"))
    assert moved_apart([outline(m) for m in meshes], places, INTERIOR) == places
