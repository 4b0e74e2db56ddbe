"""Whole explorations in the plane."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from glotouch_bt.bench.planar import ContactModel, planar_world
from glotouch_bt.bench.planar.explore import Traced, _updated, explore, refine_all, travel_budget_m
from glotouch_bt.mission.load import load_mission
from glotouch_bt.perception.search import search_policy
from glotouch_bt.robot.scene import load_folder
from glotouch_bt.robot.scene.placement import draw_layout
from tests.bench.planar.conftest import WorldOf, centres_of, cylinder


@pytest.mark.parametrize("policy", ["nearest_frontier", "expected_find"])
def test_two_cylinders_are_found_where_they_are(world_of: WorldOf, policy: str) -> None:
    world = world_of(
        [cylinder(0.025), cylinder(0.03, name="other")], [(0.05, 0.06, 0), (-0.05, -0.07, 0)], ContactModel()
    )
    explored = explore(world, search_policy(policy), 2)
    assert explored.ended == "complete"
    found = np.array([t.candidate.contour.centre_K_m for t in explored.found])
    gap = np.linalg.norm(found[:, None] - centres_of(world)[None], axis=2)
    assert gap.min(axis=0).max() < 0.003
    assert explored.travel_m == world.travel_m
    refined = refine_all(world, explored)
    assert explored.travel_m < refined[-1].travel_m <= world.travel_m
    measured = np.array([t.candidate.contour.centre_K_m for t in refined])
    assert np.linalg.norm(measured[:, None] - centres_of(world)[None], axis=2).min(axis=0).max() < 0.002
    assert [t.travel_m for t in explored.found] == sorted(t.travel_m for t in explored.found)


def test_a_candidate_that_is_traced_again_keeps_its_earlier_traces(world_of: WorldOf) -> None:
    explored = explore(world_of([cylinder(0.025)], [(0.05, 0.06, 0)]), search_policy("nearest_frontier"), 1)
    states = [replace(explored.found[0].candidate, quality=q) for q in (0.1, 0.2, 0.3)]
    found: dict[int, Traced] = {}
    for travel_m, candidate in zip((1.0, 2.0, 3.0), states, strict=True):
        found = _updated(found, travel_m, (candidate,))
    (last,) = _updated(found, 4.0, (states[-1],)).values()
    assert [t.travel_m for t in (*last.earlier, last)] == [1.0, 2.0, 3.0]
    assert [t.candidate for t in (*last.earlier, last)] == states


def test_an_empty_container_is_exhausted(world_of: WorldOf) -> None:
    explored = explore(world_of([], np.zeros((0, 3))), search_policy("nearest_frontier"), 5, budget_m=50.0)
    assert (explored.ended, explored.found) == ("exhausted", ())


def test_the_budget_ends_it(world_of: WorldOf) -> None:
    world = world_of([cylinder(0.025)], [(0.1, 0.1, 0)])
    explored = explore(world, search_policy("random_descent"), 5, budget_m=0.5)
    assert explored.ended == "budget"
    assert 0.5 <= explored.travel_m < 1.0


@pytest.mark.parametrize(
    ("interior_m", "objects", "budget_m"),
    [((0.3, 0.4), 5, 8.0), ((0.3, 0.4), 1, 8.0), ((0.6, 0.8), 5, 32.0), ((0.4, 0.55), 10, 16.0)],
)
def test_the_budget_grows_with_the_objects_or_the_floor(
    interior_m: tuple[float, float], objects: int, budget_m: float
) -> None:
    world = replace(load_mission("survey").world)
    wide = replace(world, container=replace(world.container, interior_m=(*interior_m, 0.08)))
    planar = planar_world(wide, load_folder(world.objects.folder)[:1] * objects, 0)
    assert travel_budget_m(planar) == pytest.approx(budget_m)


def test_the_layout_of_a_seed_is_that_of_the_backends() -> None:
    world = load_mission("survey", {}).world
    meshes = load_folder(world.objects.folder, ("apple", "truck"))
    places = draw_layout(meshes, world, 7)
    planar = planar_world(world, meshes, 7)
    assert planar.poses == pytest.approx(np.array([(p.x_m, p.y_m, p.yaw_rad) for p in places]))
