"""forget_doubtful: candidates that closures contradict, and what was searched around them, are forgotten."""

from __future__ import annotations

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_bt.perception.recognition import PARTS, ProbeTouch
from glotouch_bt.perception.search import SearchMap
from glotouch_bt.perception.touch import TouchSet
from glotouch_skills.explore.forget_doubtful import AROUND_M, ForgetDoubtful

HALF = (0.17, 0.12)


@pytest.fixture
def things(found):
    return tuple(found.round((0.06 * i, 0.0), 0.02, index=i) for i in range(3))


def searched(things, expected: int | None) -> SearchMap:
    """A line along x_K and one along the far wall were swept, and three objects were traced."""
    across = [np.column_stack([np.linspace(-0.15, 0.15, 60), np.full(60, y)]) for y in (0.0, -0.115)]
    belief = SearchMap.blank(HALF, expected).with_path(across[0]).with_path(across[1])
    for thing in things:
        belief = belief.with_exclusion(thing.contour, 0.006, thing.index)
    return belief


@pytest.mark.parametrize("expected", [2, 3, None])
def test_the_doubtful_and_what_was_searched_around_them_are_forgotten(bench, things, expected: int | None) -> None:
    b, before = bench(), searched(things, expected)
    given = {
        "before": before,
        "known": things,
        "before_doubtful": (1,),
        "before_probed": tuple(ProbeTouch(i, part) for i in range(3) for part in PARTS),
        "felt": tuple(TouchSet(t, ()) for t in things),
    }
    skill = b.make(ForgetDoubtful, inputs=given)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert (skill.forgotten, skill.doubtful, skill.candidates) == (1, (), (things[0], things[2]))
    assert {t.candidate for t in skill.probed} == {0, 2}
    assert [t.candidate.index for t in skill.touchsets] == [0, 2]
    assert [e.index for e in skill.map.exclusions] == [0, 2]
    assert skill.map.expected == (None if expected is None else 3), "it is searched for, also beyond a known number"
    assert not skill.map.complete
    reach_m = 0.02 + things[1].height_m + AROUND_M
    far = np.linalg.norm(before.path_K_m - things[1].contour.centre_K_m, axis=1) >= reach_m
    assert 0 < far.sum() < len(far)
    assert skill.map.path_K_m == pytest.approx(before.path_K_m[far]), "free space stays free elsewhere"


def test_nothing_is_doubtful(bench, things) -> None:
    b, before = bench(), searched(things, 3)
    skill = b.make(ForgetDoubtful, inputs={"before": before, "known": things})
    b.run(skill)
    assert (skill.status, skill.forgotten, skill.candidates) == (Status.SUCCESS, 0, things)
    assert len(skill.map.path_K_m) == len(before.path_K_m)
    assert skill.map.complete


def test_nothing_was_searched(bench) -> None:
    b = bench()
    skill = b.make(ForgetDoubtful)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "nothing_searched")
