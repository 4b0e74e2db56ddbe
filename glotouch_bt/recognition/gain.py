"""Which closure would tell most about "which candidate, or none, is the target". Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from glotouch_bt.recognition.decision import Closure, Ranking
from glotouch_bt.recognition.matchers import MATCHERS
from glotouch_bt.recognition.model import TargetModel
from glotouch_bt.robot import Array
from glotouch_bt.touch.values import TouchSet


@dataclass(frozen=True, eq=False)
class Belief:
    """What is known after some touches: the ranking, and the tables to predict further touches with.

    A TouchSet may have no sequences yet: its contour and height alone speak then.

    Attributes:
        model: The target.
        touchsets: What was felt, one a candidate.
        ranking: Over the candidates.
    """

    model: TargetModel
    touchsets: tuple[TouchSet, ...]
    ranking: Ranking


def believe(model: TargetModel, touchsets: Sequence[TouchSet]) -> Belief:
    """The state of belief after `touchsets`, one a candidate (10 ms each)."""
    return Belief(model, tuple(touchsets), MATCHERS["likelihood"](model, touchsets))


def expected_gain(belief: Belief, closures: Sequence[Closure]) -> Array:
    """(n,) expected information gain of each closure, in nats; 0 for candidates that are surely (or surely not) it."""
    p = {m.index: m.probability for m in belief.ranking.matches}
    felt = {t.candidate.index: len(t.layers) for t in belief.touchsets}

    def entropy(x: float) -> float:
        return 0.0 if x <= 0 or x >= 1 else float(-x * np.log(x) - (1 - x) * np.log(1 - x))

    return np.array([entropy(p.get(c.candidate, 0.0)) / (1 + felt.get(c.candidate, 0)) for c in closures])
