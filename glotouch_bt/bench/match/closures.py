"""Closures to confidence: feed recorded closures to the matcher one after another until it is confident.

Every candidate's contour and top are known from the start. A replayed closure always gives its recorded result,
whatever was fed before it; a real skill that chooses its closures would move the objects differently.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from glotouch_bt.bench.match.dataset import Layout
from glotouch_bt.perception.recognition import Belief, Closure, Ranking, TargetModel, expected_gain, infer_belief
from glotouch_bt.perception.touch import TouchSet

CONFIDENT = 0.95
CLOSURE_COLUMNS = (
    "order", "seed", "target", "present", "closures", "recorded", "confident", "accepted", "right",
    "best_object", "p_best",
)  # fmt: skip


@dataclass(frozen=True, order=True)
class Shown:
    """Index of one recorded closure: touched candidate, sequence, layer."""

    candidate: int
    sequence: int
    layer: int


Choice = Callable[[Sequence[Shown], Sequence[TouchSet], Belief], int]
"""(remaining closures, all TouchSets, belief so far) -> index of the next closure."""


def recorded_closures(touchsets: Sequence[TouchSet]) -> list[Shown]:
    """Return all closures in the order they were made."""
    return [
        Shown(i, j, k)
        for i, t in enumerate(touchsets)
        for j, s in enumerate(t.sequences)
        for k in range(len(s.layers))
    ]  # fmt: skip


def partial(touchset: TouchSet, shown: Sequence[Shown]) -> TouchSet:
    """Return the TouchSet reduced to the given closures; empty sequences are left out."""
    kept: dict[int, list[int]] = {}
    for s in sorted(shown):
        kept.setdefault(s.sequence, []).append(s.layer)
    sequences = (
        replace(touchset.sequences[j], layers=tuple(touchset.sequences[j].layers[k] for k in layers))
        for j, layers in kept.items()
    )
    return replace(touchset, sequences=tuple(sequences))


def in_order(left: Sequence[Shown], whole: Sequence[TouchSet], belief: Belief) -> int:
    """Choose the next closure of the fixed scheme: candidate after candidate, as recorded."""
    return 0


def in_turn(left: Sequence[Shown], whole: Sequence[TouchSet], belief: Belief) -> int:
    """Choose one closure of each candidate in turn."""
    total = [len(t.layers) for t in whole]
    remain = [sum(s.candidate == i for s in left) for i in range(len(whole))]
    done = [n - m if m else np.inf for n, m in zip(total, remain, strict=True)]
    turn = int(np.argmin(done))
    return next(i for i, s in enumerate(left) if s.candidate == turn)


def by_information_gain(left: Sequence[Shown], whole: Sequence[TouchSet], belief: Belief) -> int:
    """Choose the closure with the greatest expected information gain."""
    return int(np.argmax(expected_gain(belief, [closure_of(whole[s.candidate], s) for s in left])))


def closure_of(touchset: TouchSet, shown: Shown) -> Closure:
    """Return the position and yaw of a recorded closure."""
    layer = touchset.sequences[shown.sequence].layers[shown.layer]
    return Closure(touchset.candidate.index, layer.yaw_rad, layer.height_m, np.asarray(layer.position_K_m))


ORDERS: dict[str, Choice] = {"recorded": in_order, "in_turn": in_turn, "adaptive": by_information_gain}


def closures_to_confidence(layout: Layout, models: Mapping[str, TargetModel]) -> list[dict[str, Any]]:
    """Return a row for each order and target: closures until acceptance with P > `CONFIDENT`, and correctness.

    A target that never reaches it has `confident` False and all closures counted; `right` and `accepted` then describe
    the last ranking. Each is replayed again without the target's own TouchSets (`present` False), where any acceptance
    is wrong.
    """
    rows = []
    for target, model in models.items():
        others = [t for t in layout.touched if t.name != target]
        for touched, present in ((layout.touched, bool(layout.of(target))), (others, False)):
            whole = [t.touchset for t in touched]
            names = {t.touchset.candidate.index: t.name for t in touched}
            if not whole or (not present and len(others) == len(layout.touched)):
                continue
            for order, choose in ORDERS.items():
                count, ranking = _until_sure(whole, model, choose)
                best = names[ranking.best.index]
                rows.append(
                    {"order": order, "seed": layout.seed, "target": target, "present": present,
                     "closures": count, "recorded": len(recorded_closures(whole)), "confident": sure(ranking),
                     "accepted": bool(ranking.accepted), "right": best == target, "best_object": best,
                     "p_best": ranking.best.probability}
                )  # fmt: skip
    return rows


def _until_sure(whole: Sequence[TouchSet], model: TargetModel, choose: Choice) -> tuple[int, Ranking]:
    left = recorded_closures(whole)
    so_far = [partial(t, ()) for t in whole]
    shown: list[Shown] = []
    belief = infer_belief(model, so_far)
    while left and not sure(belief.ranking):
        new = left.pop(choose(left, whole, belief))
        shown.append(new)
        i = new.candidate
        so_far[i] = partial(whole[i], [s for s in shown if s.candidate == i])
        belief = infer_belief(model, so_far, before=belief)
    return len(shown), belief.ranking


def sure(ranking: Ranking) -> bool:
    """Return True if the best is accepted with P > `CONFIDENT`."""
    return bool(ranking.accepted) and ranking.best.probability > CONFIDENT
