"""Posterior probabilities of all candidates, and the decision.

Another object is random or, with probability `twin`, a twin: similar to the target. The posterior odds of candidate i
against "none" are its prior odds times its ratio target : other object. This ratio is bounded by that against a twin,
which grows only with closures where a twin would differ, and is smaller for a candidate that fits worse than the best.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from glotouch_bt.perception.recognition.decision import Match, Ranking
from glotouch_bt.perception.recognition.likelihood.pair import Pair
from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.robot import Array, ParamError


def log_ratio_to_others(log_ratio: float, log_twin: float, p: LikelihoodParams, missed: float = 0.0) -> float:
    """Compute log p(TouchSet | target) - log p(TouchSet | other object) from the two ratios of a `Pair`.

    Args:
        log_ratio, log_twin: Ratios of the `Pair`, nats.
        p: Priors.
        missed: Additional log likelihood of a twin, nats, if known.
    """
    return log_ratio - float(np.logaddexp(math.log1p(-p.twin), math.log(p.twin) + log_ratio + log_twin + missed))


def ratios(pairs: Sequence[Pair], p: LikelihoodParams) -> list[float]:
    """Return the log ratios target : other object of all candidates, nats.

    A twin would fit its own closures as well as the best candidate fits the target, per two-sided layer. A worse fit is
    evidence for the twin. This separates candidates by images where widths cannot, e.g. mirror images.
    """
    level = max((x.log_ratio / max(x.evidence, 1.0) for x in pairs if x.evidence > 0), default=0.0)

    def missed(x: Pair) -> float:
        """Return what a twin would fit better; nothing without closures, which outlines cannot be compared with."""
        if x.evidence == 0:
            return 0.0
        layers = max(x.evidence, 1.0)
        return p.twin_fit * max(level - x.log_ratio / layers, 0.0) * layers

    return [log_ratio_to_others(x.log_ratio, x.log_twin, p, missed(x)) for x in pairs]


def probabilities(log_ratios: Sequence[float], p: LikelihoodParams) -> tuple[Array, float]:
    """Return the probability (n,) of each candidate, and of none; the prior is uniform over candidates.

    Args:
        log_ratios: (n,) target : other object, nats.
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
    """Build a Match; its loss is -log P(target) at even prior odds, 0 for certainty."""
    loss = float(np.logaddexp(0.0, -ratio))
    terms = pair.terms | {"twin": pair.log_twin}
    return Match(pair.index, loss, terms, pair.fit, pair.pose_K_O, pair.evidence, probability, pair.hypothesis.quat)


def decide(pairs: Sequence[Pair], p: LikelihoodParams) -> Ranking:
    """Rank by probability; accept the best if its probability suffices and it was felt, so that its pose is known."""
    against = ratios(pairs, p)
    shares, p_absent = probabilities(against, p)
    matches = [as_match(x, r, float(s)) for x, r, s in zip(pairs, against, shares, strict=True)]
    order = tuple(sorted(matches, key=lambda m: (-m.probability, m.loss, m.index)))
    best = order[0]
    margin = order[1].loss - best.loss if len(order) > 1 else math.inf
    reasons: list[str] = []
    if best.probability < p.accept:
        reasons.append(
            f"candidate {best.index} is the target with probability {best.probability:.2f}, below {p.accept:g}"
            + (f"; candidate {order[1].index} with {order[1].probability:.2f}" if len(order) > 1 else "")
            + f"; none of them with {p_absent:.2f}"
        )
    if best.fit is None:
        reasons.append(f"no closure felt candidate {best.index}: its pose is not known")
    return Ranking(order, margin, not reasons, tuple(reasons), p_absent)
