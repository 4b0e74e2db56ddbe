"""Moves in worlds whose touches are known in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glotouch_bt.bench.planar import ContactModel, PlanarWorld, felt_section
from glotouch_bt.perception.search.moves import Move
from tests.bench.planar.conftest import HALF, IDEAL, TIP, WorldOf, box, cylinder

R = 0.025
PUSHING = ContactModel(localisation_sd_m=0.0, overshoot_m={"sweep": 0.002}, overshoot_spread=0.0, direction_sd_rad=0.0)


def go(kind, x, y):
    return Move(kind, np.array([x, y]))


@settings(max_examples=60, deadline=None)
@given(angle=st.floats(0, 2 * np.pi), off=st.floats(-0.95, 0.95))
def test_a_sweep_stops_where_the_ball_meets_a_disc(angle: float, off: float) -> None:
    world = PlanarWorld([felt_section(cylinder(R))], np.zeros((1, 3)), HALF, TIP, np.random.default_rng(0), IDEAL)
    u, left = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    across = off * (R + TIP)
    start = across * left - 0.09 * u
    world.execute(Move("hop", start))
    felt = world.execute(Move("sweep", start + 0.18 * u))
    exact = across * left - np.sqrt((R + TIP) ** 2 - across**2) * u
    assert felt.tip_K_m == pytest.approx(exact, abs=0.0003)  # a graze of an edge of 0.05 mm's height is 0.2 mm long
    assert np.linalg.norm(felt.tip_K_m) == pytest.approx(R + TIP, abs=0.00005)
    contact = felt.contact
    assert contact is not None
    assert contact.approach_K == pytest.approx([*u, 0])
    normal = exact / (R + TIP)
    slope = np.arccos(np.clip(contact.reaction_K[:2] @ normal, -1, 1))
    assert slope <= np.arctan(IDEAL.friction) + 0.02
    assert contact.reaction_K[:2] @ u < 0
    assert np.linalg.norm(contact.point_K_m - contact.tip_K_m[:2]) == pytest.approx(TIP)


def test_travel_is_the_planar_length_of_everything(world_of: WorldOf) -> None:
    world = world_of([cylinder(R)], [(0, 0, 0)])
    places = [
        ("hop", -0.1, -0.1),
        ("sweep", -0.1, 0.1),
        ("step", -0.05, 0.1),
        ("retreat", -0.05, 0.05),
        ("hop", 0, 0.1),
    ]
    at, length = world.tip_K_m.copy(), 0.0
    for kind, x, y in places:
        felt = world.execute(go(kind, x, y))
        length += float(np.linalg.norm(np.array([x, y]) - at))
        at = felt.tip_K_m
        assert felt.contact is None
        assert at == pytest.approx([x, y])
    assert world.travel_m == pytest.approx(length)


def test_the_path_is_what_was_gone_at_sensing_height(world_of: WorldOf) -> None:
    world = world_of([cylinder(R)], [(0, 0, 0)])
    assert len(world.execute(go("hop", -0.1, 0)).path_K_m) == 1
    path = world.execute(go("sweep", 0.1, 0)).path_K_m
    assert path[0] == pytest.approx([-0.1, 0])
    assert path[-1] == pytest.approx([-R - TIP, 0], abs=0.00005)
    assert np.linalg.norm(np.diff(path, axis=0), axis=1).max() <= 0.002 + 1e-9


def test_raised_it_only_hops(world_of: WorldOf) -> None:
    world = world_of([], np.zeros((0, 3)))
    before = world.tip_K_m.copy()
    felt = world.execute(go("sweep", 0, 0))
    assert "raised" in felt.refused
    assert felt.tip_K_m == pytest.approx(before)
    assert world.travel_m == 0


def test_landing_on_an_object(world_of: WorldOf) -> None:
    world = world_of([cylinder(R, 0.05, "low")], [(0.05, 0.05, 1.0)])
    felt = world.execute(go("hop", 0.06, 0.05))
    assert felt.contact is not None
    assert felt.contact.approach_K == pytest.approx([0, 0, -1])
    assert felt.contact.tip_K_m == pytest.approx([0.06, 0.05, 0.05 + TIP], abs=0.0001)
    assert not world.lowered
    assert len(felt.path_K_m) == 0
    assert world.execute(go("hop", 0.05 + R + TIP + 0.001, 0.05)).contact is None
    assert world.lowered


def test_walls(world_of: WorldOf) -> None:
    world = world_of([], np.zeros((0, 3)))
    world.execute(go("hop", 0, 0))
    felt = world.execute(go("sweep", 0.3, 0.1))
    assert felt.contact is not None
    assert felt.tip_K_m[0] == pytest.approx(HALF[0] - TIP)
    assert felt.contact.reaction_K[0] < -0.9
    assert world.execute(go("hop", 0.149, 0)).refused


def test_a_push_through_the_middle_moves_without_turning(world_of: WorldOf) -> None:
    world = world_of([cylinder(R)], [(0, 0, 0.4)], PUSHING)
    world.execute(go("hop", -0.1, 0))
    felt = world.execute(go("sweep", 0.1, 0))
    assert world.poses[0] == pytest.approx([0.002 - PUSHING.give_m, 0, 0.4], abs=0.00002)
    assert felt.contact is not None
    assert felt.contact.tip_K_m[0] == pytest.approx(-R - TIP, abs=0.00005)
    assert felt.tip_K_m[0] == pytest.approx(-R - TIP + 0.002, abs=0.00005)
    assert felt.contact.pushed_K_m == pytest.approx([0.002 - PUSHING.give_m, 0], abs=0.00002)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_push_beside_the_middle_turns(world_of: WorldOf, side: float) -> None:
    world = world_of([box(0.03, 0.10)], [(0, 0, 0)], PUSHING)
    world.execute(go("hop", -0.1, 0.03 * side))
    world.execute(go("sweep", 0.1, 0.03 * side))
    assert world.poses[0, 0] > 0
    assert world.poses[0, 2] * side < 0
    at_contact = world.poses[0, 0] - world.poses[0, 2] * 0.03 * side
    assert at_contact == pytest.approx(0.002 - PUSHING.give_m, abs=0.0001)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 1000))
def test_the_ball_is_never_deep_inside_anything(seed: int) -> None:
    rng = np.random.default_rng(seed)
    sections = [felt_section(box(0.06, 0.03)), felt_section(cylinder(R))]
    poses = np.array([(-0.06, 0.05, rng.uniform(-3, 3)), (0.05, -0.08, 0.0)])
    world = PlanarWorld(sections, poses, HALF, TIP, rng)
    world.execute(go("hop", 0.0, 0.0))
    for _ in range(20):
        felt = world.execute(Move("sweep", rng.uniform(-0.9, 0.9, 2) * world.half_m))
        deepest = min(float(world.clearance(felt.tip_K_m[None], i)[0]) for i in range(2))
        assert deepest > -0.001  # the give of the probe, and second order of a turn
        if felt.contact is not None:
            world.execute(Move("retreat", felt.tip_K_m - 0.005 * felt.contact.approach_K[:2]))


def test_same_seed_same_felt(world_of: WorldOf) -> None:
    worlds = [world_of([cylinder(R)], [(0, 0, 0)], ContactModel(), seed=3) for _ in range(2)]
    felt = [(w.execute(go("hop", -0.1, 0)), w.execute(go("sweep", 0.1, 0.01)))[1] for w in worlds]
    assert felt[0].contact is not None
    assert felt[1].contact is not None
    assert (felt[0].contact.tip_K_m == felt[1].contact.tip_K_m).all()
    assert (worlds[0].poses == worlds[1].poses).all()
