"""clear_plan on the fake robot: it moves nothing, and hands on a grasp and places."""

from __future__ import annotations

import numpy as np
from py_trees.common import Status

from glotouch_bt.perception.search import SearchMap
from glotouch_skills.common.planning import Neighbour
from glotouch_skills.make_space.clear_plan import ClearPlan, obstacles


def make(bench, known, cramped=(), **params):
    b = bench()
    return b, b.make(ClearPlan, inputs={"known": known, "cramped": cramped}, **params)


def crowd(found):
    """A long object whose fingers meet the second one."""
    return (
        found.box((0.0, -0.10), (0.12, 0.05), index=0),
        found.box((0.0, -0.045), (0.05, 0.04), index=1),
        found.round((0.10, 0.15), 0.02, index=2),
    )


def test_the_neighbour_that_blocks_is_planned(bench, found) -> None:
    b, skill = make(bench, crowd(found), cramped=(0,))
    where = b.arm.pose_B_P.position_m.copy()
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert skill.plan.candidate == skill.places[0].candidate == 1
    assert b.of_kind("clear_plan")[0]["candidate"] == 1
    np.testing.assert_allclose(b.arm.pose_B_P.position_m, where, atol=1e-6)


def test_a_stated_object_is_planned_whether_or_not_it_makes_space(bench, found) -> None:
    b, skill = make(bench, crowd(found), candidate=2)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert skill.plan.candidate == 2


def test_clear_plan__no_clear__nothing_lacks_space_or_nothing_helps(bench, found) -> None:
    for cramped, params in (((), {}), ((2,), {}), ((), {"candidate": 7})):
        b, skill = make(bench, crowd(found), cramped, **params)
        b.run(skill)
        assert (skill.status, skill.reason.code) == (Status.FAILURE, "no_clear")


def test_what_the_search_met_but_did_not_trace_is_an_obstacle(found) -> None:
    belief = SearchMap.blank((0.14, 0.19), 5).with_obstacle((0.05, 0.0), 0.02)
    belief = belief.with_exclusion(found.round((0.0, 0.1), 0.02).contour, 0.008)
    (only,) = obstacles(belief)
    assert isinstance(only, Neighbour)
    np.testing.assert_allclose(np.linalg.norm(only.points_K_m - (0.05, 0.0), axis=1).max(), 0.02)
    assert obstacles(None) == ()
