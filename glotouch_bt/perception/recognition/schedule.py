"""Choice of the next touch, and the rule that ends touching: pure functions of the belief.

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
"""A candidate whose probability fell below this share of its prior is left alone. Source: ours."""
CHANGE_S = 42.0
"""Robot time of taking the probe once more: `tool_pickup`, `tool_calibrate` and `tool_return`. Source: measured, mean
of 60 nominal missions."""

MAX_ABSENT = 0.03
"""Probability of an absent target at which closures on the likeliest candidate end. Source: the largest share of wrong
objects that the project allows. `match` still accepts from a lower probability if no closure is left."""
POSE_LAYERS = 2.0
"""Minimum number of two-sided layers for a pose at which a grasp can be planned. Source: ours."""


@dataclass(frozen=True)
class ProbeOption:
    """A measurement that the probe could make next, with what it leads to.

    Attributes:
        touch: What it measures.
        seconds: Robot time from now until it is done.
        then: The measurement that it makes possible, if any: a top is touched where the outline is known.
        more_s: Robot time of `then`.
    """

    touch: ProbeTouch
    seconds: float
    then: ProbeTouch | None = None
    more_s: float = 0.0


def best_of(belief: Belief) -> Match:
    """Return the likeliest candidate."""
    return max(belief.ranking.matches, key=lambda m: m.probability)


def excluded(belief: Belief) -> frozenset[int]:
    """Return the indices of candidates that are not worth another touch; the likeliest never is one."""
    prior = (1.0 - belief.params.prior_absent) / len(belief.touchsets)
    out = {m.index for m in belief.ranking.matches if m.probability < EXCLUDED_SHARE * prior}
    return frozenset(out - {best_of(belief).index})


def next_probe_touch(belief: Belief, options: Sequence[ProbeOption], *, can_wait: bool = True) -> ProbeOption | None:
    """Return the option with the most gain per second, alone or with `then`; None if none is worth its time.

    An option on an excluded candidate is not.

    Args:
        belief: What is known.
        options: One for each candidate that was not measured completely.
        can_wait: Leave out what is better put off until the jaws have been used (`pays_now`). False if they have been
            used: then the target is hardly one of the measured candidates.
    """
    out, unmeasured = excluded(belief), {o.touch.candidate for o in options}
    left = [o for o in options if o.touch.candidate not in out]
    if can_wait:
        left = [o for o in left if pays_now(belief, o, unmeasured)]
    if not left:
        return None
    touches = [t for o in left for t in (o.touch, o.then) if t is not None]
    gain = {t: float(g) for t, g in zip(touches, expected_gain(belief, touches), strict=True)}

    def rate(o: ProbeOption) -> float:
        alone = gain[o.touch] / o.seconds
        return alone if o.then is None else max(alone, (gain[o.touch] + gain[o.then]) / (o.seconds + o.more_s))

    best = max(left, key=rate)
    return replace(best, touch=replace(best.touch, gain_nats=gain[best.touch]))


def pays_now(belief: Belief, option: ProbeOption, unmeasured: set[int]) -> bool:
    """Return True if it is expected to save time to measure a candidate now, and not once the jaws have been used.

    If it is the target, measuring it later costs `CHANGE_S` more. If the target is one of those measured before, its
    own time is saved. The likeliest candidate counts as measured before all others.

    Args:
        belief: What is known.
        option: What is left to measure of the candidate.
        unmeasured: All candidates that were not measured completely.
    """
    share = {m.index: m.probability for m in belief.ranking.matches}
    index, best = option.touch.candidate, best_of(belief).index
    before = sum(p for i, p in share.items() if i not in unmeasured or i == best)
    return index == best or share[index] * CHANGE_S >= before * (option.seconds + option.more_s)


def wanted(belief: Belief, confidence: float, hopeless: frozenset[int]) -> set[int]:
    """Return candidates to close the jaws on whatever the gain; mostly none.

    Args:
        belief: What is known.
        confidence: As in `is_sure`; for an absent target, its sufficient probability.
        hopeless: Candidates on which closures were made in vain.
    """
    ranking = belief.ranking
    if is_sure(belief, confidence):
        return hardly_felt(belief)
    if ranking.p_absent >= confidence:
        unfelt = {t.candidate.index for t in belief.touchsets if not any(layer.stable for layer in t.layers)}
        return (unfelt or hardly_felt(belief)) - hopeless
    return set()


def is_sure(belief: Belief, confidence: float) -> bool:
    """Return True if the likeliest candidate is the target with sufficient probability.

    Two questions have a threshold each: which candidate it is if it is one of them (`confidence`), and whether it is
    one of them (`MAX_ABSENT`). The widths felt on an object that turned fit no target well: they raise the probability
    of an absent target, but still tell the candidates apart.
    """
    present = 1.0 - belief.ranking.p_absent
    return present >= 1.0 - MAX_ABSENT and best_of(belief).probability >= confidence * present


def hardly_felt(belief: Belief) -> set[int]:
    """Return the likeliest candidate if it was not felt often enough to know its pose."""
    best = best_of(belief)
    return {best.index} if best.evidence < POSE_LAYERS else set()


def enough(belief: Belief, confidence: float, hopeless: frozenset[int]) -> str:
    """Return why no further closure is needed, or an empty text.

    A target's pose must be known, too. Conclude that the target is absent only when every candidate was touched:
    outlines do not suffice. Arguments as of `wanted`.
    """
    ranking, best = belief.ranking, best_of(belief)
    if is_sure(belief, confidence) and not hardly_felt(belief):
        return f"candidate {best.index} is the target (probability {best.probability:.3f})"
    if ranking.p_absent >= confidence and not wanted(belief, confidence, hopeless):
        return f"none of them is the target (probability {ranking.p_absent:.3f})"
    return ""
