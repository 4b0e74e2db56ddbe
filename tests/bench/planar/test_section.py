"""Felt sections against closed forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from glotouch_bt.bench.planar import felt_section
from glotouch_bt.perception.touch import area_and_centroid, minimum_rectangle
from glotouch_bt.robot.scene import load_folder
from tests.bench.planar.conftest import TIP, box, cylinder, mushroom

EXACT_M = 0.00005
OBJECTS = Path(__file__).parents[3] / "glotouch_missions" / "objects"


def polar(radius: float, n: int = 90) -> np.ndarray:
    a = np.linspace(0, 2 * np.pi, n, endpoint=False)
    return radius * np.column_stack([np.cos(a), np.sin(a)])


@pytest.mark.parametrize("off", [-0.008, -0.002, 0.0, 0.003, 0.009])
def test_cylinder(off: float) -> None:
    """Distance from a disc of radius R + r, inside and outside."""
    section = felt_section(cylinder(0.025))
    assert section.side(polar(0.025 + TIP + off)) == pytest.approx(np.full(90, off), abs=EXACT_M)
    assert section.centre_m == pytest.approx([0, 0], abs=EXACT_M)
    assert section.top_m == pytest.approx(0.06)


def test_box_with_rounded_corners() -> None:
    """The forbidden set is the rectangle grown by the ball: its corners are quarter circles."""
    section = felt_section(box(0.06, 0.03))
    points = np.random.default_rng(0).uniform(-0.045, 0.045, (500, 2))
    points = points[np.abs(points[:, 1]) < 0.03]
    over = np.abs(points) - (0.03, 0.015)
    exact = np.hypot(*np.maximum(over, 0).T) + np.minimum(over.max(axis=1), 0) - TIP
    near = np.abs(exact) < 0.006  # farther inside, the distance to the grown shape is another one
    assert section.side(points[near]) == pytest.approx(exact[near], abs=EXACT_M)
    assert section.box_size_m == pytest.approx((0.06, 0.03), abs=2 * EXACT_M)
    assert section.elongation == pytest.approx(2.0, rel=0.01)
    assert abs(np.sin(section.box_yaw_rad)) < 0.01


@settings(max_examples=12, deadline=None)
@given(height=st.floats(0.0135, 0.0175))
def test_a_low_object_is_felt_with_the_balls_lower_half(height: float) -> None:
    """The ball at 18 mm touches an edge at height z when its centre is sqrt(r^2 - (18 mm - z)^2) away."""
    reach = np.sqrt(TIP**2 - (0.018 - height) ** 2)
    section = felt_section(cylinder(0.02, height, f"low{height}"))
    assert section.side(polar(0.02 + reach)) == pytest.approx(np.zeros(90), abs=0.00015)


def test_an_overhang_is_felt_by_the_shaft() -> None:
    section = felt_section(mushroom(0.010, 0.030))
    assert section.side(polar(0.030 + 0.004)) == pytest.approx(np.zeros(90), abs=EXACT_M)
    slender = felt_section(mushroom(0.010, 0.011))
    assert slender.side(polar(0.010 + TIP)) == pytest.approx(np.zeros(90), abs=EXACT_M)


def test_lowered_onto_an_overhang_the_ball_lands_farther_out_than_the_shaft_touches() -> None:
    section = felt_section(mushroom(0.010, 0.030))
    assert section.above(polar(0.030 + TIP)) == pytest.approx(np.zeros(90), abs=EXACT_M)
    assert section.landing_height_m(np.zeros(2)) == pytest.approx(0.05 + TIP, abs=EXACT_M)


def test_too_low_to_feel() -> None:
    with pytest.raises(ValueError, match="nothing of it reaches"):
        felt_section(cylinder(0.02, 0.011, "flat"))


def test_sections_are_kept() -> None:
    assert felt_section(cylinder(0.025)) is felt_section(cylinder(0.025))


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000))
def test_centroid_and_rectangle_of_random_hulls(seed: int) -> None:
    """Centroid against Monte Carlo moments of triangles; the rectangle holds the hull and turns with it."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(12, 2)) * (3.0, 1.0)
    hull = points[ConvexHull(points).vertices]
    first = hull[0]
    triangles = [(first, hull[i], hull[i + 1]) for i in range(1, len(hull) - 1)]
    areas = [0.5 * abs((b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0]) for a, b, c in triangles]
    exact = sum(w * (a + b + c) / 3 for w, (a, b, c) in zip(areas, triangles, strict=True)) / sum(areas)
    assert area_and_centroid(hull)[1] == pytest.approx(exact, abs=1e-9)
    _, size, _ = minimum_rectangle(hull)
    brute = min(
        np.prod(np.ptp(hull @ np.array([[np.cos(t), -np.sin(t)], [np.sin(t), np.cos(t)]]), axis=0))
        for t in np.linspace(0, np.pi / 2, 400)
    )
    assert size[0] * size[1] <= brute + 1e-9
    turned = hull @ np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])
    _, size_turned, yaw_turned = minimum_rectangle(turned)
    assert np.prod(size_turned) == pytest.approx(np.prod(size))
    c, s = np.cos(yaw_turned), np.sin(yaw_turned)  # two rectangles may be the least one: any may be given
    assert np.prod(np.ptp(turned @ np.array([[c, -s], [s, c]]), axis=0)) == pytest.approx(np.prod(size))


def test_the_shipped_objects_zero_level_touches_their_surface() -> None:
    """Exact point-triangle distances: the ball or the shaft is in touch; 0.2 mm off where the level has a crease."""
    for mesh in load_folder(OBJECTS, ("wukong", "truck")):
        section = felt_section(mesh)
        line = section.side.level(0.0)[0][::25]
        triangles = mesh.vertices_m[mesh.faces]
        ball = np.array([_to_triangles(np.array([*p, 0.018]), triangles) for p in line]) - TIP
        high = triangles[triangles[:, :, 2].min(axis=1) >= 0.018].copy()
        high[:, :, 2] = 0.0
        shaft = np.array([_to_triangles(np.array([*p, 0.0]), high) for p in line]) - 0.004
        # triangles that only reach above 18 mm are left out of the shaft's part: it may touch sooner, never later
        gap = np.minimum(ball, shaft)
        assert gap.min() > -0.0002
        assert np.percentile(-gap, 90) < 0.0001
        assert np.median(np.abs(gap)) < 0.00003


def _to_triangles(point: np.ndarray, triangles: np.ndarray) -> float:
    """Smallest distance of a point from triangles (n, 3, 3), by projection and clamping to edges (Ericson 5.1.5)."""
    a, b, c = triangles.transpose(1, 0, 2)
    best = np.inf
    for p, q in ((a, b), (b, c), (c, a)):
        d = q - p
        t = np.clip(((point - p) * d).sum(1) / np.maximum((d * d).sum(1), 1e-18), 0, 1)
        best = min(best, float(np.linalg.norm(point - p - t[:, None] * d, axis=1).min()))
    n = np.cross(b - a, c - a)
    length = np.linalg.norm(n, axis=1)
    good = length > 1e-12
    a, b, c, n = a[good], b[good], c[good], n[good] / length[good, None]
    height = ((point - a) * n).sum(1)
    foot = point - height[:, None] * n
    inside = np.all([(np.cross(q - p, foot - p) * n).sum(1) >= 0 for p, q in ((a, b), (b, c), (c, a))], axis=0)
    return min(best, float(np.abs(height[inside]).min(initial=np.inf)))
