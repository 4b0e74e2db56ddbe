"""find_place on the fake robot: it moves nothing, and names places at which the held object keeps its distance."""

from __future__ import annotations

import numpy as np
from py_trees.common import Status

from glotouch_bt.perception.search import SearchMap
from glotouch_bt.perception.touch import signed_distance
from glotouch_skills.common.planning.grasp_plan import GraspPlan
from glotouch_skills.make_space.find_place import FindPlace

MIN_GAP_M = 0.012
"""Minimum gap that a place keeps: the smallest of `GAPS_M` of the planner."""
RADIUS_M = 0.025


def make(bench, known, candidate=0, **inputs):
    b = bench(grip_width_m=2 * RADIUS_M)
    made = GraspPlan(candidate, np.array([0.01, 0.04, 0.03]), 0.0, 2 * RADIUS_M, 0.07)
    return b, b.make(FindPlace, inputs={"made": made, "known": known} | inputs)


def test_places_keep_their_distance_from_objects_walls_and_the_old_place(bench, found) -> None:
    held, other = found.round((0.01, 0.04), RADIUS_M, index=0), found.box((0.05, -0.08), (0.08, 0.06), index=1)
    b, skill = make(bench, (held, other))
    where = b.arm.pose_B_P.position_m.copy()
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    np.testing.assert_allclose(b.arm.pose_B_P.position_m, where, atol=1e-6)
    half = 0.5 * np.array(b.context.world.container.interior_m[:2])
    angles = np.linspace(0, 2 * np.pi, 180)
    rim = RADIUS_M * np.column_stack([np.cos(angles), np.sin(angles)])
    ways = []
    for place in skill.places:
        centre = place.moved(held.contour.centre_K_m)
        assert np.abs(centre + rim).max(axis=0)[0] <= half[0] - MIN_GAP_M + 1e-4
        assert np.abs(centre + rim).max(axis=0)[1] <= half[1] - MIN_GAP_M + 1e-4
        assert signed_distance(other.contour, centre + rim).min() >= MIN_GAP_M - 1e-4
        ways.append(np.linalg.norm(centre - held.contour.centre_K_m))
        assert ways[-1] >= 2 * RADIUS_M - 1e-4
    assert ways == sorted(ways)


def test_what_the_search_met_and_did_not_trace_is_kept_clear_of(bench, found) -> None:
    held = found.round((0.01, 0.04), RADIUS_M, index=0)
    b, skill = make(bench, (held,))
    b.run(skill)
    first = skill.places[0].moved(held.contour.centre_K_m)
    belief = SearchMap.blank((0.14, 0.19), 5).with_obstacle(tuple(first), 0.02)
    b, skill = make(bench, (held,), map=belief)
    b.run(skill)
    assert all(np.linalg.norm(p.moved(held.contour.centre_K_m) - first) > 0.045 for p in skill.places)


def test_find_place__no_place__the_box_is_full_or_the_object_is_unknown(bench, found) -> None:
    held = found.round((0.01, 0.04), RADIUS_M, index=0)
    full = tuple(
        found.box((x, y), (0.08, 0.08), index=k + 1)
        for k, (x, y) in enumerate((x, y) for x in (-0.09, 0.0, 0.09) for y in (-0.15, -0.06, 0.03, 0.12))
    )
    for known, candidate in (((held, *full), 0), ((held,), 7)):
        b, skill = make(bench, known, candidate)
        b.run(skill)
        assert (skill.status, skill.reason.code) == (Status.FAILURE, "no_place")


def test_broken_off_anywhere(bench, found, preempt_all_along) -> None:
    preempt_all_along(lambda: make(bench, (found.round((0.01, 0.04), RADIUS_M),)), 4, finish=False)
