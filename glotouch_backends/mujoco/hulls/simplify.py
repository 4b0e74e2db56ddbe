"""Mesh simplification for CoACD, whose run time grows faster than the number of triangles."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glotouch_bt.robot import Array
from glotouch_bt.robot.scene import Mesh

MAX_FACES = 20_000
"""Largest number of triangles for CoACD. Source: measured; a ball of 100 000 triangles took 140 s, simplified to 16 000
13 s, with the same bulge (0.18 mm)."""
FIRST_CELL_M = 0.0004
"""First size of a grid cell. Source: ours."""
GROWTH = 1.25
"""Growth of the cells from one attempt to the next. Source: ours."""


def simplified(mesh: Mesh) -> tuple[Array, npt.NDArray[np.int64]]:
    """Return (vertices (v, 3) m, faces (f, 3)) of a mesh, simplified if it has more than `MAX_FACES`.

    Vertex clustering (Rossignac and Borrel 1993): all vertices in one cell of a grid become their mean; the cells grow
    until few enough faces are left. A smooth surface moves by far less than a cell.
    """
    vertices, faces, cell_m = np.asarray(mesh.vertices_m), np.asarray(mesh.faces), FIRST_CELL_M
    while len(faces) > MAX_FACES:
        vertices, faces = _clustered(mesh, cell_m)
        cell_m *= GROWTH
    return vertices, faces


def _clustered(mesh: Mesh, cell_m: float) -> tuple[Array, npt.NDArray[np.int64]]:
    cells = np.floor(mesh.vertices_m / cell_m).astype(np.int64)
    _, owner, count = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    owner = owner.ravel()
    means = np.column_stack([np.bincount(owner, mesh.vertices_m[:, i]) / count for i in range(3)])
    faces = owner[mesh.faces]
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    # coinciding faces cancel in pairs, so that the mesh stays closed
    _, first, times = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return means, faces[np.sort(first[times % 2 == 1])]
