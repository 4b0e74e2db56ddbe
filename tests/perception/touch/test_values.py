"""Values of touch: where an object is after its slides."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from glotouch_bt.perception.recognition.evidence import read_evidence
from glotouch_bt.perception.recognition.model import PadSpec, hand_axes
from glotouch_bt.perception.touch import Candidate, Contact, Contour, Layer, TouchSequence, TouchSet

GEL = np.full((35, 20), 4e-4)


def layer(yaw_rad: float, slide_m: float, place_K_m: tuple[float, float] = (0.0, 0.0)) -> Layer:
    return Layer(0.03, 0.04, np.array(place_K_m), yaw_rad, GEL, GEL, 10.0, True, slide_m=slide_m, turn_rad=0.0)


def touched(*layers: Layer) -> TouchSet:
    contour = Contour("round", np.array([0.01, 0.02]), (0.05, 0.05), 0.0, 0.0, np.zeros(0))
    sequences = tuple(TouchSequence(one.position_K_m, one.yaw_rad, (one,)) for one in layers)
    return TouchSet(Candidate(0, contour, 0.05, 1.0, ()), sequences)


def test_slides_add_up_along_y_P() -> None:
    yaws, slides = (0.3, 2.0, -1.1), (0.004, math.nan, -0.006)
    slid = touched(*(layer(y, s) for y, s in zip(yaws, slides, strict=True))).slid_K_m
    y = hand_axes(np.array(yaws))[1]
    np.testing.assert_allclose(slid, [[0, 0], 0.004 * y[0], 0.004 * y[0], 0.004 * y[0] - 0.006 * y[2]], atol=1e-12)
    assert touched().slid_K_m.shape == (1, 2)


def test_a_closure_is_placed_against_the_object_where_the_slides_before_it_left_it() -> None:
    """Closed at yaw 0 it slides by 10 mm along y_P = -y; the next closure, along y, is that much off the middle."""
    closures = layer(0.0, 0.010, (0.01, 0.02)), layer(math.pi / 2, 0.0, (0.01, 0.02))
    first, second = read_evidence(touched(*closures), PadSpec()).layers
    assert abs(first.along_m) < 1e-12
    assert abs(second.along_m - 0.010) < 1e-12


def test_a_candidate_is_now_where_its_slides_left_it_since_it_was_traced() -> None:
    felt = touched(layer(0.0, 0.010), layer(math.pi / 2, 0.004))
    np.testing.assert_allclose(felt.now.contour.centre_K_m, [0.01 + 0.004, 0.02 - 0.010], atol=1e-12)
    contact = Contact(0.0, np.zeros(3), np.zeros(3), np.zeros(3), np.array([0.035, 0.02]), 1.0)
    again = felt.measured(replace(felt.candidate, contacts=(contact,)))
    np.testing.assert_allclose(again.now.contour.centre_K_m, again.candidate.contour.centre_K_m, atol=1e-12)
    np.testing.assert_allclose(again.slid_K_m[0], [-0.004, 0.010], atol=1e-12)
    higher = felt.measured(replace(felt.candidate, height_m=0.06))
    np.testing.assert_allclose(higher.slid_K_m, felt.slid_K_m)
