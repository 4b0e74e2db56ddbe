"""Free objects: collision hulls, foot spheres, inertia of the true solid, and the true mesh for rendering."""

from __future__ import annotations

import mujoco
import numpy as np

from glotouch_backends.mujoco.hulls import FOOT_PROTRUSION_M, FOOT_RADIUS_M, load_hulls
from glotouch_backends.mujoco.model.contact import ENVIRONMENT, GROUP_VISUAL, OBJECT, set_category, set_friction
from glotouch_backends.mujoco.truth import ObjectTruth
from glotouch_bt.robot import Pose

COLOURS = (
    (0.85, 0.33, 0.31, 1.0),
    (0.36, 0.62, 0.80, 1.0),
    (0.95, 0.75, 0.25, 1.0),
    (0.47, 0.72, 0.40, 1.0),
    (0.66, 0.51, 0.78, 1.0),
)


def add_object(spec: mujoco.MjSpec, index: int, truth: ObjectTruth, pose_B_K: Pose, *, fixed: bool = False) -> None:
    """Add the body `object{index}`, standing on the container's floor; its frame is the mesh frame.

    If `fixed`, it has no joint and belongs to the environment.
    """
    category = ENVIRONMENT if fixed else OBJECT
    mesh = truth.mesh
    place = pose_B_K @ Pose.planar((truth.place.x_m, truth.place.y_m, FOOT_PROTRUSION_M), truth.place.yaw_rad)
    body = spec.worldbody.add_body(name=f"object{index}", pos=place.position_m, quat=place.quat)
    if not fixed:
        body.add_freejoint(name=f"object{index}")

    solid = mesh.as_trimesh()
    solid.density = truth.mass_kg / solid.volume
    inertia = np.asarray(solid.moment_inertia)  # about the centre of mass
    body.explicitinertial = True
    body.mass = truth.mass_kg
    body.ipos = solid.center_mass
    body.fullinertia = (*np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2])

    shape_of = load_hulls(mesh)
    for k, vertices in enumerate(shape_of.vertices):
        shape = spec.add_mesh(name=f"object{index}_hull{k}", uservert=vertices.ravel())
        geom = body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=shape.name, mass=0.0)
        set_category(geom, category)
        set_friction(geom, truth.friction)
    for centre in shape_of.feet:
        geom = body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=centre, size=(FOOT_RADIUS_M, 0.0, 0.0), mass=0.0)
        set_category(geom, category)
        geom.contype, geom.conaffinity = 0, ENVIRONMENT  # feet protrude sideways: they touch floor and walls only
        set_friction(geom, truth.friction)
    skin = spec.add_mesh(
        name=f"object{index}_skin",
        uservert=np.asarray(mesh.vertices_m).ravel(),
        userface=np.asarray(mesh.faces, dtype=np.int32).ravel(),
    )
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=skin.name,
        contype=0,
        conaffinity=0,
        group=GROUP_VISUAL,
        mass=0.0,
        rgba=COLOURS[index % len(COLOURS)],
    )
