"""Replayed closures: what is shown when, and when it is enough."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from glotouch_bt.bench.match import closures
from glotouch_bt.bench.match.closures import closures_to_confidence, in_turn, partial, recorded_closures
from glotouch_bt.perception.recognition import Match, Ranking
from tests.bench.match.conftest import a_layout, by_size


def test_closures_in_the_order_they_were_made():
    whole = [t.touchset for t in a_layout(layers=(2, 1)).touched]
    places = [(s.candidate, s.sequence, s.layer) for s in recorded_closures(whole)]
    assert places[:4] == [(0, 0, 0), (0, 0, 1), (0, 1, 0), (1, 0, 0)]
    assert len(places) == 9


def test_a_part_of_a_touchset_keeps_layers_in_their_sequences():
    whole = a_layout(layers=(3, 2)).touched[0].touchset
    every = recorded_closures([whole])
    assert [len(s.layers) for s in partial(whole, every).sequences] == [3, 2]
    some = partial(whole, [every[4], every[2], every[0]])
    heights = [[layer.height_m for layer in s.layers] for s in some.sequences]
    assert heights == [pytest.approx([0.02, 0.04]), pytest.approx([0.03])]
    assert some.sequences[1].yaw_rad == whole.sequences[1].yaw_rad
    assert partial(whole, []).sequences == ()
    assert some.candidate is whole.candidate


def test_in_turn_goes_round_the_candidates():
    whole = [t.touchset for t in a_layout(layers=(2, 1)).touched]
    left = recorded_closures(whole)
    order = []
    while left:
        order.append(left.pop(in_turn(left, whole, None)))
    assert [s.candidate for s in order] == [0, 1, 2] * 3
    assert [s.layer for s in order if s.candidate == 0] == [0, 1, 0]


def surely_after(n):
    """Accepts the nearest in size, with P = .96, once that candidate has `n` layers."""

    def matcher(model, touchsets):
        ranking = by_size(model, touchsets)
        felt = {t.candidate.index: len(t.layers) for t in touchsets}
        enough = felt[ranking.best.index] >= n
        best = Match(ranking.best.index, 0.0, {}, None, (0, 0, 0), 3.0, probability=0.96 if enough else 0.9)
        return Ranking((best, *ranking.matches[1:]), 1.0, True, (), 0.0)

    return matcher


def believing(monkeypatch, matcher):
    monkeypatch.setattr(closures, "infer_belief", lambda *known, **_: SimpleNamespace(ranking=matcher(*known)))


def test_how_many_until_sure(made_up, monkeypatch):
    """Objects have 3 closures each and 2 of the right one are enough: the last of three is reached after 6."""
    monkeypatch.setattr(
        closures, "expected_gain", lambda belief, options: np.array([-abs(o.candidate - 2) for o in options])
    )
    believing(monkeypatch, surely_after(2))
    rows = closures_to_confidence(a_layout(layers=(2, 1)), made_up)
    gone = [r for r in rows if not r["present"]]
    rows = [r for r in rows if r["present"]]
    assert [(r["recorded"], r["confident"], r["right"]) for r in gone] == [(6, True, False)] * 9, "two objects are left"
    by = {(r["order"], r["target"]): r for r in rows}
    assert [by["recorded", n]["closures"] for n in ("small", "middle", "large")] == [2, 5, 8]
    assert [by["in_turn", n]["closures"] for n in ("small", "middle", "large")] == [4, 5, 6]
    assert by["adaptive", "large"]["closures"] == 2
    assert all(r["confident"] and r["right"] and r["recorded"] == 9 for r in rows)


def test_never_sure_counts_every_closure(made_up, monkeypatch):
    monkeypatch.setattr(closures, "expected_gain", lambda belief, options: np.zeros(len(options)))
    believing(monkeypatch, surely_after(math.inf))
    rows = closures_to_confidence(a_layout(layers=(1,)), {"small": made_up["small"]})
    told = {(r["present"], r["closures"], r["confident"], r["right"]) for r in rows}
    assert told == {(True, 3, False, True), (False, 2, False, False)}
