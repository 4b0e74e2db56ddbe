"""The matchers to compare, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from glotouch_bt.perception.recognition import MATCHERS, Ranking, TargetModel, infer_belief
from glotouch_bt.perception.recognition.likelihood import LikelihoodParams
from glotouch_bt.perception.recognition.paper import PaperParams, paper_matcher
from glotouch_bt.perception.touch import TouchSet
from glotouch_bt.robot import BadInput

Method = Callable[[TargetModel, Sequence[TouchSet]], Ranking]

DEFAULT = "likelihood"
PAPER_TOP1: Mapping[str, float] = {"paper_width": 0.683, "paper_depth": 0.783, "paper_full": 0.900}
"""Row Top-1 of the paper's ablation, on its own objects and robot."""


def methods() -> dict[str, Method]:
    """Return every method by name: the paper's ablation, that of the likelihood, the matchers of `recognition`."""
    steps = dict(zip(PAPER_TOP1, PaperParams().ablation().values(), strict=True))
    made: dict[str, Method] = {name: paper_matcher(params) for name, params in steps.items()}
    made |= {f"{DEFAULT}_{name}": likelihood_matcher(params) for name, params in LikelihoodParams().ablation().items()}
    return made | {name: matcher for name, matcher in MATCHERS.items() if name != "paper"}


def likelihood_matcher(params: LikelihoodParams) -> Method:
    """Return the likelihood matcher with given parameters."""
    return lambda model, touchsets: infer_belief(model, touchsets, params).ranking


def chosen(names: Sequence[str]) -> tuple[str, ...]:
    """Return `names` in table order; all methods if `names` is empty.

    Raises:
        BadInput: One is unknown.
    """
    known = methods()
    unknown = [n for n in names if n not in known]
    if unknown:
        raise BadInput(f"--method {','.join(unknown)}: must be among {', '.join(known)}")
    return tuple(n for n in known if not names or n in names)
