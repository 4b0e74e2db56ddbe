"""Candidates that are parts of one body: the target, whose section explains the contacts of both."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np

from glotouch_bt.perception.recognition import TargetModel, gain_of_one
from glotouch_bt.perception.recognition.model import TIP_RADIUS_M
from glotouch_bt.perception.search import BESIDE_M, outline_of, quality
from glotouch_bt.perception.touch import Candidate, signed_distance
from glotouch_bt.perception.touch.outline import envelope

MIN_GAIN_NATS = 3.0
"""Minimum gain of log evidence by which one target explains the contacts of two candidates better than two objects.
Source: ours."""


def joined(
    model: TargetModel, candidates: tuple[Candidate, ...], preferred: frozenset[int] = frozenset()
) -> tuple[Candidate, ...]:
    """Join neighbouring candidates while the target explains their contacts better as one body.

    Args:
        model: The target.
        candidates: All candidates.
        preferred: Indices of candidates that are kept, rather than those without closures.
    """
    left = list(candidates)
    while len(left) > 1:
        pairs = [(a, b) for a, b in combinations(left, 2) if _gap_m(a, b) < BESIDE_M]
        gains = [gain_of_one(model, a, b) for a, b in pairs]
        if not gains or max(gains) < MIN_GAIN_NATS:
            break
        pair = pairs[int(np.argmax(gains))]
        a, b = sorted(pair, key=lambda c: (c.index not in preferred, not c.top_touched, -len(c.contacts), c.index))
        contacts = tuple(sorted((*a.contacts, *b.contacts), key=lambda c: c.stamp_s))
        outline = outline_of(contacts, TIP_RADIUS_M)
        height_m = a.height_m if a.top_touched else max(a.height_m, b.height_m)
        whole = replace(a, contour=outline.contour, contacts=contacts, quality=quality(outline), height_m=height_m)
        left = [whole if c is a else c for c in left if c is not b]
    return tuple(left)


def _gap_m(a: Candidate, b: Candidate) -> float:
    """Return the distance between the envelope of one candidate and the nearest point of the other."""
    return float(min(signed_distance(envelope(x), y.extent_K_m).min() for x, y in ((a, b), (b, a))))
