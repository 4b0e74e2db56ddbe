"""The matchers to compare, by name."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.metadata import EntryPoint

import numpy as np

from glotouch_bt.perception.recognition import MATCHERS, Match, Matcher, Ranking, TargetModel, infer_belief
from glotouch_bt.perception.recognition.likelihood import LikelihoodParams
from glotouch_bt.perception.recognition.paper import PaperParams, paper_matcher
from glotouch_bt.perception.touch import TouchSet
from glotouch_bt.plugins import MATCHERS as OUTSIDE
from glotouch_bt.plugins import load_plugin, plugins
from glotouch_bt.robot import BadInput
from glotouch_bt.robot.scene import Mesh


@dataclass(frozen=True)
class Target:
    """The object to recognise, as matchers receive it.

    Attributes:
        mesh: Its mesh, in the frame of its file.
        model: Tables computed from it for the pads that touched.
        touched: Tables that follow from one handling of the object; None if it was not handled.
    """

    mesh: Mesh
    model: TargetModel
    touched: TargetModel | None = None


Method = Callable[[Target, Sequence[TouchSet]], Ranking]

DEFAULT = "likelihood"
TOUCHED = "touched"
"""The same matcher, with the target known by touch only instead of by its STL."""
ACCEPTED = LikelihoodParams().accept
"""Probability from which an outside matcher's best candidate counts as accepted: as with the skill `match`."""
PAPER_TOP1: Mapping[str, float] = {"paper_width": 0.683, "paper_depth": 0.783, "paper_full": 0.900}
"""Row Top-1 of the paper's ablation, on its own objects and robot."""


def methods() -> dict[str, Method]:
    """Return every method by name: the paper's ablation, that of the likelihood, those of `recognition`, outside ones.

    An outside matcher is an entry point of the group `plugins.MATCHERS`; it is imported when it is first called. It
    cannot take the name of one of ours.
    """
    steps = dict(zip(PAPER_TOP1, PaperParams().ablation().values(), strict=True))
    made: dict[str, Matcher] = {name: paper_matcher(params) for name, params in steps.items()}
    made |= {f"{DEFAULT}_{name}": likelihood_matcher(params) for name, params in LikelihoodParams().ablation().items()}
    made |= {name: matcher for name, matcher in MATCHERS.items() if name != "paper"}
    found: dict[str, Method] = {name: partial(judge, point) for name, point in plugins(OUTSIDE).items()}
    return {**found, **{name: partial(_by_model, matcher) for name, matcher in made.items()}}


def by_touch(target: Target, touchsets: Sequence[TouchSet]) -> Ranking:
    """Return the default matcher's ranking for the handled object.

    Raises:
        BadInput: It was not handled.
    """
    if target.touched is None:
        raise BadInput(f"{target.mesh.name}: was not handled before; give --touched")
    return MATCHERS[DEFAULT](target.touched, touchsets)


def _by_model(matcher: Matcher, target: Target, touchsets: Sequence[TouchSet]) -> Ranking:
    return matcher(target.model, touchsets)


def judge(point: EntryPoint, target: Target, touchsets: Sequence[TouchSet]) -> Ranking:
    """Return the ranking of an outside matcher, which returns one itself or the probability of each TouchSet.

    Probabilities (n,) say that the TouchSet is of the target; what is missing to 1 is that none is. The best one is
    accepted from `ACCEPTED` on, as missions do; its loss is -log p, and it has no pose.

    Raises:
        BadInput: It cannot be imported, or returns something else.
    """
    found = load_plugin(point)(target.mesh, tuple(touchsets))
    if isinstance(found, Ranking):
        return found
    p = np.asarray(found, dtype=np.float64)
    if p.shape != (len(touchsets),) or not (p >= 0).all() or p.sum() > 1 + 1e-9:
        raise BadInput(
            f"matcher {point.name}: must return a Ranking, or {len(touchsets)} probabilities >= 0 with a sum of at "
            f"most 1, not {found!r:.200}"
        )
    nowhere = (math.nan, math.nan, math.nan)
    matches = [
        Match(t.candidate.index, -math.log(max(x, 1e-300)), {}, None, nowhere, 0.0, x)
        for t, x in zip(touchsets, p.tolist(), strict=True)
    ]
    order = tuple(sorted(matches, key=lambda m: (m.loss, m.index)))
    margin = order[1].loss - order[0].loss if len(order) > 1 else math.inf
    sure = order[0].probability >= ACCEPTED
    reasons = () if sure else (f"probability {order[0].probability:.2f} is below {ACCEPTED:g}",)
    return Ranking(order, margin, sure, reasons, p_absent=max(0.0, 1.0 - float(p.sum())))


def likelihood_matcher(params: LikelihoodParams) -> Matcher:
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
