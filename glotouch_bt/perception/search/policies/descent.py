"""Baseline policy of the paper: hop between random positions and descend at each (section IV-B)."""

from __future__ import annotations

import zlib

import numpy as np

from glotouch_bt.perception.search.map import SearchMap
from glotouch_bt.perception.search.policies.policy import Stretch
from glotouch_bt.robot import Array, ParamError

HOP_M = 0.005
"""Minimum distance between descents, and between path samples separated by a hop."""
DRAWS = 200
"""Number of positions drawn per descent."""


class RandomDescent:
    """Draw positions uniformly from the permitted region outside envelopes, and hop to them.

    Stateless: the draw depends on the seed, on the size of the map and on the tip's position to the micrometre.

    Args:
        seed: Seed of the draws.
        max_descents: Number of hops after which the search is exhausted. The default is about 30 m of travel in a
            0.3 m x 0.4 m container, six times the largest budget of the paper.

    Raises:
        ParamError: `max_descents` below 1.
    """

    def __init__(self, seed: int = 0, *, max_descents: int = 200) -> None:
        if max_descents < 1:
            raise ParamError("max_descents", max_descents, "at least 1")
        self._seed, self._max_descents = seed, max_descents

    def next_stretch(self, belief: SearchMap, tip_K_m: Array) -> Stretch | None:
        """See `SearchPolicy`."""
        path, tip = belief.path_K_m, np.asarray(tip_K_m, dtype=np.float64)[:2]
        hops = int(np.sum(np.linalg.norm(np.diff(path, axis=0), axis=1) > HOP_M)) if len(path) > 1 else 0
        if hops + len(belief.dropped) >= self._max_descents:
            return None
        here = zlib.crc32(np.rint(tip * 1e6).astype(np.int64).tobytes())
        rng = np.random.default_rng((self._seed, len(path), len(belief.dropped), here))
        places = rng.uniform(-1.0, 1.0, (DRAWS, 2)) * belief.half_extent_m
        free = ~belief.inside_exclusion(places)
        last = path[-1:] if len(path) else tip[None]
        for known in (last, tip[None], belief.dropped[-1:]):  # a descent there would not change the map
            if len(known):
                free &= np.linalg.norm(places - known, axis=1) > HOP_M
        if not free.any():
            return None
        return Stretch(places[free][:1], raised=True)
