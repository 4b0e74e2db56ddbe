"""The next measurement of the probe has the most expected gain per second, and is on no excluded candidate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from glotouch_bt.perception.recognition import (
    ProbeOption,
    ProbeTouch,
    TargetModel,
    enough,
    excluded,
    next_probe_touch,
)
from glotouch_bt.perception.recognition.likelihood import Belief, expected_gain, infer_belief
from glotouch_bt.perception.recognition.schedule import CHANGE_S, pays_now
from glotouch_bt.perception.touch import Candidate, TouchSet
from glotouch_bt.robot import ParamError
from tests.support.acquisition import IDEAL, acquire

UNKNOWN_M = 0.018
"""Height of a candidate whose top was not touched: that of the sensing plane."""


@pytest.fixture(scope="module")
def target(solids):
    return solids.cylinder(0.030, 0.070)


@pytest.fixture(scope="module")
def model(target) -> TargetModel:
    return TargetModel.from_mesh(target)


def candidate(mesh, index: int, height_m: float | None = None, *, centre_sd_m: float = 0.0) -> Candidate:
    """Return the outline that an ideal probe traces; with `centre_sd_m`, a coarse one."""
    touchset, _ = acquire(mesh, (0.05 * index, 0.0, 0.3), IDEAL, np.random.default_rng(index), index)
    made = touchset.candidate
    if centre_sd_m:
        n = 3 if made.contour.family == "circle" else 5
        made = replace(made, contour=replace(made.contour, covariance=np.eye(n) * centre_sd_m**2))
    return made if height_m is None else replace(made, height_m=height_m)


def believed(model: TargetModel, *candidates: Candidate) -> Belief:
    return infer_belief(model, [TouchSet(c, ()) for c in candidates])


def option(index: int, part: str, seconds: float = 10.0) -> ProbeOption:
    return ProbeOption(ProbeTouch(index, part), seconds)


def test_what_the_stl_excludes_is_not_measured(solids, target, model) -> None:
    slab = candidate(solids.box(0.105, 0.040, 0.060), 1)
    belief = believed(model, candidate(target, 0), slab)
    assert excluded(belief) == {1}
    assert next_probe_touch(belief, [option(1, "top"), option(1, "outline")]) is None
    chosen = next_probe_touch(belief, [option(1, "top", 0.1), option(0, "top")])
    assert chosen is not None
    assert chosen.touch.candidate == 0


def test_the_likeliest_is_never_excluded(solids, model) -> None:
    """Although it is nothing like the target: outlines alone do not prove that the target is absent."""
    belief = believed(model, candidate(solids.box(0.105, 0.040, 0.105), 0), candidate(solids.box(0.11, 0.03, 0.105), 1))
    assert len(excluded(belief)) <= 1


@pytest.mark.parametrize("sd_m", [0.002, 0.006])
def test_a_coarse_outline_excludes_less(solids, target, model, sd_m: float) -> None:
    wide = solids.cylinder(0.036, 0.070)
    sharp = believed(model, candidate(target, 0, UNKNOWN_M), candidate(wide, 1, UNKNOWN_M))
    coarse = believed(
        model, candidate(target, 0, UNKNOWN_M, centre_sd_m=sd_m), candidate(wide, 1, UNKNOWN_M, centre_sd_m=sd_m)
    )
    share = {b: {m.index: m.probability for m in b.ranking.matches}[1] for b in (sharp, coarse)}
    assert share[coarse] > share[sharp]


def test_two_equal_outlines_are_told_apart_by_their_tops(solids, target, model) -> None:
    coarse = candidate(target, 0, UNKNOWN_M), candidate(solids.cylinder(0.030, 0.095), 1, UNKNOWN_M)
    belief = believed(model, *coarse)
    gains = expected_gain(belief, [ProbeTouch(0, "top"), ProbeTouch(0, "outline")])
    assert gains[0] > 10 * gains[1], "the outline is known already"
    after = believed(model, replace(coarse[0], height_m=0.070), replace(coarse[1], height_m=0.095))
    assert excluded(after) == {1}


def test_the_gain_is_what_the_entropy_loses_on_average(target, model) -> None:
    """Against a simulation: heights drawn by the likelihood's own assumptions, the belief inferred anew each time."""
    rng = np.random.default_rng(4)
    start = [candidate(target, i, UNKNOWN_M) for i in range(3)]
    before = believed(model, *start)

    def entropy(belief: Belief) -> float:
        p = np.array([*(m.probability for m in belief.ranking.matches), belief.ranking.p_absent])
        return float(-(p * np.log(p)).sum())

    share = {m.index: m.probability for m in before.ranking.matches}[0]
    left = []
    for _ in range(400):
        there = rng.random() < share
        lower = rng.random() < before.params.height_lower
        top = model.height_m * (rng.uniform(0.5, 0.9) if lower else 1.0) + rng.normal(0, before.params.height_sd_m)
        height = top if there else rng.uniform(0.018, 0.115)
        left.append(entropy(believed(model, replace(start[0], height_m=max(height, 0.022)), *start[1:])))
    gain = float(expected_gain(before, [ProbeTouch(0, "top")])[0])
    assert entropy(before) - np.mean(left) == pytest.approx(gain, rel=0.3)


def test_an_outline_is_worth_the_top_that_it_makes_possible(solids, target, model) -> None:
    """Both outlines are known well, so another trace tells nothing; but only then the top may be touched."""
    belief = believed(model, candidate(target, 0, UNKNOWN_M), candidate(solids.cylinder(0.033, 0.070), 1, UNKNOWN_M))
    then = replace(option(0, "outline"), then=ProbeTouch(0, "top"), more_s=10.0)
    chosen = next_probe_touch(belief, [then, option(1, "outline")])
    assert chosen is not None
    assert (chosen.touch.candidate, chosen.touch.part) == (0, "outline")


@pytest.mark.parametrize("seconds", [2.0, 10.0, 50.0, 200.0])
def test_what_is_probably_not_needed_is_put_off(target, model, seconds: float) -> None:
    """Against the expected time of both orders, if the target is one of the two."""
    belief = believed(model, candidate(target, 0), candidate(target, 1, UNKNOWN_M))
    share = {m.index: m.probability for m in belief.ranking.matches}
    now_s = (share[0] + share[1]) * seconds
    later_s = share[1] * (CHANGE_S + seconds)
    assert pays_now(belief, option(1, "top", seconds), {1}) == (now_s <= later_s)
    assert pays_now(belief, option(0, "top", seconds), {0, 1}), "the likeliest one"
    assert pays_now(belief, option(1, "top", seconds), {0, 1}) == (now_s <= later_s), "the likeliest one comes first"


def test_nothing_is_put_off_twice(target, model) -> None:
    """Once the jaws have been used in vain, waiting would only cost one more change of tool."""
    belief = believed(model, candidate(target, 0), candidate(target, 1, UNKNOWN_M))
    slow = option(1, "top", 200.0)
    assert next_probe_touch(belief, [slow]) is None
    chosen = next_probe_touch(belief, [slow], can_wait=False)
    assert chosen is not None
    assert chosen.touch.candidate == 1


def test_time_counts(target, model) -> None:
    belief = believed(model, candidate(target, 0, UNKNOWN_M), candidate(target, 1, UNKNOWN_M))
    chosen = next_probe_touch(belief, [option(0, "top", 20.0), option(1, "top", 10.0)])
    assert chosen is not None
    assert (chosen.touch.candidate, chosen.touch.gain_nats > 0) == (1, True)


def test_an_unknown_candidate_is_an_error(target, model) -> None:
    with pytest.raises(ParamError, match=r"touch\.candidate"):
        expected_gain(believed(model, candidate(target, 0)), [ProbeTouch(5, "top")])


@pytest.mark.parametrize(
    ("target_p", "rival_p", "absent_p", "sure"),
    [
        (0.975, 0.010, 0.015, True),
        (0.968, 0.005, 0.027, True),  # known which one, and almost surely there
        (0.955, 0.005, 0.040, False),  # perhaps none of them
        (0.960, 0.035, 0.005, False),  # perhaps the other one
    ],
)
def test_which_one_and_whether_any_are_separate_questions(model, target, target_p, rival_p, absent_p, sure) -> None:
    belief = believed(model, candidate(target, 0), candidate(target, 1))
    given = zip(belief.ranking.matches, (target_p, rival_p), strict=True)
    matches = tuple(replace(m, probability=p, evidence=2.0) for m, p in given)
    belief = replace(belief, ranking=replace(belief.ranking, matches=matches, p_absent=absent_p))
    assert bool(enough(belief, 0.97, frozenset())) is sure
