"""Lengths, ends and tangents (by finite differences) of paths."""

from __future__ import annotations

import numpy as np
import pytest

from glotouch_bt.motion import Arc, Line, Polyline
from glotouch_bt.motion.paths import Piece, quats_to_matrices
from glotouch_bt.robot import ParamError, Pose

DOWN = Pose.pointing_down((0.5, 0.1, 0.0), 0.3)
PIECES = [
    Line(DOWN, Pose.pointing_down((0.6, 0.1, 0.02), 1.2)),
    Line(DOWN, Pose(DOWN.position_m + np.array([0.0, 0.0, 0.1]), DOWN.quat)),
    Line(DOWN, Pose.pointing_down(DOWN.position_m, 0.9)),
    Arc(DOWN, (0.55, 0.1, 0.3), (0.0, 0.0, 2.0), -4.0),
    Arc(DOWN, (0.55, 0.1, 0.3), (0.0, 0.0, 1.0), 2.0, turn=True),
]


@pytest.mark.parametrize("piece", PIECES)
def test_twist_is_the_derivative_of_the_pose(piece: Piece) -> None:
    s = np.linspace(0.1, 0.9, 7) * piece.length_m
    h = 1e-6
    (p1, q1), (p0, q0) = piece.sample(s + h), piece.sample(s - h)
    twist = piece.twist(s)
    np.testing.assert_allclose(twist[:, :3], (p1 - p0) / (2 * h), atol=1e-8)
    spin = (quats_to_matrices(q1) - quats_to_matrices(q0)) / (2 * h) @ quats_to_matrices(piece.sample(s)[1]).mT
    np.testing.assert_allclose(twist[:, 3:], np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], 1), atol=1e-7)


def test_line_is_straight_and_ends_at_its_poses() -> None:
    line = PIECES[0]
    assert isinstance(line, Line)
    np.testing.assert_allclose(line.pose(0.0).position_m, line.start.position_m)
    np.testing.assert_allclose(line.pose(line.length_m).rotation, line.end.rotation, atol=1e-12)
    positions = line.sample(np.linspace(0, line.length_m, 20))[0]
    way = line.end.position_m - line.start.position_m
    off = np.cross(positions - line.start.position_m, way / np.linalg.norm(way))
    assert np.abs(off).max() < 1e-15


def test_arc_keeps_its_radius_and_rotates_the_hand_only_on_request() -> None:
    still, turning = PIECES[3], PIECES[4]
    for arc, change in ((still, 0.0), (turning, 2.0)):
        p, q = arc.sample(np.linspace(0, arc.length_m, 30))
        np.testing.assert_allclose(np.hypot(p[:, 0] - 0.55, p[:, 1] - 0.1), 0.05, atol=1e-12)
        np.testing.assert_allclose(p[:, 2], 0.0, atol=1e-12)
        # A right-handed turn about +z_B is a right-handed change of yaw.
        yaw = Pose(p[-1], q[-1]).yaw_rad - DOWN.yaw_rad
        assert np.angle(np.exp(1j * (yaw - change))) == pytest.approx(0.0, abs=1e-9)
    assert still.length_m == pytest.approx(4.0 * 0.05)
    assert turning.length_m == pytest.approx(2.0 * 0.1)  # the turn at its lever is the longer
    assert still.curvature_1_m == pytest.approx(20.0)


def test_polyline_sums_lengths_and_skips_empty_lines() -> None:
    a, b, c = (Pose(np.array(p)) for p in ((0.0, 0, 0), (0.1, 0, 0), (0.1, 0.2, 0)))
    path = Polyline((a, a, b, c))
    assert len(path.pieces) == 2
    assert path.length_m == pytest.approx(0.3)
    np.testing.assert_allclose(path.pose(0.2).position_m, [0.1, 0.1, 0.0])
    np.testing.assert_allclose(path.pose(9.0).position_m, c.position_m)


def test_invalid_paths_are_refused() -> None:
    with pytest.raises(ParamError):
        Polyline((DOWN,))
    with pytest.raises(ParamError):
        Arc(DOWN, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0)
    with pytest.raises(ParamError):
        Arc(DOWN, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), np.nan)
