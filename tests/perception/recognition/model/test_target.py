"""Support widths against closed forms, and what must not change them."""

import numpy as np
import pytest

from glotouch_bt.perception.recognition import PadSpec, TargetModel
from glotouch_bt.robot import ParamError

HALF_X, HALF_Z = 0.0086, 0.01425
YAWS = np.deg2rad([0.0, 5.0, 30.0, 45.0, 90.0, 135.0, 200.0, 355.0])


def test_cylinder_width_is_its_diameter_where_the_window_sees_its_middle(solids) -> None:
    model = TargetModel.from_mesh(solids.cylinder(0.025, 0.070))
    for phi in YAWS:
        for l in (-0.007, 0.0, 0.004):
            assert model.width_at(l, 0.035, phi) == pytest.approx(0.050, abs=2e-4), (phi, l)


def test_cylinder_width_beside_the_middle(solids) -> None:
    model = TargetModel.from_mesh(solids.cylinder(0.025, 0.070))
    l = float(model.l_m[np.argmin(np.abs(model.l_m - 0.020))])
    expected = 2 * np.sqrt(0.025**2 - (l - HALF_X) ** 2)
    assert model.width_at(l, 0.035, 0.7) == pytest.approx(expected, abs=8e-4)  # one raster cell on a slope of 0.5


def test_sphere_width_falls_off_above_its_equator(solids) -> None:
    model = TargetModel.from_mesh(solids.sphere(0.030))
    for z in model.z_m[(model.z_m > 0.048) & (model.z_m < 0.056)]:
        gap = z - HALF_Z - 0.030
        assert model.width_at(0.0, float(z), 1.0) == pytest.approx(2 * np.sqrt(0.030**2 - gap**2), abs=8e-4)
    assert model.width_at(0.0, 0.030, 2.0) == pytest.approx(0.060, abs=2e-4)


@pytest.mark.parametrize("phi", YAWS)
def test_box_width_at_any_yaw(solids, phi: float) -> None:
    """The support of a rectangle cut by the window |x_P| <= half: polygon clipping, done by hand."""
    a, b = 0.030, 0.020
    model = TargetModel.from_mesh(solids.box(2 * a, 2 * b, 0.060))
    x, y = np.array([np.cos(phi), np.sin(phi)]), np.array([np.sin(phi), -np.cos(phi)])
    corners = np.array([[a, b], [-a, b], [-a, -b], [a, -b]])
    points = [c for c in corners if abs(x @ c) <= HALF_X]
    for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        for edge in (-HALF_X, HALF_X):
            d = x @ (q - p)
            if abs(d) > 1e-12 and 0 <= (t := (edge - x @ p) / d) <= 1:
                points.append(p + t * (q - p))
    c = np.array(points) @ y
    slope = max(abs(np.tan(phi % (np.pi / 2))), 1.0) if np.sin(2 * phi) ** 2 > 1e-9 else 0.0
    assert model.width_at(0.0, 0.030, phi) == pytest.approx(np.ptp(c), abs=3e-4 + 6e-4 * min(slope, 2.0))


def test_window_beside_the_object_is_empty(solids) -> None:
    model = TargetModel.from_mesh(solids.box(0.040, 0.040, 0.060))
    assert np.isnan(model.width_m[0, 0]).all()
    assert np.isnan(model.width_at(0.5, 0.030, 0.0))


def test_tessellation_does_not_matter(solids) -> None:
    mesh = solids.box(0.060, 0.040, 0.050)
    a, b = TargetModel.from_mesh(mesh), TargetModel.from_mesh(solids.refined(mesh))
    assert a.digest != b.digest
    np.testing.assert_allclose(a.width_m, b.width_m, atol=1e-5)
    np.testing.assert_allclose(a.images, b.images, atol=2e-2)
    assert a.rho == pytest.approx(b.rho, abs=1e-3)


@pytest.mark.parametrize("turn", [25.0, 90.0, 180.0])
def test_target_pose_in_its_file_does_not_matter(solids, turn: float) -> None:
    mesh = solids.box(0.060, 0.040, 0.050)
    angle = np.deg2rad(turn)
    a = TargetModel.from_mesh(mesh)
    b = TargetModel.from_mesh(solids.moved(mesh, angle, 0.012, -0.007))
    np.testing.assert_allclose(b.centre_m, [0.012, -0.007], atol=2e-5)
    for phi in YAWS:
        assert b.width_at(0.0, 0.025, phi + angle) == pytest.approx(a.width_at(0.0, 0.025, phi), abs=3e-4)
    assert b.anisotropy == pytest.approx(a.anisotropy, abs=1e-6)


def test_flat_touches_are_planar_and_round_ones_are_not(solids) -> None:
    flat, ball = (TargetModel.from_mesh(m).rho for m in (solids.box(0.080, 0.060, 0.060), solids.sphere(0.030)))
    assert flat < 0.05
    assert ball > flat + 0.05


def test_outline_kind_and_size(solids) -> None:
    block = TargetModel.from_mesh(solids.box(0.080, 0.040, 0.060)).outline
    assert block.p_box > 0.8
    np.testing.assert_allclose(block.as_box.size_m, [0.080, 0.040], atol=1e-3)
    tube = TargetModel.from_mesh(solids.cylinder(0.025, 0.070)).outline
    assert tube.p_box < 0.2
    assert tube.as_round.size_m[0] == pytest.approx(0.050, abs=5e-4)


def test_cache_is_by_content(solids) -> None:
    a = TargetModel.from_mesh(solids.box(0.060, 0.040, 0.050))
    assert TargetModel.from_mesh(solids.box(0.060, 0.040, 0.050)) is a
    assert TargetModel.from_mesh(solids.box(0.060, 0.040, 0.050), PadSpec(force_N=20.0)) is not a


def test_too_low_to_trace_is_said(solids) -> None:
    with pytest.raises(ParamError, match="12 mm"):
        TargetModel.from_mesh(solids.box(0.060, 0.040, 0.010))
