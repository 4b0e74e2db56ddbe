import dataclasses

import numpy as np
import pytest

from glotouch_bt.perception.search import OutlineTrace, SearchMap, admit, joins, lost_among, of_another, part_of
from glotouch_bt.perception.search.bodies import outline_of
from glotouch_bt.perception.search.candidates import quality
from glotouch_bt.perception.touch import Candidate, Contact, signed_distance
from glotouch_bt.perception.touch.outline import KNOWN_QUALITY

R = 0.006
LIMB = ((0.0, 0.022, 0, 1), (0.0, -0.022, 0, -1), (0.012, 0.0, 1, 0))
"""Contacts round something narrow: x, y and outward normal."""


def contact(x, y, nx, ny):
    """A ball's contact with a surface through (x, y) whose outward normal is (nx, ny)."""
    out = np.array([nx, ny, 0.0])
    tip = np.array([x, y, 0.018]) + R * out
    return Contact(0.0, tip, -out, out, tip[:2] - R * out[:2], 1.0)


def half_a_box():
    """One end of a box of 90 mm x 44 mm from x = -50 mm to 40 mm."""
    return (
        contact(-0.03, 0.022, 0, 1),
        contact(0.01, 0.022, 0, 1),
        contact(-0.05, 0.0, -1, 0),
        contact(-0.03, -0.022, 0, -1),
        contact(0.01, -0.022, 0, -1),
    )


@pytest.fixture
def candidate():
    contacts = half_a_box()
    return Candidate(0, outline_of(contacts, R).contour, 0.018, 0.5, contacts)


def test_the_far_end_of_a_box_is_a_part_of_it(candidate):
    assert part_of((candidate,), contact(0.04, 0.0, 1, 0), R) is candidate


def test_what_stands_beside_it_is_not(candidate):
    assert part_of((candidate,), contact(0.0, 0.060, 0, -1), R) is None  # it faces the box
    assert part_of((candidate,), contact(0.15, 0.0, 1, 0), R) is None  # too far
    assert part_of((), contact(0.04, 0.0, 1, 0), R) is None


def test_more_of_a_candidate_replaces_it_and_counts_nothing(candidate):
    belief = SearchMap.blank((0.2, 0.15), expected=2).with_exclusion(candidate.contour, 0.01)
    last = contact(0.04, 0.0, 1, 0)
    contacts = (*candidate.contacts, last)
    traced = OutlineTrace(contacts, outline_of(contacts, R), np.zeros(2), np.zeros((0, 2)), continued=True)
    admitted = admit(belief, (candidate,), last, traced, 0.018, 0.01, part_of=candidate)
    assert (admitted.index, len(admitted.candidates), admitted.belief.found) == (0, 1, 1)
    np.testing.assert_allclose(admitted.candidates[0].contour.centre_K_m, [-0.005, 0.0], atol=1e-3)
    np.testing.assert_allclose(sorted(admitted.candidates[0].contour.size_m), [0.044, 0.090], atol=2e-3)


def test_the_height_of_a_new_candidate_is_that_of_the_trace_and_its_top_is_unknown():
    contacts = half_a_box()
    traced = OutlineTrace(contacts, outline_of(contacts, R), np.zeros(2), np.zeros((0, 2)), continued=False)
    (new,) = admit(SearchMap.blank((0.2, 0.15), expected=2), (), contacts[0], traced, 0.018, 0.01).candidates
    assert (new.height_m, new.top_touched) == (0.018, False)


def test_a_new_candidate_never_takes_the_index_of_a_traced_object(candidate):
    """A candidate that was left out, because it is the same body as another one, is still on the map."""
    belief = SearchMap.blank((0.3, 0.3), expected=3).with_exclusion(candidate.contour, 0.01, 0)
    belief = belief.with_exclusion(dataclasses.replace(candidate.contour, centre_K_m=np.array([0.2, 0.2])), 0.01, 1)
    contacts = tuple(dataclasses.replace(c, tip_K_m=c.tip_K_m - [0.0, 0.2, 0.0], point_K_m=c.point_K_m - [0.0, 0.2])
                     for c in half_a_box())  # fmt: skip
    traced = OutlineTrace(contacts, outline_of(contacts, R), np.zeros(2), np.zeros((0, 2)))
    admitted = admit(belief, (candidate,), contacts[0], traced, 0.018, 0.01)
    assert [c.index for c in admitted.candidates] == [0, 2]
    assert admitted.belief.found == 3


@pytest.mark.parametrize(("aside_m", "index"), [(0.0, 0), (0.015, 0), (0.2, 1)])
def test_what_is_traced_anew_keeps_its_index(candidate, aside_m, index):
    """The candidate to replace is half of the box; the box is traced where it stands, moved, or elsewhere."""
    belief = dataclasses.replace(SearchMap.blank((0.3, 0.3), expected=2), to_replace=(candidate,), first_index=1)
    aside = np.array([0.0, aside_m, 0.0])
    contacts = tuple(
        dataclasses.replace(c, tip_K_m=c.tip_K_m - aside, point_K_m=c.point_K_m - aside[:2])
        for c in (*half_a_box(), contact(0.04, 0.0, 1, 0))
    )
    traced = OutlineTrace(contacts, outline_of(contacts, R), np.zeros(2), np.zeros((0, 2)))
    admitted = admit(belief, (), contacts[0], traced, 0.018, 0.01)
    assert ([c.index for c in admitted.candidates], admitted.index) == ([index], index)


def test_what_stands_too_near_for_another_object_is_the_same(candidate):
    """16 mm off the contacts, where no other object can stand (30 mm); 26 mm off one can."""
    two = {}
    for gap in (0.016, 0.026):
        contacts = tuple(contact(0.01 + gap + dx, y, nx, ny) for dx, y, nx, ny in LIMB)
        traced = OutlineTrace(contacts, outline_of(contacts, R), np.zeros(2), np.zeros((0, 2)))
        belief = SearchMap.blank((0.2, 0.15), expected=2).with_exclusion(candidate.contour, 0.01)
        near = dataclasses.replace(candidate, contour=outline_of(candidate.contacts[:3], R).contour)
        two[gap] = len(admit(belief, (near,), contacts[0], traced, 0.018, 0.01).candidates)
    assert two == {0.016: 1, 0.026: 2}


def ring(x, y, radius, degrees):
    """Contacts round a disc."""
    angles = np.deg2rad(degrees)
    return tuple(
        contact(x + radius * c, y + radius * s, c, s) for c, s in zip(np.cos(angles), np.sin(angles), strict=True)
    )


def disc_of_40_mm(first=0.0):
    contacts = ring(0.0, 0.0, 0.02, np.arange(first, 360.0, 45.0))
    outline = outline_of(contacts, R)
    return Candidate(0, outline.contour, 0.018, quality(outline), contacts)


@pytest.mark.parametrize(
    ("contacts", "objects"),
    [
        (ring(0.050, 0.0, 0.02, [180.0, 90.0, 0.0, 270.0]), 2),  # another disc, 10 mm beside it
        (ring(0.007, 0.0, 0.02, [0.0, 60.0, 300.0]), 1),  # the same, pushed by 7 mm
    ],
    ids=["a neighbour", "pushed"],
)
def test_what_lies_beside_an_outline_known_on_all_sides(contacts, objects):
    known = disc_of_40_mm()
    traced = OutlineTrace(contacts, outline_of(contacts, R), np.zeros(2), np.zeros((0, 2)))
    belief = SearchMap.blank((0.2, 0.15), expected=2).with_exclusion(known.contour, 0.01)
    assert len(admit(belief, (known,), contacts[0], traced, 0.018, 0.01).candidates) == objects


def test_a_part_that_stands_out_costs_no_contact_and_is_checked():
    """A nose of 6 mm on the side of a disc: one body with a limb, or two that touch."""
    known, nose = disc_of_40_mm(45.0), ring(0.020, 0.0, 0.006, [90.0, 0.0, 270.0])
    traced = OutlineTrace(nose, outline_of(nose, R), np.zeros(2), np.zeros((0, 2)))
    belief = SearchMap.blank((0.2, 0.15), expected=3).with_exclusion(known.contour, 0.01)
    admitted = admit(belief, (known,), nose[0], traced, 0.018, 0.01)
    assert sum(len(c.contacts) for c in admitted.candidates) == len(known.contacts) + len(nose)
    assert len(admitted.candidates) == 1 + len(admitted.doubts)


def test_a_trace_round_a_neighbour_keeps_the_contacts_of_the_candidate_that_it_merges_with():
    """The first trace of a disc strayed onto a neighbour; a trace of the neighbour leaves both known."""
    disc = ring(0.0, 0.0, 0.035, [200.0, 170.0, 140.0, 110.0, 80.0, 230.0, 260.0])
    stray = ring(0.100, 0.0, 0.035, [180.0])
    outline = outline_of((*disc, *stray), R)
    mixed = Candidate(0, outline.contour, 0.018, quality(outline), (*disc, *stray))
    belief = SearchMap.blank((0.2, 0.15), expected=5).with_exclusion(mixed.contour, 0.01)
    neighbour = ring(0.100, 0.0, 0.035, [150.0, 100.0, 50.0, 0.0, 310.0])
    traced = OutlineTrace(neighbour, outline_of(neighbour, R), np.zeros(2), np.zeros((0, 2)))
    admitted = admit(belief, (mixed,), neighbour[0], traced, 0.018, 0.01)
    nearest = min(float(np.linalg.norm(c.contour.centre_K_m - [0.1, 0.0])) for c in admitted.candidates)
    assert nearest < 0.002
    assert sum(len(c.contacts) for c in admitted.candidates) == len(mixed.contacts) + len(neighbour)
    assert admitted.belief.found == len(admitted.belief.exclusions) == 2


@pytest.mark.parametrize("gap", [0.016, 0.026])
def test_a_trace_turns_out_to_be_of_a_candidate_where_it_will_be_made_one_with_it(candidate, gap):
    contacts = tuple(contact(0.01 + gap + dx, y, nx, ny) for dx, y, nx, ny in LIMB)
    near = dataclasses.replace(candidate, contour=outline_of(candidate.contacts[:3], R).contour)
    traced = OutlineTrace(contacts, outline_of(contacts, R), np.zeros(2), np.zeros((0, 2)))
    belief = SearchMap.blank((0.2, 0.15), expected=2).with_exclusion(candidate.contour, 0.01)
    one = len(admit(belief, (near,), contacts[0], traced, 0.018, 0.01).candidates) == 1
    assert joins((near,), contacts, R) == one == (gap == 0.016)
    assert not joins((), contacts, R)


def test_the_end_of_something_long_is_less_known_than_a_disc():
    """Both are touched all round their supposed middles: by coverage alone they are alike."""
    angles = np.deg2rad([10.0, 100.0, 190.0, 280.0])
    disc = tuple(
        contact(*(0.022 * np.array([c, s])), c, s) for c, s in zip(np.cos(angles), np.sin(angles), strict=True)
    )
    end = (
        contact(0.0, 0.022, 0, 1),
        contact(-0.022, 0.008, -1, 0),
        contact(-0.01, -0.022, 0, -1),
        contact(0.012, -0.022, 0, -1),
    )
    assert quality(outline_of(disc, R)) > 0.9
    assert quality(outline_of(end, R)) < 0.6


@pytest.mark.parametrize(("away_m", "lost"), [(0.0, False), (0.09, False), (0.11, True), (-0.11, True)])
def test_a_trace_that_ended_on_a_neighbour_is_not_the_candidate(candidate, away_m, lost):
    """Two boxes of 90 mm x 44 mm: the circles round them, of 100 mm, meet or do not."""
    box = dataclasses.replace(candidate.contour, size_m=np.array([0.09, 0.044]))
    before = dataclasses.replace(candidate, contour=box)
    there = dataclasses.replace(box, centre_K_m=box.centre_K_m + np.array([0.6, 0.8]) * away_m)
    assert lost_among(before, dataclasses.replace(before, contour=there), ()) == lost


def test_a_trace_that_became_one_with_a_neighbour_is_not_the_candidate():
    """A part inside the neighbour's envelope is another matter: it is the neighbour."""
    neighbour = disc_of_40_mm()
    strayed = dataclasses.replace(neighbour, index=1)
    beside = outline_of(ring(0.045, 0.0, 0.02, [0.0, 90.0, 180.0, 270.0]), R).contour
    assert lost_among(dataclasses.replace(strayed, contour=beside), strayed, (neighbour,))
    assert not lost_among(dataclasses.replace(strayed, contour=beside), strayed, ())
    part = outline_of(ring(0.010, 0.0, 0.01, [0.0, 90.0, 180.0, 270.0]), R).contour
    assert not lost_among(dataclasses.replace(strayed, contour=part), strayed, (neighbour,))


@pytest.mark.parametrize(
    ("new", "another"),
    [
        (ring(0.070, 0.0, 0.03, [180.0]), True),  # on the neighbour, in the gap of 10 mm
        (ring(0.070, 0.0, 0.03, [150.0]), True),
        (ring(0.0, 0.0, 0.03, [0.0]), False),  # on the disc itself, in the gap
        (ring(0.0, 0.0, 0.03, [30.0]), False),
        (ring(0.0, 0.0, 0.03, [200.0]), False),  # on its far side
    ],
    ids=["neighbour", "neighbour, aside", "itself", "itself, aside", "itself, far side"],
)
def test_a_contact_in_the_gap_between_two_discs_belongs_to_the_one_that_was_met(new, another):
    """Discs of 60 mm about (0, 0) and (70, 0) mm; neither was touched in the gap before."""
    contacts = ring(0.070, 0.0, 0.03, [250.0, 290.0, 0.0, 70.0, 110.0])
    outline = outline_of(contacts, R)
    neighbour = Candidate(1, outline.contour, 0.018, quality(outline), contacts)
    mine = ring(0.0, 0.0, 0.03, [60.0, 120.0, 180.0, 240.0, 300.0])
    assert of_another((neighbour,), R, mine, new[0]) == another
    assert not of_another((), R, mine, new[0])
    hardly_known = dataclasses.replace(neighbour, quality=0.2)
    assert not of_another((hardly_known,), R, mine, new[0]), "it may be a part of the same disc"


def test_a_contact_at_the_unknown_end_of_a_box_belongs_to_the_box():
    """The end lies 15 mm beyond all contacts of the box; the traced disc, of 60 mm, stands 20 mm beyond the end."""
    contacts = (*half_a_box(), contact(0.025, 0.022, 0, 1), contact(0.025, -0.022, 0, -1))
    outline = outline_of(contacts, R)
    box = Candidate(1, outline.contour, 0.018, 0.4, contacts)
    mine = ring(0.09, 0.0, 0.03, [0.0, 60.0, 120.0, 240.0, 300.0])
    assert of_another((box,), R, mine, contact(0.04, 0.005, 1, 0))
    assert not of_another((box,), R, mine, ring(0.09, 0.0, 0.03, [180.0])[0])


def test_only_the_hull_of_an_uncertain_candidate_is_kept_free_of_sweeps(candidate):
    """Five contacts on one end leave the other end open: nothing tells that it is the box's."""
    belief = SearchMap.blank((0.2, 0.15), expected=2)
    traced = OutlineTrace(candidate.contacts, outline_of(candidate.contacts, R), np.zeros(2), np.zeros((0, 2)))
    admitted = admit(belief, (), candidate.contacts[0], traced, 0.018, 0.01)
    assert admitted.candidates[0].quality < KNOWN_QUALITY
    points = np.array([[0.0, 0.0], [0.022, 0.0]])  # between the contacts, and 12 mm beyond them
    assert (signed_distance(admitted.candidates[0].contour, points) < 0.01).all(), "the margin of the outline has both"
    np.testing.assert_array_equal(admitted.belief.inside_exclusion(points), [True, False])
    certain = (*candidate.contacts, contact(0.04, 0.015, 1, 0), contact(0.04, -0.015, 1, 0))
    traced = OutlineTrace(certain, outline_of(certain, R), np.zeros(2), np.zeros((0, 2)))
    admitted = admit(belief, (), certain[0], traced, 0.018, 0.01)
    np.testing.assert_array_equal(admitted.belief.inside_exclusion(points), [True, True])
