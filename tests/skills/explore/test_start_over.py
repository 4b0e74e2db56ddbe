"""start_over: when everything that was found is forgotten."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_bt.perception.search import SearchMap
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.perception.touch.outline import envelope
from glotouch_skills.explore.start_over import StartOver


def searched(*candidates: Candidate) -> SearchMap:
    """Return a map that expects one object more than there are, as after a search for a missed one."""
    belief = SearchMap.blank((0.13, 0.18), len(candidates) + 1, 0.02, (0.3, 0.4))
    for c in candidates:
        belief = belief.with_exclusion(envelope(c), 0.01, c.index)
    return belief.with_path(np.array([[-0.1, 0.0], [0.0, 0.1]])).with_dropped((0.1, 0.1))


def pair(found, apart_m: float, quality: float = 1.0) -> tuple[Candidate, Candidate]:
    """Return two discs of 40 mm with their centres at a distance, the second one of a quality."""
    one, other = found.round((0.0, 0.0), 0.02), found.round((apart_m, 0.0), 0.02, index=4)
    return one, replace(other, quality=quality)


@pytest.mark.parametrize(("apart_m", "quality"), [(0.025, 1.0), (0.1, 0.2)])
def test_a_map_that_contradicts_itself_is_forgotten(bench, found, apart_m: float, quality: float) -> None:
    """Two discs that overlap by 15 mm; then two far apart, of which one is hardly known."""
    known = pair(found, apart_m, quality)
    b = bench()
    b.arm.felt.add(np.zeros((2, 3)), np.zeros(2))
    skill = b.make(StartOver, inputs={"before": searched(*known), "known": known}, expected_objects=2)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    blank = SearchMap.blank((0.13, 0.18), 2, 0.02, (0.3, 0.4))
    np.testing.assert_array_equal(skill.map.half_extent_m, blank.half_extent_m)
    assert (skill.map.expected, skill.map.left_below, skill.map.interior_m) == (2, 0.02, (0.3, 0.4))
    assert (len(skill.map.path_K_m), skill.map.exclusions, len(skill.map.dropped)) == (0, (), 0)
    assert skill.map.first_index == 5, "a candidate's index names one object in the whole record"
    assert (skill.candidates, skill.touchsets, skill.doubtful, skill.times_forgotten) == ((), (), (), 1)
    (section,) = b.of_kind("report")
    assert section["rows"][0][0] == "0, 4"
    assert not len(b.arm.felt.state()["touched_K_m"])


def test_start_over__consistent(bench, found) -> None:
    """Discs that overlap by 5 mm may be off by that; and it forgets only as often as it may."""
    near, deep = pair(found, 0.035), pair(found, 0.025)
    for known, times in ((near, 0), (deep, 1), ((), 0)):
        b = bench()
        inputs = {"before": searched(*known), "known": known, "times_before": times}
        skill = b.make(StartOver, inputs=inputs)
        b.run(skill)
        assert (skill.status, skill.reason.code) == (Status.FAILURE, "consistent")


def test_an_unknown_number_stays_unknown(bench, found) -> None:
    known = pair(found, 0.025)
    b = bench()
    skill = b.make(StartOver, inputs={"before": searched(*known), "known": known}, expected_objects="unknown")
    b.run(skill)
    assert skill.map.expected is None
