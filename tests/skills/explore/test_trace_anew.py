"""trace_anew: outlines that cannot be right are traced anew, and their contacts become hints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_bt.perception.recognition import ProbeTouch
from glotouch_bt.perception.search import SearchMap
from glotouch_skills.explore.trace_anew import AROUND_M, MISSING, TraceAnew

HALF = (0.17, 0.12)


def three(found, gap_m: float = 0.02, quality: float = 1.0):
    """Return three discs of 40 mm in a row; the middle one has a quality, and a gap to the first one."""
    middle = replace(found.round((0.0, 0.0), 0.02, index=1), quality=quality)
    return found.round((-0.04 - gap_m, 0.0), 0.02, index=0), middle, found.round((0.08, 0.0), 0.02, index=2)


def searched(things, expected: int | None = 3) -> SearchMap:
    """A line along x_K and one along the far wall were swept, and the discs were traced."""
    belief = SearchMap.blank(HALF, expected)
    for y in (0.0, -0.115):
        belief = belief.with_path(np.column_stack([np.linspace(-0.15, 0.15, 60), np.full(60, y)]))
    for thing in things:
        belief = belief.with_exclusion(thing.contour, 0.006, thing.index)
    return belief


def run(bench, things, belief: SearchMap, traced=(0, 1, 2), **inputs) -> TraceAnew:
    probed = tuple(ProbeTouch(i, "outline") for i in traced)
    skill = bench.make(TraceAnew, inputs={"before": belief, "known": things, "before_probed": probed, **inputs})
    bench.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    return skill


@pytest.mark.parametrize("expected", [3, None])
@pytest.mark.parametrize(("gap_m", "quality", "why"), [(0.02, 0.05, "uncertain"), (-0.015, 0.9, "overlaps")])
def test_a_wrong_outline_is_forgotten(bench, found, expected, gap_m: float, quality: float, why: str) -> None:
    """The middle disc is hardly known; or it is known well, but overlaps a better known one by 15 mm."""
    b, things = bench(), three(found, gap_m, quality)
    before = searched(things, expected)
    skill = run(b, things, before)
    assert (skill.search_done, [row[:2] for row in skill.retraced]) == (False, [("1", "1")])
    assert skill.candidates == (things[0], things[2])
    assert {t.candidate for t in skill.probed} == {0, 2}
    assert skill.map.expected == expected
    assert {id(c) for c in skill.map.hints} == {id(c) for c in things[1].contacts}, "the search begins where it was"
    off_m = np.linalg.norm(before.path_K_m, axis=1) - 0.02 - AROUND_M
    kept = np.isin(before.path_K_m[:, 0] + 1j * before.path_K_m[:, 1], skill.map.path_K_m @ [1.0, 1j])
    assert kept[off_m > 1e-3].all(), "free space stays free elsewhere"
    assert not kept[off_m < -1e-3].any()
    assert skill.map.to_replace == (things[1],), "what is traced in its place gets its index"
    (event,) = b.of_kind("note")
    assert why in event["text"]
    assert not b.of_kind("forgotten"), "until then it stays on the map"


def test_a_map_that_may_be_right_is_kept(bench, found) -> None:
    """Discs that overlap by 5 mm may be off by that; what was not refined may still become search_done."""
    for things, traced in ((three(found, -0.005), (0, 1, 2)), (three(found, quality=0.05), (0, 2))):
        before = searched(things)
        skill = run(bench(), things, before, traced)
        assert (skill.search_done, skill.candidates, skill.retraced) == (True, things, ())
        np.testing.assert_array_equal(skill.map.path_K_m, before.path_K_m)


def test_with_as_many_others_as_objects_the_search_does_not_go_on(bench, found) -> None:
    """One of three outlines is uncertain, and two objects are said to be there: it may be no object."""
    things = three(found, quality=0.2)
    skill = run(bench(), things, searched(things, 2))
    assert (skill.search_done, skill.candidates, skill.map.expected) == (False, (things[0], things[2]), 2)
    assert skill.map.complete


def test_an_outline_that_its_contacts_do_not_fit_is_traced_anew(bench, found) -> None:
    """A half of the contacts lies 15 mm outside the outline: a neighbour's."""
    things = three(found)
    contacts = things[1].contacts
    far = tuple(replace(c, point_K_m=1.75 * c.point_K_m) for c in contacts[::2])
    mixed = (things[0], replace(things[1], contacts=(*contacts[1::2], *far)), things[2])
    skill = run(bench(), mixed, searched(mixed))
    assert (skill.search_done, skill.candidates) == (False, (things[0], things[2]))
    assert skill.retraced == (("1", "1", "its contacts are 11 mm off its outline"),)


def test_an_outline_narrower_than_any_object_is_traced_anew(bench, found) -> None:
    things = (*three(found)[:2], found.box((0.08, 0.0), (0.09, 0.012), index=2))
    skill = run(bench(), things, searched(things))
    assert skill.retraced == (("1", "2", "its outline is only 12 mm wide"),)


def test_one_that_is_not_found_again_is_forgotten(bench, found) -> None:
    things = three(found)
    belief = replace(searched(things), to_replace=(things[1],))
    for known, lost in ((things, []), ((things[0], things[2]), [(1,)])):
        b = bench()
        skill = run(b, known, belief)
        assert [tuple(e["candidates"]) for e in b.of_kind("forgotten")] == lost
        assert skill.map.to_replace == ()


def test_one_that_is_missing_is_searched_for(bench, found) -> None:
    """Two outlines turned out to be one body after the search had ended."""
    things = three(found)
    skill = run(bench(), things[:2], searched(things))
    assert (skill.search_done, skill.candidates) == (False, things[:2])
    assert not skill.map.complete
    assert skill.retraced == (("1", "-", MISSING),)


def test_it_forgets_only_so_often(bench, found) -> None:
    things = three(found, quality=0.05)
    rounds = (("1", "4", "uncertain"), ("1", "5", "uncertain"))
    again = run(bench(), things, searched(things), before_retraced=rounds)
    assert (again.search_done, len(again.retraced)) == (False, 3)
    last = run(bench(), things, searched(things), before_retraced=again.retraced)
    assert (last.search_done, last.candidates, last.retraced) == (True, things, again.retraced)


def test_without_a_map_it_fails(bench) -> None:
    b = bench()
    skill = b.make(TraceAnew, inputs={})
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "nothing_searched")
