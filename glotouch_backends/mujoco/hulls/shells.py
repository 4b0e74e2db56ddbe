"""The closed surfaces of a mesh. CoACD gets them one by one, because it does not terminate on two that intersect."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glotouch_bt.robot import Array


def shell_labels(vertices_m: Array, faces: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Return the shell number (f,) of each face, from 0; -1 for the walls of inner cavities."""
    import trimesh

    solid = trimesh.Trimesh(vertices_m, faces, process=False)
    raw = trimesh.graph.connected_component_labels(solid.face_adjacency, node_count=len(faces))
    corners = solid.triangles
    volume_m3 = np.bincount(raw, np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))) / 6.0
    outer = volume_m3 > 0.0
    number = np.where(outer, np.cumsum(outer) - 1, -1)
    return np.asarray(number[raw], dtype=np.int64)
