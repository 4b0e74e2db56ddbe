"""Inertia of a uniform solid (Eberly, Polyhedral Mass Properties, 2009).

The sums are in the order of `trimesh.triangles.mass_properties`, and so are the rounding errors; but trimesh and what
it imports take half a second to load, and no other part of a world needs it.
"""

from __future__ import annotations

import numpy as np

from glotouch_bt.robot import Array
from glotouch_bt.robot.scene import Mesh

_DIVISORS = np.array([6, 24, 24, 24, 60, 60, 60, 120, 120, 120], dtype=np.float64)
_OTHERS = ((1, 2), (0, 2), (0, 1))


def uniform_inertia(mesh: Mesh, mass_kg: float) -> tuple[Array, Array]:
    """Return the centre of mass (3,) of a uniform solid in the mesh frame, and its inertia (3, 3) about it."""
    a, b, c = mesh.vertices_m[mesh.faces].transpose(1, 0, 2)
    crosses = np.cross(b - a, c - b)
    f1 = a + b + c
    f2 = a**2 + b**2 + a * b + c * f1
    f3 = a**3 + a**2 * b + a * b**2 + b**3 + c * f2
    mixed = [np.roll(corner, -1, axis=1) * (f2 + (corner + f1) * corner) for corner in (a, b, c)]
    integrals = np.zeros((10, len(a)))
    integrals[0] = crosses[:, 0] * f1[:, 0]
    integrals[1:4], integrals[4:7] = (crosses * f2).T, (crosses * f3).T
    integrals[7:] = (crosses * (mixed[0] + mixed[1] + mixed[2])).T
    volume, *rest = integrals.sum(axis=1) / _DIVISORS
    first, second, products = np.split(np.array(rest), 3)
    centre = first / volume
    inertia = np.zeros((3, 3))
    for i, (j, k) in enumerate(_OTHERS):
        inertia[i, i] = second[j] + second[k] - volume * (centre[[j, k]] ** 2).sum()
    for n, (i, j) in enumerate(((0, 1), (1, 2), (0, 2))):
        inertia[i, j] = inertia[j, i] = -(products[n] - volume * np.prod(centre[[i, j]]))
    return centre, inertia * (mass_kg / volume)
