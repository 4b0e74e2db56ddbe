"""Gates of a decision."""

import math

import pytest

from glotouch_bt.perception.recognition import Gates, Match, rank
from glotouch_bt.robot import ParamError


def m(index: int, loss: float, evidence: float = 10.0) -> Match:
    return Match(index, loss, {}, None, (0.0, 0.0, 0.0), evidence)


def test_order_margin_and_acceptance() -> None:
    r = rank([m(0, 1.4), m(1, 0.3), m(2, 0.9)])
    assert [x.index for x in r.matches] == [1, 2, 0]
    assert r.best.index == 1
    assert r.margin == pytest.approx(0.6)
    assert r.accepted
    assert r.reasons == ()


@pytest.mark.parametrize(
    ("matches", "word"),
    [
        ([m(0, 0.30), m(1, 0.31)], "margin"),
        ([m(0, 5.0), m(1, 9.0)], "none fits"),
        ([m(0, 0.3, 1.0), m(1, 2.0)], "evidence"),
        ([m(0, math.inf, 0.0), m(1, math.inf, 0.0)], "no evidence"),
    ],
)
def test_each_gate_rejects_with_its_reason(matches, word) -> None:
    r = rank(matches)
    assert not r.accepted
    assert len(r.reasons) == 1
    assert word in r.reasons[0]


def test_an_untouched_rival_does_not_count_as_margin() -> None:
    """A candidate nobody felt may be the target: its infinite loss is no proof against it."""
    r = rank([m(0, 0.3), m(1, math.inf, 0.0)])
    assert r.best.index == 0
    assert math.isinf(r.margin)


def test_ties_are_broken_by_index_and_are_not_accepted() -> None:
    r = rank([m(3, 0.5), m(1, 0.5)])
    assert r.best.index == 1
    assert not r.accepted


def test_single_candidate_is_judged_on_fit_and_evidence() -> None:
    assert rank([m(0, 0.3)]).accepted
    assert not rank([m(0, 9.0)]).accepted


def test_nothing_to_rank() -> None:
    with pytest.raises(ParamError):
        rank([])
    with pytest.raises(ParamError):
        Gates(loss=float("nan"))
