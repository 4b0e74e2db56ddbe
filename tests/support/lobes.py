"""Five lobed, twisted solids nobody has chosen, drawn from a seed: `python tests/lobes.py DIR --seed 20261121`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
import trimesh

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.support.shapes import loft

RINGS, COLUMNS = 40, 96


def solid(rng: np.random.Generator) -> trimesh.Trimesh:
    """An upright solid of 5-10 cm: an ellipse with 2 to 5 lobes that swells, tapers and turns on its way up."""
    a = np.linspace(0.0, 2 * np.pi, COLUMNS, endpoint=False)
    height = rng.uniform(0.05, 0.10)
    rx, ry = rng.uniform(0.02, 0.036), rng.uniform(0.02, 0.036)
    t = np.linspace(0.0, height, RINGS) / height
    lobes, depth, phase = rng.integers(2, 6), rng.uniform(0.05, 0.25), rng.uniform(0, 6)
    width = 1 + 0.25 * np.sin(2 * np.pi * rng.uniform(0.3, 1.2) * t + rng.uniform(0, 6)) - rng.uniform(0, 0.3) * t
    turn = rng.uniform(-1, 1) * t
    r = width[:, None] * (1 + depth * np.cos(lobes * (a - turn[:, None]) + phase))
    z = np.broadcast_to((height * t)[:, None], r.shape)
    return loft(np.stack([rx * r * np.cos(a), ry * r * np.sin(a), z], axis=-1))


def main() -> int:
    """Write five STL files; returns 0."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=20261121)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(options.seed)
    for i in range(5):
        solid(rng).export(options.folder / f"blob_{i}.stl")
    return 0


if __name__ == "__main__":
    sys.exit(main())
