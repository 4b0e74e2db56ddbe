"""Distances of the probe from contact with a solid, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh

from glotouch_bt.perception.recognition.model import LEVELS_M, SENSING_M, SectionTables, TargetSection, section_of
from glotouch_bt.robot import Array
from tests.perception.recognition.conftest import as_mesh, box, cylinder

BALL_M, SHAFT_M = 0.006, 0.004
NEAR_M = 1.5e-4


def distances(mesh, places: list[tuple[float, float]], level: int = 0) -> Array:
    return look_up(section_of(mesh, np.zeros(2)), places, level)[0]


def look_up(section: TargetSection | None, places: list[tuple[float, float]], level: int = 0) -> Array:
    """Distances and gradients (3, n); another section before it must not matter."""
    assert section is not None
    tables = SectionTables.of([section_of(cylinder(0.02, 0.06), np.zeros(2)), section])
    x, y = np.array(places).T
    return np.array(tables.look_up(x[None], y[None], tables.table_at(np.array([1]), np.array([level]))))[:, 0]


def test_a_cylinder_is_felt_at_its_radius_and_that_of_the_ball() -> None:
    off = np.array([-0.002, 0.0, 0.002, 0.005])
    at = [
        ((0.03 + BALL_M + d) * math.cos(a), (0.03 + BALL_M + d) * math.sin(a))
        for d, a in zip(off, range(4), strict=False)
    ]
    np.testing.assert_allclose(distances(cylinder(0.03, 0.08), at), off, atol=NEAR_M)


def test_the_gradient_is_the_outward_normal() -> None:
    section = section_of(box(0.06, 0.04, 0.05), np.zeros(2))
    slope = look_up(section, [(0.03 + BALL_M, 0.0), (0.0, -0.02 - BALL_M)])[1:]
    np.testing.assert_allclose(slope.T, [[1.0, 0.0], [0.0, -1.0]], atol=0.05)


def test_the_shaft_meets_an_overhang_above_the_ball() -> None:
    stem = trimesh.creation.cylinder(0.01, 0.05, sections=64)
    stem.apply_translation([0, 0, 0.025])
    roof = trimesh.creation.cylinder(0.03, 0.01, sections=64)
    roof.apply_translation([0, 0, 0.055])
    mushroom = as_mesh(trimesh.util.concatenate([stem, roof]))
    np.testing.assert_allclose(distances(mushroom, [(0.03 + SHAFT_M, 0.0)]), [0.0], atol=2 * NEAR_M)


@pytest.mark.parametrize("level", range(len(LEVELS_M)))
def test_the_ball_meets_the_edge_of_a_low_disc_with_its_lower_half(level: int) -> None:
    """An edge below the ball's centre touches where the ball is narrower."""
    top = 0.016
    reach = math.sqrt(BALL_M**2 - max(LEVELS_M[level] - top, 0.0) ** 2)
    np.testing.assert_allclose(distances(cylinder(0.03, top), [(0.03 + reach, 0.0)], level), [0.0], atol=2 * NEAR_M)


def test_a_solid_below_the_ball_is_not_felt() -> None:
    assert section_of(box(0.05, 0.05, SENSING_M - BALL_M - 0.004), np.zeros(2)) is None
