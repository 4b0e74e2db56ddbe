"""Distances along rays to an object's true surface: one embree scene a mesh, in the object's own frame.

Rays are transformed into the mesh frame O, so that a moving object needs no new scene. Embree works in float32. The
mesh is centred and scaled to unit size first, which keeps the error of a distance of 0.1 m below 1e-7 m (tested against
spheres and boxes).
"""

from __future__ import annotations

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh

from glotouch_backends.mujoco.printed import Roughness
from glotouch_bt.robot import Array, ParamError
from glotouch_bt.robot.scene import Mesh


class SurfaceRays:
    """Ray queries against one mesh; 700 rays take about 0.1 ms.

    Args:
        mesh: The smooth surface.
        roughness: Heights above it; a ray meets a hill earlier by its height.

    Attributes:
        centre_O_m: (3,) centre of the bounding box, in the mesh frame.
        radius_m: Radius of the ball around that centre that contains every vertex.
    """

    def __init__(self, mesh: Mesh, roughness: Roughness | None = None) -> None:
        self._roughness = roughness
        lower, upper = mesh.vertices_m.min(axis=0), mesh.vertices_m.max(axis=0)
        self.centre_O_m: Array = 0.5 * (lower + upper)
        self.radius_m = float(np.linalg.norm(mesh.vertices_m - self.centre_O_m, axis=1).max())
        self._per_m = 1.0 / self.radius_m
        vertices = ((mesh.vertices_m - self.centre_O_m) * self._per_m).astype(np.float32)
        # robust: no ray passes between two triangles at their shared edge
        self._scene = rtcore_scene.EmbreeScene(robust=True)
        TriangleMesh(self._scene, np.ascontiguousarray(vertices[mesh.faces]))

    def heights(self, origins_O: Array, direction_O: Array) -> Array:
        """Return the distance from each origin to the first surface that the ray ENTERS.

        A ray that starts inside the solid counts as a miss: a taxel that is buried to its root does not see the
            surface.

        Args:
            origins_O: (n, 3) ray origins in the mesh frame, m.
            direction_O: (3,) unit direction common to all rays, in the mesh frame.

        Returns:
            (n,) distances in m, +inf for a miss.

        Raises:
            ParamError: The direction is not a unit vector, or the origins are not (n, 3).
        """
        if origins_O.ndim != 2 or origins_O.shape[1] != 3:
            raise ParamError("origins_O", origins_O.shape, "an array of shape (n, 3)")
        if not abs(float(direction_O @ direction_O) - 1.0) < 1e-6:
            raise ParamError("direction_O", direction_O.tolist(), "a unit vector")
        origins = np.ascontiguousarray((origins_O - self.centre_O_m) * self._per_m, dtype=np.float32)
        directions = np.tile(direction_O.astype(np.float32), (len(origins), 1))
        hit = self._scene.run(origins, directions, output=1)
        entered = (hit["primID"] >= 0) & (hit["Ng"] @ directions[0] < 0.0)
        distance = hit["tfar"].astype(np.float64) * self.radius_m
        if self._roughness is not None and entered.any():
            distance[entered] -= self._roughness.at(origins_O[entered] + distance[entered, None] * direction_O)
        return np.where(entered, distance, np.inf)
