"""Relief pairs: the same solid with and without ridges or grooves, `python tests/support/relief_pairs.py DIR --seed 1`.

A plain solid is an upright cylinder, ellipse, rounded box or rounded hexagon with straight or tapered walls. Its
partner has rings or ribs on its wall that stand out of it, or are cut into it, by 0.3 to 1 mm. Watertight, 4 to 9 cm.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt
import trimesh

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.support.shapes import loft

Array = npt.NDArray[np.float64]
COLUMNS = 320
"""Points around a ring: 0.5 mm apart on a wall of 25 mm radius."""
STEP_M = 0.0005
"""Distance of two rings."""
RELIEF_M = (0.0003, 0.001)
"""Smallest and largest height of a ridge or depth of a groove."""
PITCH_M = (0.0035, 0.006)
"""Smallest and largest distance of two ridges or grooves; each takes 0.3 to 0.5 of it."""
KINDS = ("round", "ellipse", "box", "hexagon")


def outline(kind: str, angle: Array, rng: np.random.Generator) -> Array:
    """Return the radius of a rounded outline at each angle, m."""
    size = rng.uniform(0.018, 0.030)
    if kind == "round":
        return np.full_like(angle, size)
    if kind == "hexagon":  # a blend of a circle and a hexagon's radius
        sector = np.mod(angle, np.pi / 3) - np.pi / 6
        return size * (0.2 + 0.8 / np.cos(sector))
    power, ratio = (2.0, rng.uniform(0.6, 0.85)) if kind == "ellipse" else (6.0, rng.uniform(0.6, 1.0))
    c, s = np.abs(np.cos(angle)), np.abs(np.sin(angle)) / ratio
    return size * (c**power + s**power) ** (-1.0 / power)


def bump(phase: Array, share: float) -> Array:
    """Return a train of rounded bumps 0..1 of period 1, each `share` wide."""
    off = np.abs(np.mod(phase, 1.0) - 0.5) / share
    return np.clip(1.5 - 2.0 * off, 0.0, 1.0)


def pair(kind: str, rng: np.random.Generator) -> tuple[trimesh.Trimesh, trimesh.Trimesh]:
    """Return a plain solid and its partner with relief."""
    angle = np.linspace(0.0, 2 * np.pi, COLUMNS, endpoint=False)
    radius = outline(kind, angle, rng)
    height = rng.uniform(0.045, 0.085)
    z = np.linspace(0.0, height, round(height / STEP_M) + 1)
    taper = 1.0 - rng.uniform(0.0, 0.15) * z / height
    wall = taper[:, None] * radius
    depth, pitch, share = rng.uniform(*RELIEF_M), rng.uniform(*PITCH_M), rng.uniform(0.3, 0.5)
    if rng.random() < 0.5:  # rings
        relief = np.broadcast_to(bump(z / pitch, share)[:, None], wall.shape)
    else:  # ribs, a whole number around
        count = round(2 * np.pi * float(radius.mean()) / pitch)
        relief = np.broadcast_to(bump(count * angle / (2 * np.pi), share), wall.shape)
    sign = 1.0 if rng.random() < 0.5 else -1.0
    ends = np.clip(np.minimum(z, height - z) / 0.003, 0.0, 1.0)[:, None]  # none at foot and top
    return _solid(wall, angle, z), _solid(wall + sign * depth * relief * ends, angle, z)


def _solid(radius: Array, angle: Array, z: Array) -> trimesh.Trimesh:
    rings = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.broadcast_to(z[:, None], radius.shape)], -1)
    return loft(rings)


def main() -> int:
    """Write the STL files of some pairs; returns 0."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--pairs", type=int, default=4)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(options.seed)
    for i in range(options.pairs):
        kind = KINDS[i % len(KINDS)]
        for name, mesh in zip(("plain", "relief"), pair(kind, rng), strict=True):
            mesh.export(options.folder / f"{kind}_{options.seed}_{i}_{name}.stl")
    return 0


if __name__ == "__main__":
    sys.exit(main())
