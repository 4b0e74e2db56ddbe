"""Where the open jaws stand: closed forms for rectangles and circles, and room among neighbours."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_skills.common.hand.clearance_rules import keeping_clear_of
from glotouch_skills.common.planning.squeeze_plan import MIN_SIDE_GAP_M, plan_stances, schemes, stance

GRIPPER = RIZON4_XENSE.gripper
STROKE = GRIPPER.stroke_m


@pytest.mark.parametrize("yaw", [0.0, 0.5, -1.2])
@pytest.mark.parametrize("along", [-0.01, 0.0, 0.015])
def test_a_stance_over_a_rectangle(found, yaw: float, along: float) -> None:
    """Closing across the short side: opening = short side + both gaps, centred, `along` on the long axis."""
    centre = np.array([0.03, -0.05])
    candidate = found.box(tuple(centre), (0.07, 0.04), yaw)
    at = stance(candidate, along, yaw, 0.010, GRIPPER)
    assert at.opening_m == pytest.approx(0.04 + 0.02)
    np.testing.assert_allclose(at.position_K_m, centre + along * np.array([np.cos(yaw), np.sin(yaw)]), atol=1e-12)
    assert at.yaw_K_rad == yaw


def test_a_stance_is_midway_of_what_was_traced_not_of_the_fit(found) -> None:
    """A limb on one side: the jaws stand midway between its tip and the other side."""
    body = found.round((0.0, 0.0), 0.02)
    points = np.vstack([[c.point_K_m for c in body.contacts], [0.0, 0.03]])
    candidate = found.traced(0, points, 0.06)
    low, high = candidate.span_m(0.5 * np.pi)
    assert low == pytest.approx(-0.02, abs=1e-3)  # the outline drawn round the points adds some
    assert high == pytest.approx(0.03, abs=1e-3)
    at = stance(candidate, 0.0, 0.0, 0.01, GRIPPER)
    assert at.position_K_m[1] == pytest.approx(0.5 * (low + high), abs=1e-9)
    assert at.opening_m == pytest.approx(high - low + 0.02, abs=1e-9)


def test_the_opening_is_no_wider_than_the_stroke_and_what_is_too_wide_has_no_stance(found) -> None:
    widest = STROKE - 2 * MIN_SIDE_GAP_M
    assert stance(found.box((0, 0), (0.09, widest - 1e-6)), 0.0, 0.0, 0.01, GRIPPER).opening_m == STROKE
    assert stance(found.box((0, 0), (0.09, widest + 1e-6)), 0.0, 0.0, 0.01, GRIPPER) is None


def test_of_an_irregular_outline_that_is_too_wide_only_the_part_between_the_fingers_must_fit(found) -> None:
    """A T: its bar is 100 mm long and does not fit; its stem is 20 mm wide, 60 mm from the bar's middle to its end."""
    bar = [(x, y) for x in np.linspace(-0.05, 0.05, 11) for y in (-0.01, 0.01)]
    stem = [(x, y) for y in np.linspace(-0.06, -0.01, 6) for x in (-0.01, 0.01)]
    corners = np.array([[-0.05, 0.01], [-0.05, -0.01], [-0.01, -0.01], [-0.01, -0.06],
                        [0.01, -0.06], [0.01, -0.01], [0.05, -0.01], [0.05, 0.01]])  # fmt: skip
    outline = np.concatenate(
        [np.linspace(a, b, 12)[:-1] for a, b in zip(corners, np.roll(corners, -1, 0), strict=True)]
    )
    traced = found.traced(0, np.array(bar + stem), 0.06)
    contour = replace(traced.contour, family="free", boundary_K_m=outline, centre_K_m=np.array([0.0, 0.0]))
    candidate = replace(traced, contour=contour)
    at = stance(candidate, -0.045, 0.5 * np.pi, 0.01, GRIPPER)  # across the end of the stem
    assert at.opening_m == pytest.approx(0.02 + 0.02)
    np.testing.assert_allclose(at.position_K_m, [0.0, -0.045], atol=1e-9)
    assert stance(candidate, 0.0, 0.5 * np.pi, 0.01, GRIPPER) is None


def test_a_round_thing_is_turned_about_a_box_is_walked_along(found, bench) -> None:
    gripper = bench().arm.description.gripper
    for scheme in schemes(found.round((0, 0), 0.02), gripper):
        yaws = np.rad2deg([alternatives[0][1] for alternatives in scheme])
        np.testing.assert_allclose(np.diff(np.sort(yaws)), [60, 60])
        assert all(along == 0.0 for alternatives in scheme for along, _ in alternatives)
    (scheme,) = schemes(found.box((0, 0), (0.08, 0.04), 0.3), gripper)
    assert [a[0] for a in scheme] == [(-0.02, 0.3), (0.0, 0.3), (0.02, 0.3)]
    # On a short box the pads stay whole on the side: half the side less half the pad.
    (scheme,) = schemes(found.box((0, 0), (0.025, 0.02)), gripper)
    assert scheme[2][0][0] == pytest.approx(0.0125 - 0.5 * gripper.pad_window_m[0])


def test_three_stances_in_the_open_and_none_between_walls_of_neighbours(found, bench) -> None:
    b = bench()
    candidate = found.round((0.0, 0.0), 0.025)
    stances, refusals = b.go(plan_stances(candidate, b.arm, b.world.container, 0.021, (0.01, 0.005)))
    assert (len(stances), refusals) == (3, [])
    ring = [found.round((0.058 * np.cos(a), 0.058 * np.sin(a)), 0.028, index=i + 1) for i, a in enumerate(np.arange(6))]
    with keeping_clear_of(b.arm, ring):
        stances, refusals = b.go(plan_stances(candidate, b.arm, b.world.container, 0.021, (0.01, 0.005)))
    assert stances == []
    assert any("candidate" in r for r in refusals)
