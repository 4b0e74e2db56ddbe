"""Expected information gain of tracing a candidate's outline, or touching its top, with the probe.

As for closures (`gain`): if the candidate is the target, the measurement follows from the STL; otherwise from another
object, whose outline is as traced so far and whose height is uniform.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from glotouch_bt.perception.recognition.decision import ProbeTouch, Ranking
from glotouch_bt.perception.recognition.likelihood.gain import entropy_decrease
from glotouch_bt.perception.recognition.likelihood.pair import Pair
from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.perception.recognition.likelihood.posterior import log_ratio_to_others
from glotouch_bt.perception.recognition.likelihood.scalars import (
    HEIGHTS_M,
    contour_ratio,
    height_ratio,
    mode_ratio,
    whole_share,
)
from glotouch_bt.perception.recognition.model import TargetModel, size_variance_m2
from glotouch_bt.perception.touch import Candidate, Contour
from glotouch_bt.robot import Array

NORMAL_QUANTILES = (-1.28, -0.52, 0.0, 0.52, 1.28)
"""Quantiles .1, .3, .5, .7, .9 of the standard normal distribution."""
HEIGHT_SAMPLES = 16
"""Number of heights of another object."""
REFINED_CONTACTS = 14
"""Number of contacts after which `refine_outline` ends."""
TARGET_NATS = (0.0, 0.2, 0.6, 1.0, 1.8)
"""Quantiles .1, .3, .5, .7, .9 of what a further contact adds to the term of the contacts if the candidate is the
target, nats. Source: 108 candidates of 38 missions (`lying_five`, realistic, seeds 58360-58378), refined from 7 to 13
contacts in the mean."""
OTHER_NATS = (-0.4, -0.2, -0.1, 0.0, 0.3)
"""The same if it is another object. Source: the same candidates, each compared with the four other objects."""


def expected_probe_gains(
    candidates: Sequence[Candidate],
    pairs: Sequence[Pair],
    ranking: Ranking,
    touches: Sequence[ProbeTouch],
    p: LikelihoodParams,
) -> Array:
    """Return the gains (n,), nats, not negative, of touches on `candidates`, whose `pairs` are in the same order."""
    shares = {m.index: m.probability for m in ranking.matches}
    rest = np.array([*shares.values(), ranking.p_absent])
    entropy = float(-(rest * np.log(np.maximum(rest, 1e-300))).sum())
    known = {c.index: (c, x) for c, x in zip(candidates, pairs, strict=True)}
    out = np.zeros(len(touches))
    for i, touch in enumerate(touches):
        candidate, pair = known[touch.candidate]
        if touch.part == "top":
            now = pair.terms["height"]
            there, not_there = _tops(pair.hypothesis.model, candidate, p)
        elif pair.section is not None:
            now = pair.terms["section"]
            there, not_there = _contacts(now, candidate, p)
        else:
            now = pair.terms["mode"] + pair.terms["contour"]
            there, not_there = _outlines(pair.hypothesis.model, candidate, p)
        before = log_ratio_to_others(pair.log_ratio, pair.log_twin, p)

        def change(terms: Iterable[float], pair: Pair = pair, now: float = now, before: float = before) -> Array:
            after = (pair.log_ratio + p.slope * (t - now) for t in terms)
            return np.array([log_ratio_to_others(r, pair.log_twin, p) - before for r in after])

        weight = np.array([w for _, w in there])
        out[i] = entropy_decrease(
            change(t for t, _ in there)[None], weight / weight.sum(), change(not_there)[None], shares[touch.candidate],
            entropy,
        )[0]  # fmt: skip
    return out


def _tops(
    model: TargetModel, candidate: Candidate, p: LikelihoodParams
) -> tuple[list[tuple[float, float]], list[float]]:
    """Return (height term, weight) for the target, and height terms of other objects."""

    def term(height_m: float) -> float:
        return height_ratio(model, replace(candidate, height_m=height_m), p)

    whole = whole_share(model, candidate, p)
    top = [(term(model.height_m + z * p.height_sd_m), whole / len(NORMAL_QUANTILES)) for z in NORMAL_QUANTILES]
    parts = [(term(float(h)), (1.0 - whole) / len(model.tops_m)) for h in model.tops_m]
    return top + parts, [term(float(h)) for h in np.linspace(*HEIGHTS_M, HEIGHT_SAMPLES)]


def _contacts(now: float, candidate: Candidate, p: LikelihoodParams) -> tuple[list[tuple[float, float]], list[float]]:
    """Return (term of the contacts, weight) for the target, and these terms for other objects, after further ones."""
    more = max(REFINED_CONTACTS - len(candidate.contacts), 0)
    least = math.log(p.trace_outlier)
    there = [(max(now + more * nats, least), 1.0 / len(TARGET_NATS)) for nats in TARGET_NATS]
    return there, [max(now + more * nats, least) for nats in OTHER_NATS]


def _outlines(
    model: TargetModel, candidate: Candidate, p: LikelihoodParams
) -> tuple[list[tuple[float, float]], list[float]]:
    """Return (mode and contour terms, weight) for the target, and these terms for other objects."""
    contour = candidate.contour

    def term(traced: Contour) -> float:
        there = replace(candidate, contour=traced)
        return mode_ratio(model, there) + contour_ratio(model, there, p)

    there = []
    for kind, share in (("box", model.outline.p_box), ("round", 1.0 - model.outline.p_box)):
        of = model.outline.as_box if kind == "box" else model.outline.as_round
        for z in NORMAL_QUANTILES:
            sides = (of.size_m[0] + z * of.size_sd_m[0], of.size_m[1] + z * of.size_sd_m[1])
            there.append((term(_sized(contour, kind, sides)), share))
    sd = [math.sqrt(size_variance_m2(contour, i)) for i in range(2)]
    not_there = [
        term(_sized(contour, contour.kind, (contour.size_m[0] + a * sd[0], contour.size_m[1] + b * sd[1])))
        for a in NORMAL_QUANTILES
        for b in (NORMAL_QUANTILES if contour.family != "circle" else (a,))
    ]
    return there, not_there


def _sized(contour: Contour, kind: str, size_m: tuple[float, float]) -> Contour:
    """Return a well-known outline of that kind and size."""
    box = kind == "box"
    sides = (max(size_m[0], 1e-3), max(size_m[1], 1e-3))
    if not box:
        sides = (sides[0], sides[0])
    return Contour(
        "box" if box else "round", contour.centre_K_m, sides, contour.yaw_rad if box else 0.0, 0.0, np.zeros(0)
    )
