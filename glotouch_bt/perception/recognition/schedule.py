"""Which touch comes next, and when enough is known: pure functions of the belief.

Every touch is worth its expected information gain about which candidate is the target, per second of robot time. The
probe measures a candidate's outline and top before the jaws close on it. A candidate that outline and height exclude
already is left alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from glotouch_bt.perception.recognition.decision import Match, ProbeTouch
from glotouch_bt.perception.recognition.likelihood import Belief, expected_gain

EXCLUDED_SHARE = 0.06
"""A candidate whose probability fell below this share of its prior is left alone. Source: measured in 63 nominal
worlds, 248 (world, target) pairs. By coarse outlines, by these and heights, and by all that the probe measures, 1.1,
2.4 and 2.4 of five candidates were below, the target never."""


@dataclass(frozen=True)
class ProbeOption:
    """One measurement that the probe could make next.

    Attributes:
        touch: What it measures.
        seconds: Robot time from now until it is done.
    """

    touch: ProbeTouch
    seconds: float

    @property
    def rate(self) -> float:
        """Expected gain, nats per second."""
        return self.touch.gain_nats / self.seconds


def best_of(belief: Belief) -> Match:
    """Return the likeliest candidate."""
    return max(belief.ranking.matches, key=lambda m: m.probability)


def excluded(belief: Belief) -> frozenset[int]:
    """Return the indices of candidates that are not worth another touch; the likeliest never is one."""
    prior = (1.0 - belief.params.prior_absent) / len(belief.touchsets)
    out = {m.index for m in belief.ranking.matches if m.probability < EXCLUDED_SHARE * prior}
    return frozenset(out - {best_of(belief).index})


def next_probe_touch(belief: Belief, options: Sequence[ProbeOption]) -> ProbeOption | None:
    """Return the option with the most gain per second on a candidate that is not excluded; None if there is none.

    Outline and top are both needed before the jaws may close, so an option without gain is worth its time, too.
    """
    out = excluded(belief)
    left = [o for o in options if o.touch.candidate not in out]
    if not left:
        return None
    gains = expected_gain(belief, [o.touch for o in left])
    gained = [replace(o, touch=replace(o.touch, gain_nats=float(g))) for o, g in zip(left, gains, strict=True)]
    return max(gained, key=lambda o: o.rate)


def wanted(belief: Belief, confidence: float, hopeless: frozenset[int]) -> set[int]:
    """Return candidates to close the jaws on whatever the gain, where a decision lacks only evidence; mostly none.

    Args:
        belief: What is known.
        confidence: Sufficient probability.
        hopeless: Candidates on which closures were made in vain.
    """
    ranking = belief.ranking
    if best_of(belief).probability >= confidence:
        return short_of_evidence(belief)
    if ranking.p_absent >= confidence:
        unfelt = {t.candidate.index for t in belief.touchsets if not any(layer.stable for layer in t.layers)}
        return (unfelt or short_of_evidence(belief)) - hopeless
    return set()


def short_of_evidence(belief: Belief) -> set[int]:
    """Return the likeliest candidate if both pads did not touch it as often as a decision requires."""
    best = best_of(belief)
    return {best.index} if best.evidence < belief.params.evidence else set()


def enough(belief: Belief, confidence: float, hopeless: frozenset[int]) -> str:
    """Return why no further closure is needed, or an empty text.

    Conclude that the target is absent only when every candidate was touched, and the likeliest as often as taking it
    would require. Outlines and single closures do not suffice. Arguments as of `wanted`.
    """
    ranking, best = belief.ranking, best_of(belief)
    if best.probability >= confidence and ranking.accepted:
        return f"candidate {best.index} is the target (probability {best.probability:.3f})"
    if ranking.p_absent >= confidence and not wanted(belief, confidence, hopeless):
        return f"none of them is the target (probability {ranking.p_absent:.3f})"
    return ""
