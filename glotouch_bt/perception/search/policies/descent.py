"""The paper's baseline without a search: raised from one random place to the next, down at each (section IV-B)."""

from __future__ import annotations

import zlib

import numpy as np

from glotouch_bt.perception.search.map import SearchMap
from glotouch_bt.perception.search.policies.policy import Stretch
from glotouch_bt.robot import Array, ParamError

HOP_M = 0.005
"""Path samples farther apart than this have a hop between them; no descent is nearer than this to the last one."""
DRAWS = 200


class RandomDescent:
    """A place drawn uniformly from the permitted region outside traced envelopes, reached raised.

    No contact map and no frontier: only traced objects are kept out of. Stateless: the draw depends on the seed, on how
    much the map holds and on where the tip is, to the micrometre: no two robots draw alike.

    Args:
        seed: Of the draws.
        max_descents: After so many hops the search counts as exhausted. The draws alone would never end; the default
            is some 30 m of travel in a 0.3 m x 0.4 m container, six times the largest budget of the paper.

    Raises:
        ParamError: `max_descents` below 1.
    """

    def __init__(self, seed: int = 0, *, max_descents: int = 200) -> None:
        if max_descents < 1:
            raise ParamError("max_descents", max_descents, "at least 1")
        self._seed, self._most = seed, max_descents

    def next_stretch(self, belief: SearchMap, tip_K_m: Array) -> Stretch | None:
        """See `SearchPolicy`."""
        path, tip = belief.path_K_m, np.asarray(tip_K_m, dtype=np.float64)[:2]
        hops = int(np.sum(np.linalg.norm(np.diff(path, axis=0), axis=1) > HOP_M)) if len(path) > 1 else 0
        if hops + len(belief.dropped) >= self._most:
            return None
        here = zlib.crc32(np.rint(tip * 1e6).astype(np.int64).tobytes())
        rng = np.random.default_rng((self._seed, len(path), len(belief.dropped), here))
        places = rng.uniform(-1.0, 1.0, (DRAWS, 2)) * belief.half_extent_m
        free = ~belief.inside_exclusion(places)
        last = path[-1:] if len(path) else tip[None]
        for known in (last, tip[None], belief.dropped[-1:]):  # else a descent there would leave the map as it was
            if len(known):
                free &= np.linalg.norm(places - known, axis=1) > HOP_M
        if not free.any():
            return None
        return Stretch(places[free][:1], raised=True)
