"""Contacts of the ball compared with a target's section, on solids whose outline is known in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

from glotouch_bt.perception import joined
from glotouch_bt.perception.recognition import PadSpec, TargetModel, gain_of_one
from glotouch_bt.perception.recognition.likelihood import LikelihoodParams
from glotouch_bt.perception.recognition.likelihood.contacts import SectionFit, are_of_ball, section_fits
from glotouch_bt.perception.search import outline_of
from glotouch_bt.perception.touch import Candidate, Contact
from glotouch_bt.robot import Array
from tests.perception.recognition.conftest import box, cylinder

BALL_M, P = 0.006, LikelihoodParams()
HALF = np.array([0.045, 0.02])


def contact(point: Array, normal: Array, pose: tuple[float, float, float], stamp_s: float) -> Contact:
    """Return the contact of the ball with a point (2,) of the object, both in its frame, in a pose in K."""
    x, y, yaw = pose
    turn = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
    at, out = turn @ point + [x, y], turn @ normal
    tip, reaction = np.array([*(at + BALL_M * out), 0.018]), np.array([*out, 0.0])
    return Contact(stamp_s, tip, -reaction, reaction, at, 0.3)


def box_contacts(pose: tuple[float, float, float], n: int = 12, sd_m: float = 3e-4) -> tuple[Contact, ...]:
    """Return contacts all round a box of 90 mm x 40 mm, with scatter."""
    rng = np.random.default_rng(3)
    around = []
    for i in range(n):
        side, along = i % 4, rng.uniform(-0.85, 0.85)
        axis = side % 2
        normal = np.zeros(2)
        normal[axis] = 1.0 if side < 2 else -1.0
        point = normal * HALF[axis]
        point[1 - axis] = along * HALF[1 - axis]
        around.append(contact(point + rng.normal(0.0, sd_m, 2), normal, pose, float(i)))
    return tuple(around)


def candidate(contacts: tuple[Contact, ...], index: int = 0) -> Candidate:
    outline = outline_of(contacts, BALL_M)
    return Candidate(index, outline.contour, 0.018, 0.5, contacts, False)


@pytest.fixture(scope="module")
def bar() -> TargetModel:
    return TargetModel.from_mesh(box(0.09, 0.04, 0.05), PadSpec())


def section_fit(model: TargetModel, of: Candidate) -> SectionFit | None:
    return section_fits([model], of)[0]


@pytest.mark.parametrize("pose", [(0.0, 0.0, 0.0), (0.05, -0.08, 1.1), (-0.1, 0.02, -2.5)])
def test_the_pose_is_that_of_the_object(bar: TargetModel, pose: tuple[float, float, float]) -> None:
    fit = section_fit(bar, candidate(box_contacts(pose)))
    assert fit is not None
    x, y, yaw = fit.pose_K[int(np.argmax(fit.log_weight))]
    assert math.hypot(x - pose[0], y - pose[1]) < 1e-3
    assert abs(math.remainder(yaw - pose[2], math.pi)) < math.radians(2.0)  # half a turn of a box feels the same


def test_the_own_section_explains_contacts_and_another_one_does_not(bar: TargetModel) -> None:
    contacts = box_contacts((0.02, 0.03, 0.7))
    own = section_fit(bar, candidate(contacts))
    narrow = section_fit(TargetModel.from_mesh(box(0.09, 0.055, 0.05), PadSpec()), candidate(contacts))
    round_one = section_fit(TargetModel.from_mesh(cylinder(0.03, 0.05), PadSpec()), candidate(contacts))
    assert own is not None
    assert narrow is not None
    assert round_one is not None
    assert own.log_ratio > 0.0 > narrow.log_ratio > round_one.log_ratio
    assert own.term(P) > 0.0
    assert round_one.term(P) == pytest.approx(math.log(P.trace_outlier), abs=0.1)  # a wrong trace says no more


def test_sections_compared_together_give_what_each_gives_alone(bar: TargetModel) -> None:
    models = [
        bar,
        TargetModel.from_mesh(cylinder(0.03, 0.05), PadSpec()),
        TargetModel.from_mesh(box(0.09, 0.055, 0.05), PadSpec()),
    ]
    of = candidate(box_contacts((0.02, 0.03, 0.7)))
    together = section_fits(models, of)
    alone = [section_fit(m, candidate(of.contacts)) for m in models]
    assert [f.log_ratio for f in together] == pytest.approx([f.log_ratio for f in alone], abs=1e-6)


def test_a_ratio_does_not_depend_on_where_the_object_stands(bar: TargetModel) -> None:
    fits = [section_fit(bar, candidate(box_contacts(pose))) for pose in ((0.0, 0.0, 0.0), (0.11, -0.07, 2.2))]
    assert abs(fits[0].log_ratio - fits[1].log_ratio) < 1.5


def test_the_yaws_prior_is_a_distribution_about_the_pose(bar: TargetModel) -> None:
    fit = section_fit(bar, candidate(box_contacts((0.0, 0.0, 0.5))))
    yaws = np.arange(72) * (2 * np.pi / 72)
    weight = fit.yaw_weight(yaws, P)
    assert weight.sum() == pytest.approx(1.0)
    assert abs(math.remainder(yaws[int(np.argmax(weight))] - 0.5, math.pi)) < math.radians(5.0)


def test_few_contacts_and_those_of_another_section_are_not_compared(bar: TargetModel) -> None:
    contacts = box_contacts((0.0, 0.0, 0.0))
    assert not are_of_ball(contacts[:2])
    fingers = tuple(Contact(c.stamp_s, c.tip_K_m, c.approach_K, c.reaction_K, c.point_K_m * 0.5, 0.3) for c in contacts)
    assert not are_of_ball(fingers)
    assert section_fit(bar, candidate(contacts[:2])) is None


def test_two_halves_of_the_target_are_joined_and_a_neighbour_is_not(bar: TargetModel) -> None:
    whole = box_contacts((0.0, 0.0, 0.0), 16)
    left = candidate(tuple(c for c in whole if c.point_K_m[0] < 0.0), 0)
    right = candidate(tuple(c for c in whole if c.point_K_m[0] >= 0.0), 1)
    beside = candidate(box_contacts((0.0, 0.06, 0.0), 8), 2)
    assert gain_of_one(bar, left, right) > 3.0
    assert gain_of_one(bar, candidate(whole, 0), beside) < 0.0
    kept = joined(bar, (left, right, beside))
    assert [c.index for c in kept if c.index != 2] in ([0], [1])
    assert sum(len(c.contacts) for c in kept) == len(whole) + len(beside.contacts)
