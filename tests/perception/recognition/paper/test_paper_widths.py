"""Finite-window support widths against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from glotouch_bt.perception.recognition import PadSpec, TargetModel
from glotouch_bt.perception.recognition.paper import PaperParams
from glotouch_bt.perception.recognition.paper.widths import Hypotheses, predicted_widths, width_tables

HALF_L, HALF_Z = (0.5 * x for x in PadSpec().window_m)
ONE = (1.0,)
CELL_M = 1.4e-3


def at(model: TargetModel, along: float, height: float, scales: tuple[float, ...] = ONE) -> np.ndarray:
    """(scales, yaws) width at one place."""
    p = PaperParams(scales=scales, shift_m=0.0, shift_steps=1, z0_m=0.0, z0_steps=1)
    grid = Hypotheses.of(model, p)
    w = predicted_widths(width_tables(model, scales), along, np.array([height]), grid)
    return np.asarray(w.reshape(grid.shape)[:, :, 0, 0], dtype=np.float64)


@pytest.fixture(scope="module")
def block(solids):
    return TargetModel.from_mesh(solids.box(0.080, 0.040, 0.070))


@pytest.fixture(scope="module")
def ball(solids):
    return TargetModel.from_mesh(solids.sphere(0.032))


def test_box_at_any_yaw(block) -> None:
    """Reach of a rectangle inside a strip, from its own outline sampled densely; raster cells allowed for."""
    a, b = 0.040, 0.020
    t = np.linspace(-1, 1, 4001)
    edges = [(a * t, b + 0 * t), (a * t, -b + 0 * t), (a + 0 * t, b * t), (-a + 0 * t, b * t)]
    x, y = (np.concatenate(c) for c in zip(*edges, strict=True))
    middle = len(block.l_m) // 2
    for along in block.l_m[[middle, middle + 6, middle - 13]]:
        got = at(block, float(along), 0.035)[0]
        for i in range(0, 72, 5):
            phi = block.phi_rad[i]
            l, c = x * np.cos(phi) + y * np.sin(phi), x * np.sin(phi) - y * np.cos(phi)
            # A cell of the raster stands for its middle, so the window's edge is known to half a cell;
            # and a corner that falls between two cells loses up to 0.5 mm (slopes 0.58 and 1.73) on each side.
            inner, outer = (c[np.abs(l - along) <= HALF_L + e] for e in (-0.6e-3, 0.6e-3))
            low = np.ptp(inner) if len(inner) else 0.0
            assert low - 1.1e-3 <= got[i] <= np.ptp(outer) + 2e-4, (along, np.degrees(phi))


def test_box_square_on(block) -> None:
    got = at(block, 0.0, 0.035)[0]
    assert got[0] == pytest.approx(0.040, abs=1e-5)
    assert got[18] == pytest.approx(0.080, abs=1e-5)


def test_ball(ball) -> None:
    """The nearest point of the window to the equator decides: 2 sqrt(R^2 - dl^2 - dz^2)."""
    for along in (0.0, 0.012, 0.025):
        for height in (0.032, 0.050):
            dl, dz = max(along - HALF_L, 0), max(height - 0.032 - HALF_Z, 0)
            expected = 2 * np.sqrt(0.032**2 - dl**2 - dz**2)
            np.testing.assert_allclose(at(ball, along, height)[0], expected, atol=1.2e-3)


def test_nothing_beyond_the_solid(ball) -> None:
    assert np.isnan(at(ball, 0.060, 0.032)).all()
    assert np.isnan(at(ball, 0.0, 0.150)).all()


def test_scan_reflection_is_half_a_turn(block, ball) -> None:
    """W(-l; phi) = W(l; phi + 180 deg): the full turn of yaw holds the reflected scans."""
    for model in (block, ball):
        np.testing.assert_allclose(at(model, -0.02, 0.03)[0], np.roll(at(model, 0.02, 0.03)[0], -36), atol=1e-6)


def test_scaled_table_is_the_table_of_the_scaled_solid(solids, block) -> None:
    for s in (0.9, 1.1):
        other = TargetModel.from_mesh(solids.box(0.080 * s, 0.040 * s, 0.070 * s))
        for along in (0.0, 0.02):
            a, b = at(block, along, 0.035, (s,))[0], at(other, along, 0.035)[0]
            both = np.isfinite(a) & np.isfinite(b)
            assert both.mean() > 0.9
            # Slopes reach 1 away from square-on; the window's sides differ by at most a cell each.
            assert np.abs(a - b)[both].max() < 2.5 * CELL_M
            assert np.abs(a - b)[both].mean() < 0.6e-3


def test_a_layer_above_the_top_has_no_support(block) -> None:
    assert np.isfinite(at(block, 0.0, 0.070)).all()
    assert np.isnan(at(block, 0.0, 0.070 + HALF_Z + 2 * CELL_M)).all()
