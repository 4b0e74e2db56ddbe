"""From the evidence of all candidates to probabilities and a decision.

Given which candidate is the target, the others are some other objects; so the posterior odds of candidate i against
"none of these" are its prior odds times its own ratio target : background, and all of them with "none" sum to 1.

"None of these" is either that all are some other objects, or that one of them is made much like the target. Such a
look-alike feels like the target until a closure meets a part in which they differ: n layers miss it with probability
exp(-look_alike_rate n). So a few layers cannot prove much, however well they fit; which candidate it is that fits best
is not blurred by that.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from glotouch_bt.recognition.decision import Match, Ranking
from glotouch_bt.recognition.likelihood.pair import Pair
from glotouch_bt.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.robot import Array, ParamError


def probabilities(log_ratios: Sequence[float], layers: Sequence[float], p: LikelihoodParams) -> tuple[Array, float]:
    """(n,) probability of each candidate, and of none; candidates share what the prior leaves equally.

    Args:
        log_ratios: (n,) target : some other object, nats.
        layers: (n,) two-sided layers felt on each.
        p: Priors.

    Raises:
        ParamError: No candidate.
    """
    n = len(log_ratios)
    if n == 0:
        raise ParamError("candidates", 0, "at least one")
    ratios = np.asarray(log_ratios, dtype=np.float64)
    taken_for_it = ratios - p.look_alike_rate * np.asarray(layers, dtype=np.float64)
    absent = math.log(p.prior_absent) + np.logaddexp(
        math.log1p(-p.look_alike), math.log(p.look_alike / n) + np.logaddexp.reduce(taken_for_it)
    )
    logs = np.append(math.log((1 - p.prior_absent) / n) + ratios, absent)
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    return weights[:-1], float(weights[-1])


def as_match(pair: Pair, probability: float) -> Match:
    """Loss is -log P(target | this TouchSet alone, against one other object, even odds): 0 is certain."""
    loss = float(np.logaddexp(0.0, -pair.log_ratio))
    return Match(pair.index, loss, pair.terms, pair.fit, pair.pose_K_O, pair.evidence, probability)


def decide(pairs: Sequence[Pair], p: LikelihoodParams) -> Ranking:
    """Sort by evidence; accept the best if it is probable enough and was felt by both pads often enough."""
    shares, p_absent = probabilities([x.log_ratio for x in pairs], [x.evidence for x in pairs], p)
    matches = [as_match(x, float(s)) for x, s in zip(pairs, shares, strict=True)]
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
