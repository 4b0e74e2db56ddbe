"""Stable sides of objects, and layouts with them."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
import trimesh

from glotouch_bt.mission.read import load_world
from glotouch_bt.robot.scene import UPRIGHT, Mesh, draw_layout, load_folder
from glotouch_bt.robot.scene.placement import gap, outline, transformed
from glotouch_bt.robot.scene.stances import draw_stance, turned


def solid(shape: trimesh.Trimesh, name: str = "solid") -> Mesh:
    return Mesh(name, np.array(shape.vertices), np.array(shape.faces, dtype=np.int64), f"{name} {shape.extents}")


def test_a_box_stands_on_its_six_sides_by_their_solid_angles() -> None:
    mesh, rng = solid(trimesh.creation.box((0.02, 0.04, 0.06))), np.random.default_rng(0)
    heights = [round(float(np.ptp(turned(mesh, draw_stance(mesh, rng)).vertices_m[:, 2])), 4) for _ in range(3000)]
    shares = {h: heights.count(h) / len(heights) for h in set(heights)}
    assert set(shares) == {0.02, 0.04, 0.06}

    def share(a: float, b: float, height: float) -> float:
        """Solid angle of a rectangle a x b at half the height, for both sides, over 4 pi (in closed form)."""
        d = 0.5 * height
        return 2 * 4 * np.arctan(a * b / (4 * d * np.sqrt(d * d + (a * a + b * b) / 4))) / (4 * np.pi)

    for height, (a, b) in {0.06: (0.02, 0.04), 0.04: (0.02, 0.06), 0.02: (0.04, 0.06)}.items():
        assert shares[height] == pytest.approx(share(a, b, height), abs=0.03)


def test_an_object_without_a_stable_side_stays_upright() -> None:
    ball = solid(trimesh.creation.icosphere(4, 0.03))
    assert draw_stance(ball, np.random.default_rng(0)) == UPRIGHT


@pytest.mark.parametrize(("world", "gap_m", "wall_m"), [("close_five", 0.010, 0.005), ("lying_five", 0.010, 0.010)])
def test_the_gaps_of_the_worlds(world: str, gap_m: float, wall_m: float) -> None:
    given = load_world(world)
    meshes = load_folder(given.objects.folder)
    half = 0.5 * np.array(given.container.interior_m[:2])
    nearest, sides = [], set()
    for seed in range(25):
        places = draw_layout(meshes, given, seed)
        sides |= {p.quat != UPRIGHT for p in places}
        shapes = [
            transformed(outline(turned(m, p.quat)), replace(p, quat=UPRIGHT))
            for m, p in zip(meshes, places, strict=True)
        ]
        assert all((np.abs(s) <= half - wall_m + 1e-9).all() for s in shapes)
        nearest.append(min(gap(a, b) for a, b in combinations(shapes, 2)))
    assert gap_m - 1e-9 <= min(nearest) < 0.025
    assert sides == ({False} if world == "close_five" else {False, True})


def test_the_share_of_lying_objects() -> None:
    mesh, rng = solid(trimesh.creation.box((0.02, 0.04, 0.06))), np.random.default_rng(0)
    lying = np.mean([draw_stance(mesh, rng, 0.3) != UPRIGHT for _ in range(1500)])
    assert lying == pytest.approx(0.3, abs=0.04)
