"""From the evidence of all candidates to probabilities and a decision.

Some other object is just any object or, with probability `twin`, a twin: one made much like the target. Given which
candidate is the target, each other one is some other object; so the posterior odds of candidate i against "none of
these" are its prior odds times its own ratio target : some other object, and all of them with "none" sum to 1. However
much speaks for the target against just any object, that ratio is at most that against a twin: it grows only with
closures that meet what a twin would differ in, and is less for a candidate that fits worse than the best of them does.
As each object may be a twin, the best of many candidates is less sure than the best of few.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from glotouch_bt.perception.recognition.decision import Match, Ranking
from glotouch_bt.perception.recognition.likelihood.pair import Pair
from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.robot import Array, ParamError


def against_others(log_ratio: float, log_twin: float, p: LikelihoodParams, missed: float = 0.0) -> float:
    """log p(TouchSet | target) - log p(TouchSet | some other object) from a `Pair`'s two ratios.

    Args:
        log_ratio, log_twin: Of the `Pair`, nats.
        p: Priors.
        missed: How much better a twin explains the TouchSet than the target does, where that is known, nats.
    """
    return log_ratio - float(np.logaddexp(math.log1p(-p.twin), math.log(p.twin) + log_ratio + log_twin + missed))


def ratios(pairs: Sequence[Pair], p: LikelihoodParams) -> list[float]:
    """Target : some other object of every candidate, nats.

    A twin fits its own closures as well as the target fits its: per layer that both pads felt, about as well as the
    best of the candidates fits the target. What a candidate falls short of that speaks for its being the twin. This
    tells two candidates apart by their images when no width can, as for an object and its mirror image.
    """
    rates = [x.log_ratio / max(x.evidence, 1.0) for x in pairs]
    level = max(rates, default=0.0)
    return [
        against_others(x.log_ratio, x.log_twin, p, p.twin_fit * max(level - rate, 0.0) * max(x.evidence, 1.0))
        for x, rate in zip(pairs, rates, strict=True)
    ]


def probabilities(log_ratios: Sequence[float], p: LikelihoodParams) -> tuple[Array, float]:
    """(n,) probability of each candidate, and of none; candidates share what the prior leaves equally.

    Args:
        log_ratios: (n,) target : some other object, nats.
        p: Priors.

    Raises:
        ParamError: No candidate.
    """
    n = len(log_ratios)
    if n == 0:
        raise ParamError("candidates", 0, "at least one")
    shared = math.log((1 - p.prior_absent) / n) + np.asarray(log_ratios, dtype=np.float64)
    logs = np.append(shared, math.log(p.prior_absent))
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    return weights[:-1], float(weights[-1])


def as_match(pair: Pair, ratio: float, probability: float) -> Match:
    """Loss is -log P(target) by the ratio target : some other object (nats) at even odds: 0 is certain."""
    loss = float(np.logaddexp(0.0, -ratio))
    terms = pair.terms | {"twin": pair.log_twin}
    return Match(pair.index, loss, terms, pair.fit, pair.pose_K_O, pair.evidence, probability)


def decide(pairs: Sequence[Pair], p: LikelihoodParams) -> Ranking:
    """Sort by evidence; accept the best if it is probable enough and was felt by both pads often enough."""
    against = ratios(pairs, p)
    shares, p_absent = probabilities(against, p)
    matches = [as_match(x, r, float(s)) for x, r, s in zip(pairs, against, shares, strict=True)]
    order = tuple(sorted(matches, key=lambda m: (-m.probability, m.loss, m.index)))
    best = order[0]
    margin = order[1].loss - best.loss if len(order) > 1 else math.inf
    if all(m.evidence == 0 for m in order):
        reason = "no evidence: no closure on any candidate was felt by a pad"
        return Ranking(order, 0.0, False, (reason,), p_absent)
    reasons: list[str] = []
    if best.probability < p.accept:
        reasons.append(
            f"candidate {best.index} is the target with probability {best.probability:.2f}, below {p.accept:g}"
            + (f"; candidate {order[1].index} with {order[1].probability:.2f}" if len(order) > 1 else "")
            + f"; none of them with {p_absent:.2f}"
        )
    if best.evidence < p.evidence:
        reasons.append(
            f"evidence {best.evidence:.2f} of candidate {best.index} is below {p.evidence:g} two-sided layers"
        )
    return Ranking(order, margin, not reasons, tuple(reasons), p_absent)
