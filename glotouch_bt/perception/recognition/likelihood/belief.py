"""Posterior over the target's identity after some touches, with ranking and predictions of further touches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from glotouch_bt.perception.recognition.decision import Closure, ProbeTouch, Ranking
from glotouch_bt.perception.recognition.likelihood.gain import expected_gains, predict
from glotouch_bt.perception.recognition.likelihood.pair import Pair, TouchSetReading, compare, read_touchset
from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.perception.recognition.likelihood.posterior import decide
from glotouch_bt.perception.recognition.likelihood.probe_gain import expected_probe_gains
from glotouch_bt.perception.recognition.model import TargetModel
from glotouch_bt.perception.touch import TouchSet
from glotouch_bt.robot import Array, ParamError

OPTION_YAWS = 6
"""Number of yaws over half a turn among the options for `Ranking.next_touch`."""
OPTION_HEIGHTS = 3
"""Number of heights among the options for `Ranking.next_touch`."""
LOWEST_M = 0.020
"""Minimum height of the pads' mid-point above the floor. Source: ours; the fingers end 16 mm below it (rizon4.yaml)."""
TOP_OVERLAP_M = 0.008
"""Minimum distance of the pads' mid-point below the top. Source: ours."""


@dataclass(frozen=True, eq=False)
class Belief:
    """Posterior after some touches. A TouchSet without sequences contributes contour and height.

    Attributes:
        model: The target.
        touchsets: Touches, one per candidate.
        ranking: Ranking of the candidates.
        readings, pairs: Background and target evidence in the same order; computed if not given.
        params: Parameters of the likelihood.
    """

    model: TargetModel
    touchsets: tuple[TouchSet, ...]
    ranking: Ranking
    readings: tuple[TouchSetReading, ...] = ()
    pairs: tuple[Pair, ...] = ()
    params: LikelihoodParams = field(default_factory=LikelihoodParams)

    def __post_init__(self) -> None:
        if len(self.pairs) != len(self.touchsets):
            readings = tuple(read_touchset(t, self.model.pad, self.params) for t in self.touchsets)
            object.__setattr__(self, "readings", readings)
            object.__setattr__(self, "pairs", tuple(compare(self.model, r, self.params) for r in readings))


def infer_belief(
    model: TargetModel,
    touchsets: Sequence[TouchSet],
    params: LikelihoodParams | None = None,
    before: Belief | None = None,
) -> Belief:
    """Compute the belief from `touchsets`, one per candidate; reuse pairs of unchanged touchsets of `before`.

    Raises:
        ParamError: No touchset, two of one candidate, or a non-finite outline.
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
    """Validate touchsets.

    Raises:
        ParamError: See `infer_belief`.
    """
    indices = [t.candidate.index for t in touchsets]
    if not indices:
        raise ParamError("touchsets", 0, "at least one")
    if len(set(indices)) < len(indices):
        raise ParamError("touchsets", indices, "one per candidate")
    for t in touchsets:
        c = t.candidate.contour
        if not np.isfinite([*c.centre_K_m, *c.size_m, c.yaw_rad, t.candidate.height_m]).all():
            raise ParamError(f"candidate {t.candidate.index}", "outline or height", "finite")


def expected_gain(belief: Belief, touches: Sequence[Closure] | Sequence[ProbeTouch]) -> Array:
    """Return the expected information gain (n,), nats, of each touch about which candidate, or none, is the target.

    Raises:
        ParamError: A touch on an unknown candidate.
    """
    known = {x.index for x in belief.pairs}
    for c in touches:
        if c.candidate not in known:
            raise ParamError("touch.candidate", c.candidate, f"one of {sorted(known)}")
    shares = {m.index: m.probability for m in belief.ranking.matches}
    p = belief.params
    probed = [t for t in touches if isinstance(t, ProbeTouch)]
    if probed:
        candidates = [t.candidate for t in belief.touchsets]
        return expected_probe_gains(candidates, belief.pairs, belief.ranking, probed, p)
    closures = [t for t in touches if isinstance(t, Closure)]
    predictions = {x.index: predict(r, x, p) for r, x in zip(belief.readings, belief.pairs, strict=True)}
    return expected_gains(belief.model.pad, predictions, shares, belief.ranking.p_absent, closures, p)


def ranked(belief: Belief) -> Ranking:
    """Return the ranking, with the most informative next closure unless it is accepted."""
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
    """Return closures through the contour's centre: across the sides of a box, from all sides of a round object."""
    c = touchset.candidate.contour
    top = max(touchset.candidate.height_m - TOP_OVERLAP_M, LOWEST_M)
    heights = np.linspace(LOWEST_M, top, OPTION_HEIGHTS if top > LOWEST_M + 0.01 else 1)
    if c.kind == "box":
        yaws = [c.yaw_rad, c.yaw_rad + 0.5 * math.pi]
    else:
        yaws = [c.yaw_rad + i * math.pi / OPTION_YAWS for i in range(OPTION_YAWS)]
    return [Closure(touchset.candidate.index, yaw, float(h), np.asarray(c.centre_K_m)) for yaw in yaws for h in heights]
