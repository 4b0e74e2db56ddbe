"""What is believed after some touches: one value that ranks, and that predicts further touches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from glotouch_bt.perception.recognition.decision import Closure, Ranking
from glotouch_bt.perception.recognition.likelihood.gain import Prediction, expected_gains, predict
from glotouch_bt.perception.recognition.likelihood.pair import Pair, Reading, compare, read_touchset
from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.perception.recognition.likelihood.posterior import decide, probabilities, ratios
from glotouch_bt.perception.recognition.model import TargetModel
from glotouch_bt.perception.touch import TouchSet
from glotouch_bt.robot import Array, ParamError

OPTION_YAWS, OPTION_HEIGHTS = 6, 3
"""Closures weighed for `Ranking.next_touch`: yaws over half a turn, and heights, through the middle of the contour."""
LOWEST_M, TOP_OVERLAP_M = 0.020, 0.008
"""Heights of the pads' mid-point that fingers reach (CONDITIONS): above the floor, and below the top."""


@dataclass(frozen=True, eq=False)
class Belief:
    """State after some touches. A TouchSet may have no sequence yet: its contour and height alone speak then.

    Attributes:
        model: The target.
        touchsets: What was felt, one a candidate.
        ranking: Over the candidates.
        readings, pairs: The touchsets weighed, and the evidence, in the same order; reckoned if not given.
        params: Of the likelihood.
    """

    model: TargetModel
    touchsets: tuple[TouchSet, ...]
    ranking: Ranking
    readings: tuple[Reading, ...] = ()
    pairs: tuple[Pair, ...] = ()
    params: LikelihoodParams = field(default_factory=LikelihoodParams)

    def __post_init__(self) -> None:
        if len(self.pairs) != len(self.touchsets):
            readings = tuple(read_touchset(t, self.model.pad, self.params) for t in self.touchsets)
            object.__setattr__(self, "readings", readings)
            object.__setattr__(self, "pairs", tuple(compare(self.model, r, self.params) for r in readings))

    def predictions(self) -> dict[int, Prediction]:
        """By candidate index."""
        return {x.index: predict(self.model, r, x, self.params) for r, x in zip(self.readings, self.pairs, strict=True)}


def believe(
    model: TargetModel,
    touchsets: Sequence[TouchSet],
    params: LikelihoodParams | None = None,
    before: Belief | None = None,
) -> Belief:
    """The belief after `touchsets`, one a candidate; of `before`, what is unchanged (by identity) is not reckoned anew.

    Raises:
        ParamError: None at all, two of one candidate, or a candidate whose outline is not finite.
    """
    p = params or LikelihoodParams()
    check(touchsets)
    readings = tuple(read_touchset(t, model.pad, p) for t in touchsets)
    known: dict[int, Pair] = {}
    if before is not None and before.model is model and before.params == p:
        known = {id(t): x for t, x in zip(before.touchsets, before.pairs, strict=True)}
    pairs = tuple(known.get(id(t)) or compare(model, r, p) for t, r in zip(touchsets, readings, strict=True))
    return Belief(model, tuple(touchsets), decide(pairs, p), readings, pairs, p)


def check(touchsets: Sequence[TouchSet]) -> None:
    """Refuse what cannot be ranked.

    Raises:
        ParamError: See `believe`.
    """
    indices = [t.candidate.index for t in touchsets]
    if not indices:
        raise ParamError("touchsets", 0, "at least one")
    if len(set(indices)) < len(indices):
        raise ParamError("touchsets", indices, "one a candidate")
    for t in touchsets:
        c = t.candidate.contour
        if not np.isfinite([*c.centre_K_m, *c.size_m, c.yaw_rad, t.candidate.height_m]).all():
            raise ParamError(f"candidate {t.candidate.index}", "outline or height", "finite")


def expected_gain(belief: Belief, closures: Sequence[Closure]) -> Array:
    """(n,) expected information gain, nats, of each closure over "which candidate, or none, is the target".

    Raises:
        ParamError: A closure on a candidate that is not in the belief.
    """
    known = {x.index for x in belief.pairs}
    for c in closures:
        if c.candidate not in known:
            raise ParamError("closure.candidate", c.candidate, f"one of {sorted(known)}")
    shares = {m.index: m.probability for m in belief.ranking.matches}
    return expected_gains(belief.model, belief.predictions(), shares, belief.ranking.p_absent, closures, belief.params)


def identify(
    models: Sequence[TargetModel], touchset: TouchSet, params: LikelihoodParams | None = None
) -> tuple[Array, float]:
    """(n,) probability that the touched object is each of `models`, and that it is none of them; they sum to 1.

    Raises:
        ParamError: No model, models for different pads, or an outline that is not finite.
    """
    p = params or LikelihoodParams()
    check((touchset,))
    if not models:
        raise ParamError("models", 0, "at least one")
    if any(m.pad != models[0].pad for m in models):
        raise ParamError("models", "of several pads", "of one pad")
    reading = read_touchset(touchset, models[0].pad, p)
    pairs = [compare(m, reading, p) for m in models]
    return probabilities(ratios(pairs, p), p)


def ranked(belief: Belief) -> Ranking:
    """The ranking, with the closure that would help most if it is not accepted."""
    ranking = belief.ranking
    if ranking.accepted:
        return ranking
    options = [c for r in belief.readings for c in closure_options(r.touchset)]
    gains = expected_gain(belief, options)
    best = int(np.argmax(gains))
    if gains[best] <= 0:
        return ranking
    return replace(ranking, next_touch=replace(options[best], gain_nats=float(gains[best])))


def closure_options(touchset: TouchSet) -> list[Closure]:
    """Closures through the middle of the contour: of a box across its sides, of a round one from all sides."""
    c = touchset.candidate.contour
    top = max(touchset.candidate.height_m - TOP_OVERLAP_M, LOWEST_M)
    heights = np.linspace(LOWEST_M, top, OPTION_HEIGHTS if top > LOWEST_M + 0.01 else 1)
    if c.kind == "box":
        yaws = [c.yaw_rad, c.yaw_rad + 0.5 * math.pi]
    else:
        yaws = [c.yaw_rad + i * math.pi / OPTION_YAWS for i in range(OPTION_YAWS)]
    return [Closure(touchset.candidate.index, yaw, float(h), np.asarray(c.centre_K_m)) for yaw in yaws for h in heights]
