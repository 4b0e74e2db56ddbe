"""Random streams by purpose: a draw for one purpose never shifts the draws for another.

So the layout of a seed stays the same whatever sensor noise is switched on: conditions compare seed by seed.
"""

from __future__ import annotations

import zlib

import numpy as np


def stream(seed: int, purpose: str) -> np.random.Generator:
    """A generator for one purpose of one trial; same seed and purpose, same draws."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(zlib.crc32(purpose.encode()),)))
