"""Intended contact ends with its block, however that ends."""

from __future__ import annotations

import pytest

from glotouch_bt.robot import UnknownName
from glotouch_skills.common.hand.clearance_rules import may_touch, neighbours


def test_taken_back_in_every_case(bench) -> None:
    arm = bench().arm
    with may_touch(arm, "tool", "floor", "holder"):
        assert ("tip", "floor") in arm.scene._allowed
        assert ("shaft", "holder") in arm.scene._allowed
    assert not arm.scene._allowed
    with pytest.raises(ZeroDivisionError), may_touch(arm, "hand", "probe"):
        raise ZeroDivisionError
    assert not arm.scene._allowed

    def body():
        with may_touch(arm, "hand", "probe"):
            yield

    generator = body()
    next(generator)
    assert arm.scene._allowed
    generator.close()
    assert not arm.scene._allowed


def test_unknown_names(bench) -> None:
    with pytest.raises(UnknownName), may_touch(bench().arm, "foot", "floor"):
        pass


def test_neighbours_are_all_others_but_those_that_overlap_deeply(found) -> None:
    """Centres 70 mm apart: beside it. 50 mm: the outlines overlap. 20 mm: one centre is inside the other outline."""
    own, beside = found.round((0.0, 0.0), 0.030, index=0), found.round((0.07, 0.0), 0.030, index=1)
    close, inside = found.round((0.0, 0.05), 0.030, index=2), found.round((-0.02, 0.0), 0.030, index=3)
    every = (own, beside, close, inside)
    assert [c.index for c in neighbours(every, 0)] == [1, 2]
    assert [c.index for c in neighbours(every, 3)] == [1, 2]
    assert [c.index for c in neighbours(every, 9)] == [0, 1, 2, 3]
