"""Where a carried object stands, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from glotouch_bt.perception.touch import signed_distance
from glotouch_skills.make_space.carried import ACROSS_SD_M, ALONG_SD_M, Grip, after_carry, centred_m

PAD_HALF_M = 0.0086


@pytest.mark.parametrize("off_m", [-0.004, 0.0, 0.003])
@pytest.mark.parametrize("yaw_deg", [0, 50])
def test_closing_jaws_bring_the_middle_between_the_pads(found, off_m: float, yaw_deg: float) -> None:
    yaw = math.radians(yaw_deg)
    across = np.array([-math.sin(yaw), math.cos(yaw)])
    thing = found.box((0.02, 0.01), (0.08, 0.04), yaw)
    grip = Grip(thing.contour.centre_K_m + off_m * across, yaw)
    np.testing.assert_allclose(centred_m(thing, grip, PAD_HALF_M), off_m * across, atol=1e-9)


def test_jaws_that_closed_beside_the_outline_centre_nothing(found) -> None:
    np.testing.assert_array_equal(centred_m(found.round((0, 0), 0.02), Grip(np.array([0.1, 0.0]), 0.0), PAD_HALF_M), 0)


@pytest.mark.parametrize("turn_deg", [0, 45, -90, 170])
def test_it_moves_rigidly_with_the_hand(found, turn_deg: float) -> None:
    thing = found.box((0.0, 0.0), (0.08, 0.04), 0.3)
    turn = math.radians(turn_deg)
    taken, released = Grip(np.array([0.01, 0.003]), 0.3), Grip(np.array([-0.05, 0.09]), 0.3 + turn)
    moved = after_carry(thing, taken, released, PAD_HALF_M)
    c, s = math.cos(turn), math.sin(turn)
    from_hand = np.array([[c, -s], [s, c]]) @ (
        thing.contour.centre_K_m + centred_m(thing, taken, PAD_HALF_M) - taken.position_K_m
    )
    np.testing.assert_allclose(moved.contour.centre_K_m, released.position_K_m + from_hand, atol=1e-12)
    assert math.remainder(moved.contour.yaw_rad - 0.3 - turn, math.pi) == pytest.approx(0.0, abs=1e-12)
    assert (moved.height_m, moved.contour.size_m) == (thing.height_m, thing.contour.size_m)
    for before, after in zip(thing.contacts, moved.contacts, strict=True):
        gaps = [signed_distance(t.contour, k.point_K_m[None])[0] for t, k in ((thing, before), (moved, after))]
        assert gaps[0] == pytest.approx(gaps[1], abs=1e-12)
        assert float(after.reaction_K[:2] @ before.reaction_K[:2]) == pytest.approx(math.cos(turn))


def test_its_place_is_less_certain_along_and_across_the_hand(found) -> None:
    import dataclasses

    thing = found.box((0.0, 0.0), (0.08, 0.04))
    contour = dataclasses.replace(thing.contour, covariance=np.diag([4e-6, 1e-6, 1e-4, 1e-6, 1e-6]))
    thing = dataclasses.replace(thing, contour=contour)
    grip = Grip(np.zeros(2), 0.0)
    turned = Grip(np.zeros(2), 0.5 * math.pi)
    moved = after_carry(thing, grip, turned, PAD_HALF_M)
    expected = [1e-6 + ACROSS_SD_M**2, 4e-6 + ALONG_SD_M**2]
    np.testing.assert_allclose(np.diag(moved.contour.covariance)[:2], expected, atol=1e-12)
    assert moved.contour.covariance[2, 2] > 1e-4
    assert moved.quality < thing.quality
