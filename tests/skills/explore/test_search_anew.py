"""search_anew: what is kept of a search."""

from __future__ import annotations

import numpy as np
from py_trees.common import Status

from glotouch_bt.perception.search import SearchMap
from glotouch_bt.perception.touch.outline import envelope
from glotouch_skills.explore.search_anew import SearchAnew
from tests.support.swept_area import covered_fraction


def test_objects_are_kept_and_ways_forgotten(bench, found) -> None:
    thing = found.round((0.05, 0.0), 0.02)
    before = SearchMap.blank((0.13, 0.18), 3).with_exclusion(envelope(thing), 0.01)
    before = before.with_path(np.array([[-0.1, 0.0], [0.0, 0.1]])).with_dropped((0.1, 0.1))
    b = bench()
    skill = b.make(SearchAnew, inputs={"before": before})
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    after = skill.map
    assert (after.expected, after.found, after.exclusions) == (3, 1, before.exclusions)
    assert (len(after.path_K_m), len(after.dropped)) == (0, 0)
    assert covered_fraction(after, 0.03) < 0.5 * covered_fraction(before, 0.03)


def test_one_more_object_is_looked_for_where_nothing_was_searched(bench, found) -> None:
    before = SearchMap.blank((0.13, 0.18), 1).with_exclusion(envelope(found.round((0.05, 0.0), 0.02)), 0.01)
    before = before.with_path(np.array([[-0.1, 0.0], [0.0, 0.1]]))
    b = bench()
    skill = b.make(SearchAnew, inputs={"before": before}, more_objects=1)
    b.run(skill)
    assert before.complete
    assert not skill.map.complete
    assert (skill.map.expected, skill.found) == (2, 1)
    assert len(skill.map.path_K_m) == len(before.path_K_m)


def test_what_turned_out_to_be_another_object_does_not_count(bench, found) -> None:
    """Three objects were traced, but two of them are one: the search was complete too early."""
    apart = [found.round((x, 0.0), 0.02, index=i) for i, x in enumerate((-0.08, 0.0, 0.08))]
    before = SearchMap.blank((0.13, 0.18), 3)
    for candidate in apart:
        before = before.with_exclusion(envelope(candidate), 0.01, candidate.index)
    b = bench()
    skill = b.make(SearchAnew, inputs={"before": before, "candidates": tuple(apart[:2])}, more_objects=1)
    b.run(skill)
    after = skill.map
    assert before.complete
    assert not after.complete
    assert (after.expected, after.found, skill.found) == (3, 2, 2)
    place = apart[2].contour.centre_K_m[None]
    assert before.inside_exclusion(place).all()
    assert not after.inside_exclusion(place).any()
    assert after.first_index == 3


def test_search_anew__nothing_searched(bench) -> None:
    b = bench()
    skill = b.make(SearchAnew)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "nothing_searched")


def test_an_unknown_number_becomes_a_known_one(bench, found) -> None:
    before = SearchMap.blank((0.13, 0.18), None).with_exclusion(envelope(found.round((0.05, 0.0), 0.02)), 0.01)
    b = bench()
    skill = b.make(SearchAnew, inputs={"before": before}, more_objects=1)
    b.run(skill)
    assert skill.map.expected == 2
