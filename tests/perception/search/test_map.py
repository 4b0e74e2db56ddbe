import dataclasses

import numpy as np
import pytest

from glotouch_bt.perception.search import SearchMap
from glotouch_bt.perception.touch import Candidate, Contact, Contour
from glotouch_bt.robot import ParamError
from tests.support.swept_area import covered_fraction

DISC = Contour("round", np.array([0.05, 0.0]), (0.06, 0.06), 0.0, 0.0, np.zeros(0))


def blank():
    return SearchMap.blank((0.188, 0.138), expected=2)


def test_path_is_resampled_to_two_millimetres():
    line = np.column_stack([np.linspace(-0.1, 0.1, 1501), np.zeros(1501), np.full(1501, 0.02)])
    for belief in (blank().with_path(line), blank().with_path(line[[0, -1]])):
        steps = np.linalg.norm(np.diff(belief.path_K_m, axis=0), axis=1)
        assert len(belief.path_K_m) == 101
        np.testing.assert_allclose(steps, 0.002, atol=1e-6)


def test_path_goes_on_without_repeating_itself():
    belief = blank()
    for i in range(200):
        belief = belief.with_path(np.array([[4e-4 * i, 0.0], [4e-4 * (i + 1), 0.0]]))
    steps = np.linalg.norm(np.diff(belief.path_K_m, axis=0), axis=1)
    assert steps.min() > 0.0019
    assert steps.max() < 0.0025
    assert belief.with_path(np.zeros((0, 2))) is belief
    assert len(belief.with_path(belief.path_K_m[-1:]).path_K_m) == len(belief.path_K_m)


def test_values_are_frozen_and_old_maps_stay():
    first = blank()
    second = first.with_path([[0.0, 0.0], [0.1, 0.0]]).with_exclusion(DISC, 0.01).with_dropped([0.1, 0.1])
    assert (len(first.path_K_m), first.found, len(first.dropped)) == (0, 0, 0)
    assert (second.found, len(second.dropped), second.complete) == (1, 1, False)
    assert second.with_exclusion(DISC, 0.01).complete
    with pytest.raises(ValueError, match="read-only"):
        second.path_K_m[0] = 1.0


def test_exclusion_is_the_inflated_outline():
    belief = blank().with_exclusion(DISC, 0.01)
    points = np.array([[0.05, 0.0], [0.05, 0.0399], [0.05, 0.0401], [-0.1, 0.0]])
    np.testing.assert_array_equal(belief.inside_exclusion(points), [True, True, False, False])
    limbs = Contour("round", DISC.centre_K_m, DISC.size_m, 0.0, 0.003, np.array([0.004, -0.002, 0.0]))
    np.testing.assert_array_equal(blank().with_exclusion(limbs, 0.01).inside_exclusion(points), [1, 1, 1, 0])


def test_a_kept_map_has_the_present_outlines():
    """A coarse outline of 60 mm was refined to 40 mm: beside it, something may be hidden. The other one is gone."""
    belief = blank().with_exclusion(DISC, 0.01, 3)
    belief = belief.with_exclusion(dataclasses.replace(DISC, centre_K_m=np.array([-0.1, 0.0])), 0.01, 5)
    a = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    out = np.column_stack([np.cos(a), np.sin(a)])
    contacts = tuple(
        Contact(0.0, np.array([*(DISC.centre_K_m + 0.026 * n), 0.018]), np.array([*-n, 0.0]), np.array([*n, 0.0]),
                DISC.centre_K_m + 0.02 * n, 1.0)
        for n in out
    )  # fmt: skip
    refined = Candidate(3, dataclasses.replace(DISC, size_m=(0.04, 0.04)), 0.06, 1.0, contacts)
    now = belief.only_with((refined,))
    assert [(e.index, e.given_margin_m) for e in now.exclusions] == [(3, pytest.approx(0.01))]
    points = np.array([[0.05, 0.0], [0.05, 0.029], [0.05, 0.031], [-0.1, 0.0]])
    np.testing.assert_array_equal(belief.inside_exclusion(points), [True, True, True, True])
    np.testing.assert_array_equal(now.inside_exclusion(points), [True, True, False, False])
    assert now.first_index == 6, "no new candidate gets the index of the one that is gone"


def test_covered_fraction_of_one_stripe():
    """A stripe of half width r along the whole length covers r / half of the region."""
    belief = blank().with_path([[-0.188, 0.0], [0.188, 0.0]])
    assert covered_fraction(belief, 0.046) == pytest.approx(0.046 / 0.138, abs=0.03)
    assert covered_fraction(blank(), 0.05) == 0.0
    everything = Contour("box", np.zeros(2), (0.5, 0.5), 0.0, 0.0, np.zeros(0))
    assert covered_fraction(blank().with_exclusion(everything, 0.0), 0.01) == 1.0


def test_bad_values_are_refused():
    with pytest.raises(ParamError, match="half_extent_m"):
        SearchMap.blank((0.1, 0.0), 1)
    with pytest.raises(ParamError, match="expected"):
        SearchMap.blank((0.1, 0.1), 0)
    with pytest.raises(ParamError, match="margin_m"):
        blank().with_exclusion(DISC, -1.0)
    with pytest.raises(ParamError, match="points_K_m"):
        blank().with_path([[np.nan, 0.0]])


def test_an_obstacle_is_kept_clear_of_and_is_no_object():
    belief = blank().with_obstacle([0.05, 0.02], 0.012)
    points = np.array([[0.05, 0.02], [0.05, 0.0319], [0.05, 0.0321]])
    np.testing.assert_array_equal(belief.inside_exclusion(points), [True, True, False])
    np.testing.assert_allclose(belief.clearance(points), [-0.012, -0.0001, 0.0001], atol=1e-9)
    assert (belief.found, belief.complete) == (0, False)
    for radius in (0.0, -0.01, np.nan, np.inf):
        with pytest.raises(ParamError, match="radius_m"):
            blank().with_obstacle([0.0, 0.0], radius)


def test_hints_are_those_given_last():
    up = np.array([0.0, 0.0, 1.0])
    one, two = (Contact(t, np.zeros(3), -up, up, np.zeros(2), 1.0) for t in (1.0, 2.0))
    belief = blank().with_hints((one,))
    assert belief.with_path([[0.0, 0.0]]).hints == (one,)
    assert belief.with_hints((two, one)).hints == (two, one)
    assert belief.hints == (one,)


def test_a_surface_that_faces_a_traced_object_is_not_that_objects():
    disc = Contour("round", np.zeros(2), (0.06, 0.06), 0.0, 0.0, np.zeros(0))
    known = SearchMap.blank((0.2, 0.15), expected=2).with_exclusion(disc, 0.01)

    def contact(x, push):
        tip = np.array([x, 0.0, 0.018])
        return Contact(0.0, tip, np.array([-push, 0.0, 0.0]), np.array([push, 0.0, 0.0]), tip[:2], 1.0)

    assert known.knows(contact(0.038, 1.0))
    assert known.knows(contact(0.044, 1.0))
    assert not known.knows(contact(0.050, 1.0))
    assert not known.knows(contact(0.038, -1.0))
    assert not known.with_obstacle((0.1, 0.0), 0.012).knows(contact(0.1, 1.0))


def test_an_unknown_number_is_complete_when_hardly_anything_can_be_left():
    belief = SearchMap.blank((0.188, 0.138), expected=None, left_below=0.2)
    assert not belief.complete
    assert not belief.with_exclusion(DISC, 0.01).complete
    rows = np.arange(-0.138, 0.139, 0.012)
    x = np.tile([-0.188, 0.188, 0.188, -0.188], len(rows))[: 2 * len(rows)]
    swept = belief.with_path(np.column_stack([x, np.repeat(rows, 2)]))
    assert swept.chance_left < 0.2
    assert swept.complete
    up = np.array([0.0, 0.0, 1.0])
    hint = Contact(0.0, np.zeros(3), -up, up, np.zeros(2), 1.0)
    assert not swept.with_hints((hint,)).complete, "what a hint belongs to is left"
    assert np.isnan(blank().chance_left)
    for left_below in (-0.1, 1.1, np.nan):
        with pytest.raises(ParamError, match="left_below"):
            SearchMap.blank((0.1, 0.1), None, left_below)


@pytest.mark.parametrize(
    ("point", "push", "wall"),
    [
        ((0.199, 0.0), (-1.0, 0.0), True),
        ((0.0, -0.1495), (0.1, 0.99), True),
        ((0.199, 0.0), (0.0, 1.0), False),  # the side of an object that touches the wall
        ((0.190, 0.0), (-1.0, 0.0), False),  # an object in front of the wall
    ],
)
def test_a_contact_is_with_a_wall_if_the_wall_is_there_and_pushes_back(point, push, wall):
    reaction = np.array([*push, 0.0])
    contact = Contact(0.0, np.zeros(3), -reaction, reaction, np.array(point), 1.0)
    assert SearchMap.blank((0.188, 0.138), 2, interior_m=(0.4, 0.3)).at_wall(contact) is wall
    assert not SearchMap.blank((0.188, 0.138), 2).at_wall(contact), "it knows no walls"


def test_a_doubtful_object_counts_once_hardly_anything_can_have_been_missed():
    found = SearchMap.blank((0.188, 0.138), expected=1).with_exclusion(DISC, 0.01)
    assert found.complete
    doubtful = found.with_doubt(0.5)
    assert doubtful.chance_missed == pytest.approx(0.5), "nothing was searched yet"
    assert not doubtful.complete
    rows = np.arange(-0.138, 0.139, 0.012)
    x = np.tile([-0.188, 0.188, 0.188, -0.188], len(rows))[: 2 * len(rows)]
    swept = doubtful.with_path(np.column_stack([x, np.repeat(rows, 2)]))
    assert not swept.complete, "the object may be a part of a candidate"
    swept = swept.with_probed(None)
    assert swept.complete
    hint = Contact(0.0, np.zeros(3), np.array([1.0, 0, 0]), np.array([-1.0, 0, 0]), np.array([0.1, 0.0]), 1.0)
    assert not swept.with_hints((hint,)).complete, "what was met may be the one that is missing"
    assert found.with_hints((hint,)).complete, "a number beyond doubt needs no hint"
