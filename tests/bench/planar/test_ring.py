"""A second ring driven round solids whose sections are known at both heights."""

from __future__ import annotations

import numpy as np
import trimesh

from glotouch_bt.bench.planar import ContactModel, PlanarWorld, felt_section
from glotouch_bt.bench.planar.drive import drive
from glotouch_bt.perception.search import Move, trace
from glotouch_bt.perception.search.ring import outline_of, trace_ring, with_second_ring
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.robot.scene.meshes import Mesh
from glotouch_skills.explore.second_ring import SecondRingParams
from tests.bench.planar.conftest import HALF, IDEAL, TIP, as_mesh, cylinder, mushroom

PLACE, INNER, LOW_M = np.array([0.02, -0.03]), np.array([0.138, 0.188]), 0.018


def step(lower_m: float, upper_m: float, aside_m: float) -> Mesh:
    """A disc up to 30 mm, and on it another one up to 70 mm, so far to the side."""
    low = trimesh.creation.cylinder(lower_m, 0.03, sections=256)
    high = trimesh.creation.cylinder(upper_m, 0.04, sections=256)
    low.apply_translation((0.0, 0.0, 0.015))
    high.apply_translation((aside_m, 0.0, 0.05))
    return as_mesh(trimesh.util.concatenate([low, high]), "step")


def world_at(
    mesh: Mesh, height_m: float, start: tuple[float, float], lowered: bool, model: ContactModel = IDEAL
) -> PlanarWorld:
    section, place = felt_section(mesh, height_m=height_m), np.array([[*PLACE, 0.0]])
    world = PlanarWorld([section], place, HALF, TIP, np.random.default_rng(0), model, np.array(start))
    world.lowered = lowered
    return world


def first_ring(mesh: Mesh) -> tuple[Candidate, PlanarWorld]:
    world = world_at(mesh, LOW_M, (-0.08, -0.03), lowered=True)
    felt = world.execute(Move("sweep", PLACE))
    assert felt.contact is not None
    traced = drive(trace(felt.contact, world.tip_K_m, TIP, half_extent_m=INNER), world)
    assert traced.outline is not None
    return Candidate(0, traced.outline.contour, 0.07, 0.9, traced.contacts), world


def test_both_sections_of_a_step_are_found_and_its_centre_lies_between() -> None:
    mesh = step(0.03, 0.015, 0.006)
    candidate, below = first_ring(mesh)
    above = world_at(mesh, 0.05, tuple(candidate.contour.centre_K_m), lowered=False)
    above.poses[:] = below.poses
    traced = drive(trace_ring(candidate, above.tip_K_m, TIP, SecondRingParams().rule(), half_extent_m=INNER), above)
    assert traced is not None
    after = with_second_ring(candidate, traced, 0.05, LOW_M)
    assert after is not None
    (ring,) = after.rings
    assert ring.contour.family == "circle"
    np.testing.assert_allclose(ring.contour.size_m, 0.03, atol=8e-4)
    np.testing.assert_allclose(ring.contour.centre_K_m, above.poses[0, :2] + (0.006, 0.0), atol=5e-4)
    np.testing.assert_allclose(candidate.contour.size_m, 0.06, atol=8e-4)
    # the lower section is sure of its own centre, so the upper one hardly moves it; pushed along, it is where it stands
    np.testing.assert_allclose(after.contour.centre_K_m, above.poses[0, :2], atol=6e-4)


def test_pushing_it_up_there_moves_what_was_felt_below() -> None:
    candidate, below = first_ring(cylinder(0.03))
    start = tuple(candidate.contour.centre_K_m)
    above = world_at(cylinder(0.03), 0.036, start, lowered=False, model=ContactModel())
    above.poses[:] = below.poses
    traced = drive(trace_ring(candidate, above.tip_K_m, TIP, SecondRingParams().rule(), half_extent_m=INNER), above)
    assert traced is not None
    after = with_second_ring(candidate, traced, 0.036, LOW_M)
    assert after is not None
    centre = outline_of(after.contacts, TIP).contour.centre_K_m
    np.testing.assert_allclose(centre, above.poses[0, :2], atol=5e-4)
    assert np.linalg.norm(above.poses[0, :2] - below.poses[0, :2]) > 2e-4, "it was pushed"


def test_under_a_cap_the_shaft_feels_the_cap_at_both_heights() -> None:
    """A mushroom's cap overhangs its stem: what the ball cannot reach below, the shaft feels from above."""
    mesh = mushroom(0.012, 0.03)
    low, high = felt_section(mesh), felt_section(mesh, height_m=0.03)
    assert low.box_size_m[0] == high.box_size_m[0]
    candidate, below = first_ring(mesh)
    above = world_at(mesh, 0.03, tuple(candidate.contour.centre_K_m), lowered=False)
    above.poses[:] = below.poses
    traced = drive(trace_ring(candidate, above.tip_K_m, TIP, SecondRingParams().rule(), half_extent_m=INNER), above)
    assert traced is not None
    assert traced.contour is not None
    np.testing.assert_allclose(traced.contour.size_m, candidate.contour.size_m, atol=1e-3)


def test_nothing_up_there_is_no_ring() -> None:
    candidate, _ = first_ring(cylinder(0.03))
    gone = world_at(cylinder(0.03), 0.036, tuple(candidate.contour.centre_K_m), lowered=False)
    gone.poses[:] = (-0.1, 0.15, 0.0)
    assert drive(trace_ring(candidate, gone.tip_K_m, TIP, SecondRingParams().rule(), half_extent_m=INNER), gone) is None
