"""The gel against closed forms of a Winkler foundation, and the layout of both maps."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh
from scipy.optimize import brentq

from glotouch_backends.mujoco.sensing.gel import BOTTOM_M, GelSensor, pad_pose_P
from glotouch_backends.mujoco.sensing.rays import SurfaceRays
from glotouch_bt.errors import ParamError
from glotouch_bt.robot.geometry import Array, Pose
from glotouch_bt.robot.scene.meshes import Mesh

K = 0.2e9  # N/m3
WINDOW = (0.0172, 0.0285)
SHAPE = (70, 40)
GEL = GelSensor(WINDOW, SHAPE, 0.0015)
TAXEL = WINDOW[0] * WINDOW[1] / (SHAPE[0] * SHAPE[1])
X, Z = GEL.taxels_P[..., 0], GEL.taxels_P[..., 2]
HERE = Pose(np.zeros(3))


def rays_of(shape: trimesh.Trimesh) -> SurfaceRays:
    return SurfaceRays(Mesh("shape", np.asarray(shape.vertices), np.asarray(shape.faces), digest=""))


def carried_N(depth: Array) -> float:
    """Force of the stiffening gel over an unclipped map."""
    return float((K * depth / (1 - (depth / BOTTOM_M) ** 2)).sum() * TAXEL)


@pytest.mark.parametrize("force", [0.1, 1.0, 10.0, 30.0])
@pytest.mark.parametrize("sunk_m", [0.0, 2e-4, -5e-4])
def test_flat_face(force: float, sunk_m: float) -> None:
    """Every taxel carries F / A: x / (1 - (x/X)^2) = F / (k A), whatever the simulated pose; the shift makes it up."""
    box = rays_of(trimesh.creation.box((0.1, 0.04, 0.1)))
    pressed = GEL.press_pair([(box, HERE)], (0.02 - sunk_m, 0.02 - sunk_m), (force, force))
    mean = force / (K * WINDOW[0] * WINDOW[1])
    x = brentq(lambda x: x / (1 - (x / BOTTOM_M) ** 2) - mean, 0.0, BOTTOM_M * (1 - 1e-12))
    for depth, shift in ((pressed.left_m, pressed.left_shift_m), (pressed.right_m, pressed.right_shift_m)):
        assert depth == pytest.approx(x, abs=2e-7)
        assert shift == pytest.approx(x - sunk_m, abs=2e-7)
    gap = 2 * (0.02 - sunk_m) - pressed.left_shift_m - pressed.right_shift_m
    assert gap == pytest.approx(0.04 - 2 * x, abs=4e-7)


def sphere_force_N(deepest: float, radius: float) -> float:
    """Integral of k x / (1 - (x/X)^2) over the disc, with x = d - r^2 / (2 R): pi R k X^2 ln(1 / (1 - (d/X)^2))."""
    return -math.pi * radius * K * BOTTOM_M**2 * math.log(1 - (deepest / BOTTOM_M) ** 2)


@pytest.mark.parametrize("deepest", [5e-4, 1.0e-3, 1.3e-3])
def test_sphere_leaves_a_paraboloid(deepest: float) -> None:
    """The cap is the ball's own, to its tessellation; the shift is the paraboloid's, to the next term r^4 / (8 R^3)."""
    radius = 0.02
    ball = rays_of(trimesh.creation.icosphere(subdivisions=6, radius=radius))
    depth, shift = GEL.press("left", [(ball, pad_pose_P("left", radius))], sphere_force_N(deepest, radius))
    cap = np.maximum(0.0, shift - radius + np.sqrt(radius**2 - X**2 - Z**2))
    assert depth == pytest.approx(cap, abs=5e-6)
    rim = 2 * radius * deepest
    assert shift == pytest.approx(deepest, abs=5e-6 + rim**2 / (8 * radius**3))


@pytest.mark.parametrize("force", [0.5, 2.0, 10.0])
def test_the_map_carries_the_commanded_force(force: float) -> None:
    ball = rays_of(trimesh.creation.icosphere(subdivisions=4, radius=0.035))
    depth, _ = GEL.press("right", [(ball, pad_pose_P("right", 0.0345))], force)
    assert depth.max() < GEL.depth_m  # nothing clipped, so that the map holds the whole force
    assert carried_N(depth) == pytest.approx(force, rel=1e-6)


def test_cylinder_leaves_a_trough() -> None:
    """Upright round: linear force per length k (2/3) w d, w = 2 sqrt(2 R d) wide; a light load, so no stiffening."""
    radius, deepest = 0.03, 1.5e-4
    rod = rays_of(trimesh.creation.cylinder(radius, 0.1, sections=720))
    force = K * WINDOW[1] * deepest * (2 / 3) * 2 * math.sqrt(2 * radius * deepest)
    depth, _ = GEL.press("left", [(rod, pad_pose_P("left", radius))], force)
    assert np.ptp(depth, axis=0).max() < 1e-7  # the same in every row
    assert depth[0] == pytest.approx(np.maximum(0.0, deepest - X[0] ** 2 / (2 * radius)), abs=4e-6)


def edge_rays(length_m: float) -> tuple[SurfaceRays, float]:
    """An upright square bar turned by 45 degrees, and the distance of its edge from the axis."""
    bar = trimesh.creation.box((0.02, 0.02, length_m))
    bar.apply_transform(trimesh.transformations.rotation_matrix(math.pi / 4, (0, 0, 1)))
    return rays_of(bar), 0.01 * math.sqrt(2)


@pytest.mark.parametrize("force", [1.0, 8.0, 25.0])
def test_edge_leaves_a_wedge(force: float) -> None:
    """x = d - |x_P|, so that F = L k X^2 ln(1 / (1 - (d/X)^2)) over the window's length L; fine columns."""
    fine = GelSensor(WINDOW, (10, 1001), 0.0015)
    bar, tip = edge_rays(0.1)
    depth, shift = fine.press("left", [(bar, pad_pose_P("left", tip))], force)
    deepest = BOTTOM_M * math.sqrt(1 - math.exp(-force / (WINDOW[1] * K * BOTTOM_M**2)))
    assert shift == pytest.approx(deepest, abs=2e-6)
    assert depth == pytest.approx(np.maximum(0.0, shift - np.abs(fine.taxels_P[..., 0])), abs=2e-7)


def test_short_edge_reaches_the_backing_and_is_clipped() -> None:
    """25 N on 4 mm of edge press it to the backing; the map is clipped at its largest indentation."""
    bar, tip = edge_rays(0.004)
    depth, shift = GEL.press("left", [(bar, pad_pose_P("left", tip))], 25.0)
    assert depth.max() == GEL.depth_m
    assert shift < BOTTOM_M + abs(X).min()
    flank = (depth > 0) & (depth < GEL.depth_m)
    assert depth[flank] == pytest.approx((shift - np.abs(X))[flank], abs=2e-7)


def test_no_contact_gives_an_empty_map() -> None:
    box = rays_of(trimesh.creation.box((0.1, 0.04, 0.1)))
    touching = [(box, pad_pose_P("left", 0.02))]
    for surfaces, force in (
        (touching, 0.0),
        (touching, -1.0),
        (touching, math.nan),
        ([], 5.0),
        ([(box, pad_pose_P("left", 0.02 + 1.01 * GEL.reach_m))], 5.0),
        ([(box, Pose([0.0, 0.02, 0.5]) @ pad_pose_P("left", 0.0))], 5.0),
    ):
        depth, shift = GEL.press("left", surfaces, force)
        assert not depth.any()
        assert shift == 0.0


def test_two_objects_at_once_are_both_sensed() -> None:
    """Two boxes, each before one half of the window; the one at +x_P stands 0.3 mm further off."""
    box = rays_of(trimesh.creation.box((0.05, 0.04, 0.1)))
    pad_P = pad_pose_P("left", 0.02)
    at_minus_x, at_plus_x = Pose([-0.025, 0.0, 0.0]), Pose([0.025, -3e-4, 0.0])  # pose_P_O
    surfaces = [(box, at_minus_x.inverse() @ pad_P), (box, at_plus_x.inverse() @ pad_P)]
    depth, _ = GEL.press("left", surfaces, 20.0)
    assert np.ptp(depth[:, 20:]) < 2e-7
    assert depth[:, :20].mean() - depth[:, 20:].mean() == pytest.approx(3e-4, abs=4e-7)


@pytest.mark.parametrize("yaw", [0.0, 1.1])
@pytest.mark.parametrize("side", ["left", "right"])
def test_both_maps_share_one_layout(side: str, yaw: float) -> None:
    """A plate with a peg through it at +x, LOW (towards the fingertip): high column, high row, in BOTH maps."""
    plate = trimesh.creation.box((0.06, 0.03, 0.06))
    peg = trimesh.creation.box((0.003, 0.032, 0.004))
    peg.apply_translation((0.005, 0.0, -0.009))
    pose_B_O = Pose.planar((0.5, 0.1, 0.05), yaw)
    pose_B_P = pose_B_O @ Pose.pointing_down((0.0, 0.0, 0.0), 0.0)  # x_P = x_O, z_P = -z_O
    pose_O_P = pose_B_O.inverse() @ pose_B_P
    surfaces = [(rays_of(plate), pose_O_P), (rays_of(peg), pose_O_P)]
    pressed = GEL.press_pair(surfaces, (0.016, 0.016), (4.0, 4.0))
    depth = pressed.left_m if side == "left" else pressed.right_m
    deep = depth > 0.5 * depth.max()
    assert deep.any()
    assert np.all(np.abs(X[deep] - 0.005) <= 0.0015 + WINDOW[0] / SHAPE[1])
    assert np.all(np.abs(Z[deep] - 0.009) <= 0.002 + WINDOW[1] / SHAPE[0])
    assert deep.sum() * TAXEL == pytest.approx(0.003 * 0.004, rel=0.3)


def test_pads_face_each_other_and_taxels_are_cell_centres() -> None:
    left, right = pad_pose_P("left", 0.01), pad_pose_P("right", 0.02)
    assert left.apply([0.0, 0.0, 0.01]) == pytest.approx(np.zeros(3), abs=1e-12)
    assert right.apply([0.0, 0.0, 0.02]) == pytest.approx(np.zeros(3), abs=1e-12)
    for pose in (left, right):
        assert np.linalg.det(pose.rotation) == pytest.approx(1.0)
        assert pose.rotation[:, 1] == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)
    assert X[0, 0] == pytest.approx(-0.5 * WINDOW[0] + 0.5 * WINDOW[0] / SHAPE[1])
    assert Z[-1, 0] == pytest.approx(0.5 * WINDOW[1] - 0.5 * WINDOW[1] / SHAPE[0])
    assert (np.diff(X, axis=1) > 0).all()
    assert (np.diff(Z, axis=0) > 0).all()


@pytest.mark.parametrize("seed", range(20))
def test_shift_meets_the_force_for_any_overlap(seed: int) -> None:
    """Against a bracketing root finder that shares nothing with the closed-form start."""
    rng = np.random.default_rng(seed)
    overlap = rng.normal(0.0, 10 ** rng.uniform(-5, -2.5), SHAPE)
    overlap[rng.random(SHAPE) < 0.3] = -np.inf
    force = 10 ** rng.uniform(-2, 1.5)

    def excess(s: float) -> float:
        return carried_N(np.maximum(0.0, overlap + s)) - force

    top = float(overlap.max())
    expected = brentq(excess, -top, BOTTOM_M * (1 - 1e-13) - top, xtol=1e-15)
    assert GEL.shift(overlap, force) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    "arguments",
    [((0.0, 0.02), (35, 20), 0.0015), ((0.02, 0.02), (0, 20), 0.0015), ((0.02, 0.02), (35, 20), 0.0016)],
)
def test_impossible_gels_are_refused(arguments: tuple[tuple[float, float], tuple[int, int], float]) -> None:
    with pytest.raises(ParamError, match="gel"):
        GelSensor(*arguments)
