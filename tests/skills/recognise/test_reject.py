"""reject: what is left of what is known once an object was taken in vain."""

from __future__ import annotations

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_bt.perception.touch import TouchSet
from glotouch_skills.common.planning.grasp_plan import GraspPlan
from glotouch_skills.recognise.reject import Reject


def plan(index: int) -> GraspPlan:
    return GraspPlan(index, np.array([0.0, 0.0, 0.03]), 0.0, 0.05, 0.07)


@pytest.fixture
def touchsets(found):
    return tuple(TouchSet(found.round((0.05 * i, 0.0), 0.02, index=i), ()) for i in range(3))


def rejected(bench, touchsets, index: int, impossible: bool, **before):
    b = bench()
    given = {"made": plan(index), "impossible": impossible, "felt": touchsets, **before}
    skill = b.make(Reject, inputs=given)
    b.run(skill)
    return skill


def test_what_cannot_be_it_is_left_alone(bench, touchsets) -> None:
    skill = rejected(bench, touchsets, 1, True)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert [t.candidate.index for t in skill.touchsets] == [0, 2]
    assert (skill.rejected, skill.doubted) == ((1,), (1,))


def test_what_was_not_as_felt_may_be_touched_once_more(bench, touchsets) -> None:
    first = rejected(bench, touchsets, 1, False)
    assert (first.rejected, first.doubted) == ((), (1,))
    again = rejected(bench, touchsets, 1, False, before_doubted=first.doubted, before_rejected=first.rejected)
    assert (again.status, again.rejected) == (Status.SUCCESS, (1,))


def test_reject__wrong_object__too_many_in_vain(bench, touchsets) -> None:
    skill = rejected(bench, touchsets, 2, True, before_doubted=(0, 1), before_rejected=(0, 1))
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "wrong_object")
    assert skill.rejected == (0, 1, 2)
