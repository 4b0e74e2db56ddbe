"""Random streams by purpose: a draw for one purpose never shifts the draws for another.

The layout of a seed does not depend on the sensor noise, so conditions can be compared seed by seed.
"""

from __future__ import annotations

import zlib

import numpy as np


def stream(seed: int, purpose: str) -> np.random.Generator:
    """Return the generator for one purpose of one trial; the same seed and purpose give the same draws."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(zlib.crc32(purpose.encode()),)))
