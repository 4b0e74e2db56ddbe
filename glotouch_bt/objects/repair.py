"""Repair a surface: join its corners, drop what is no part of it, close its holes. Directions of faces come later."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
import numpy.typing as npt
import trimesh

from glotouch_bt.errors import BadInput
from glotouch_bt.robot import Array

Faces = npt.NDArray[np.int64]
MERGE_M = (1e-6, 1e-5)
"""Corners closer than this are one; the next is tried if edges stay open. Source: rounding of 32 bit floats and of
exporters that scale."""
FRAGMENT_SHARE = 0.005
"""A separate piece with less than this share of the surface is dropped if it is open or lies apart: debris of a scan.
Source: ours."""
MAX_DROPPED_SHARE = 0.05
"""Fragments with more of the surface than this together are no debris, and stay. Source: ours."""
MAX_HOLE_SHARE = 0.30
"""Largest share of the closed surface that may be holes. Source: ours; a box without its largest face is below, a
sheet (half of whose closed surface is hole) is above."""


def repaired(vertices_m: Array, faces: Faces) -> tuple[Array, Faces, tuple[str, ...]]:
    """Return a closed surface, and what was repaired, for a person.

    Raises:
        BadInput: It cannot be closed without inventing a shape. The message has no file name.
    """
    notes: list[str] = []
    vertices, faces = _joined(vertices_m, faces, notes)
    vertices, faces = _without_fragments(vertices, faces, notes)
    vertices, faces = _closed(vertices, faces, notes)
    return vertices, faces, tuple(notes)


def _joined(vertices: Array, faces: Faces, notes: list[str]) -> tuple[Array, Faces]:
    """Join corners, then drop collapsed and repeated triangles."""
    corners, joined = vertices, faces
    for merge_m in MERGE_M:
        _, first, owner = np.unique(np.round(vertices / merge_m), axis=0, return_index=True, return_inverse=True)
        corners, joined = vertices[first], owner.ravel()[faces]
        a, b, c = joined.T
        joined = joined[(a != b) & (b != c) & (c != a)]
        kept = _kept(joined)
        repeated, joined = len(joined) - len(kept), joined[kept]
        if (_edges(joined)[1] == 2).all():
            break
    if len(joined) < 4:
        raise BadInput("holds no solid (its triangles have no area)")
    if repeated:
        notes.append(f"dropped {repeated} repeated triangles")
    return corners, joined


def _kept(faces: Faces) -> npt.NDArray[np.intp]:
    """Return the indices of the triangles to keep of each set on the same corners.

    Where two parts touch face to face, as many look one way as the other: none is kept, and the parts are one. Of
    others one is kept.
    """
    order = np.sort(faces, axis=1)
    _, first, owner = np.unique(order, axis=0, return_index=True, return_inverse=True)
    odd = (faces[:, 0] > faces[:, 1]) ^ (faces[:, 1] > faces[:, 2]) ^ (faces[:, 0] > faces[:, 2])
    net = np.bincount(owner.ravel(), np.where(odd, 1.0, -1.0))
    return np.sort(first[net != 0.0])


def _edges(faces: Faces) -> tuple[Faces, npt.NDArray[np.intp]]:
    """Return the undirected edges (n, 2), and the number of faces at each."""
    return np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0, return_counts=True)


def _without_fragments(vertices: Array, faces: Faces, notes: list[str]) -> tuple[Array, Faces]:
    solid = trimesh.Trimesh(vertices, faces, process=False)
    label = trimesh.graph.connected_component_labels(solid.face_adjacency, node_count=len(faces))
    area = np.bincount(label, solid.area_faces)
    if len(area) == 1:
        return vertices, faces
    low, high = np.full((len(area), 3), np.inf), np.full((len(area), 3), -np.inf)
    np.minimum.at(low, label, solid.triangles.min(axis=1))
    np.maximum.at(high, label, solid.triangles.max(axis=1))
    main = int(np.argmax(area))
    apart = ((low > high[main]) | (high < low[main])).any(axis=1)
    open_edges = trimesh.grouping.group_rows(solid.edges_sorted, require_count=1)
    opened = np.bincount(label[solid.edges_face[open_edges]], minlength=len(area)) > 0
    drop = (area < FRAGMENT_SHARE * area.sum()) & (apart | opened)
    if not drop.any() or area[drop].sum() > MAX_DROPPED_SHARE * area.sum():
        return vertices, faces
    notes.append(f"dropped {drop.sum()} fragments")
    return vertices, faces[~drop[label]]


def _closed(vertices: Array, faces: Faces, notes: list[str]) -> tuple[Array, Faces]:
    """Close each loop of open edges with a fan of triangles about its middle."""
    edges, counts = _edges(faces)
    if (counts > 2).any():
        raise BadInput(
            f"has {(counts > 2).sum()} edges at which three or more faces meet, so its inside is not defined; "
            "make it a solid in a mesh editor"
        )
    open_edges = edges[counts == 1]
    if not len(open_edges):
        return vertices, faces
    loops = _loops(open_edges)
    patches, middles = [faces], [vertices]
    sizes_m: list[float] = []
    for loop in loops:
        around, middle = vertices[loop], len(vertices) + len(sizes_m)
        middles.append(around.mean(axis=0)[None])
        following = np.roll(loop, -1)
        patches.append(np.column_stack([loop, following, np.full(len(loop), middle)]))
        sizes_m.append(float(np.linalg.norm(np.ptp(around, axis=0))))
    vertices, closed = np.concatenate(middles), np.concatenate(patches)
    corners = vertices[closed]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    share = float(area[len(faces) :].sum() / area.sum())
    holes = f"{len(loops)} hole{'s' * (len(loops) != 1)}"
    if share > MAX_HOLE_SHARE:
        raise BadInput(
            f"is not a solid: {share:.0%} of its closed surface would be {holes} (at most {MAX_HOLE_SHARE:.0%}); "
            "give it a thickness, or close it, in a mesh editor"
        )
    notes.append(f"closed {holes} (the largest {max(sizes_m) * 1e3:.1f} mm across, {share:.1%} of the surface)")
    return vertices, closed


def _loops(edges: Faces) -> list[npt.NDArray[np.int64]]:
    """Return the closed loops of undirected edges (n, 2), as corners in order. Loops that meet in a corner are split.

    Raises:
        BadInput: The edges form no loops.
    """
    beside: defaultdict[int, list[int]] = defaultdict(list)
    for a, b in edges.tolist():
        beside[a].append(b)
        beside[b].append(a)
    if any(len(near) % 2 for near in beside.values()):
        raise BadInput("has open edges that surround no hole; close it in a mesh editor")
    loops: list[npt.NDArray[np.int64]] = []
    for start in list(beside):
        walk, at = [start], {start: 0}
        while beside[walk[-1]]:  # every other corner of the walk has an edge left, because their numbers are even
            there = beside[walk[-1]].pop()
            beside[there].remove(walk[-1])
            if there not in at:
                at[there] = len(walk)
                walk.append(there)
                continue
            loops.append(np.array(walk[at[there] :], dtype=np.int64))
            for corner in walk[at[there] + 1 :]:
                del at[corner]
            walk = walk[: at[there] + 1]
    return loops
