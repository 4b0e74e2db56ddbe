"""Where a recognised object is taken hold of: near its centre of mass, with both pads, felt late."""

from __future__ import annotations

import hashlib

import numpy as np
import pytest
import trimesh

from glotouch_bt.recognition import Match
from glotouch_bt.robot.meshes import Mesh
from glotouch_bt.touch import Layer, TouchSequence, TouchSet
from skills.grasp_plan import ALTERNATIVES, STALENESS, plan_grasp

SHAPE = (35, 20)


def block(height_m: float) -> Mesh:
    """A block standing at the origin; centre of mass at half its height."""
    solid = trimesh.creation.box((0.05, 0.04, height_m))
    solid.apply_translation([0, 0, 0.5 * height_m])
    digest = hashlib.sha256(str(height_m).encode()).hexdigest()
    return Mesh("block", np.array(solid.vertices), np.array(solid.faces), digest)


def layer(height_m: float, x_m: float = 0.0, *, stable: bool = True, left: float = 5e-4, right: float = 5e-4) -> Layer:
    maps = np.full(SHAPE, left), np.full(SHAPE, right)
    return Layer(height_m, 0.04, np.array([x_m, 0.0]), 0.0, *maps, 10.0, stable)


def matched(x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> Match:
    return Match(0, 1.0, {}, None, (x, y, yaw), 3.0)


@pytest.fixture
def touched(found):
    def make(*sequences: tuple[Layer, ...]) -> TouchSet:
        candidate = found.box((0.0, 0.0), (0.05, 0.04))
        return TouchSet(candidate, tuple(TouchSequence(np.zeros(2), 0.0, s) for s in sequences))

    return make


@pytest.mark.parametrize("com_m", [0.02, 0.03, 0.045])
def test_the_layer_at_the_height_of_the_centre_of_mass_wins(touched, com_m: float) -> None:
    heights = (0.02, 0.03, 0.045)
    plan = plan_grasp(touched(tuple(layer(h) for h in heights)), matched(), block(2 * com_m))
    assert plan.position_K_m[2] == com_m
    assert [a.position_K_m[2] for a in plan.alternatives] == sorted(
        (h for h in heights if h != com_m), key=lambda h: abs(h - com_m)
    )


def test_the_track_through_the_centre_of_mass_wins_wherever_the_object_stands(touched) -> None:
    """The centre of mass is the mesh's, at the fitted pose: here 20 mm along x."""
    tracks = [(layer(0.03, x),) for x in (0.0, 0.02, -0.02)]
    # the middle sequence is one staler than the last, but 40 mm nearer
    plan = plan_grasp(touched(*tracks), matched(x=0.02, yaw=1.0), block(0.06))
    assert plan.position_K_m[0] == 0.02


def test_of_two_alike_the_later_wins_and_staleness_has_its_price(touched) -> None:
    plan = plan_grasp(touched((layer(0.0301),), (layer(0.0299),)), matched(), block(0.06))
    assert plan.position_K_m[2] == 0.0299
    # A lever that costs more than the staleness of the older one.
    lever = 2 * 0.015 * np.sqrt(1 / STALENESS - 1)
    plan = plan_grasp(touched((layer(0.03),), (layer(0.03 + 1.05 * lever),)), matched(), block(0.06))
    assert plan.position_K_m[2] == 0.03
    plan = plan_grasp(touched((layer(0.03),), (layer(0.03 + 0.95 * lever),)), matched(), block(0.06))
    assert plan.position_K_m[2] > 0.03


@pytest.mark.parametrize("worse", [{"stable": False}, {"left": 0.0}, {"right": 0.0}])
def test_what_does_not_hold_comes_last(touched, worse: dict[str, float]) -> None:
    plan = plan_grasp(touched((layer(0.03, **worse), layer(0.02))), matched(), block(0.06))
    assert plan.position_K_m[2] == 0.02


def test_the_opening_spans_what_was_traced_and_there_are_few_alternatives(touched) -> None:
    plan = plan_grasp(touched(tuple(layer(0.01 + 0.004 * k) for k in range(9))), matched(), block(0.06), 0.008)
    assert plan.opening_m == pytest.approx(0.04 + 0.016)
    assert plan.aperture_m == 0.04
    assert len(plan.alternatives) == ALTERNATIVES
    assert all(a.alternatives == () for a in plan.alternatives)
