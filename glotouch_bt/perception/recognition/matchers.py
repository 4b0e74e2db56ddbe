"""Matchers by name: each ranks the TouchSets of all candidates against one target."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Protocol

from glotouch_bt.perception.recognition.decision import Ranking
from glotouch_bt.perception.recognition.likelihood import infer_belief, ranked
from glotouch_bt.perception.recognition.model import TargetModel
from glotouch_bt.perception.recognition.paper import paper_matcher
from glotouch_bt.perception.touch import TouchSet


class Matcher(Protocol):
    """Deterministic ranking of candidates."""

    def __call__(self, model: TargetModel, touchsets: Sequence[TouchSet], /) -> Ranking:
        """Rank the candidates; the probabilities and `p_absent` sum to 1.

        Raises:
            ParamError: No TouchSet at all, or two of the same candidate.
        """


MATCHERS: Mapping[str, Matcher] = MappingProxyType(
    {"likelihood": lambda model, touchsets: ranked(infer_belief(model, touchsets)), "paper": paper_matcher()}
)
