"""Free objects: collision hulls, foot spheres, inertia of the true solid, and the true mesh for rendering."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np

from glotouch_backends.mujoco.hulls import FOOT_PROTRUSION_M, FOOT_RADIUS_M, foot_centres, load_hulls
from glotouch_backends.mujoco.model.contact import ENVIRONMENT, GROUP_VISUAL, OBJECT, set_category, set_friction
from glotouch_backends.mujoco.model.inertia import uniform_inertia
from glotouch_backends.mujoco.printed import lean_feet, printed_hull
from glotouch_backends.mujoco.truth import ObjectTruth, rotation_vector
from glotouch_bt.robot import Array, Pose
from glotouch_bt.robot.scene import UPRIGHT

COLOURS = (
    (0.85, 0.33, 0.31, 1.0),
    (0.36, 0.62, 0.80, 1.0),
    (0.95, 0.75, 0.25, 1.0),
    (0.47, 0.72, 0.40, 1.0),
    (0.66, 0.51, 0.78, 1.0),
)


def standing(truth: ObjectTruth) -> tuple[Pose | None, Array]:
    """Return how an object stands on its side and its uneven base, and its feet.

    Returns:
        The mesh frame in a frame on the floor below it, or None if both are the same; and foot centres (m, 3) in the
        mesh frame.
    """
    mesh, turn = truth.mesh, Pose(np.zeros(3), np.array(truth.place.quat))
    if truth.place.quat != UPRIGHT:
        turned = turn.apply(mesh.vertices_m)
        turn = Pose(np.array([0.0, 0.0, -turned[:, 2].min()]), turn.quat)
        mesh = replace(mesh, vertices_m=turn.apply(mesh.vertices_m))
    feet = foot_centres(mesh)
    if truth.place.quat == UPRIGHT and truth.lean_rad == 0.0:
        return None, feet
    feet = lean_feet(feet, truth.lean_rad, truth.lean_about_rad)
    axis = np.array([-np.sin(truth.lean_about_rad), np.cos(truth.lean_about_rad), 0.0])
    lean = rotation_vector(truth.lean_rad * axis)
    lowest = np.concatenate([lean.apply(mesh.vertices_m)[:, 2], lean.apply(feet)[:, 2] - FOOT_RADIUS_M]).min()
    raised = Pose(np.array([0.0, 0.0, -lowest - (FOOT_PROTRUSION_M if len(feet) else 0.0)]))
    return raised @ lean @ turn, turn.inverse().apply(feet)


def add_object(spec: mujoco.MjSpec, index: int, truth: ObjectTruth, pose_B_K: Pose, *, fixed: bool = False) -> None:
    """Add the body `object{index}`, standing on the container's floor; its frame is the mesh frame.

    If `fixed`, it has no joint and belongs to the environment.
    """
    category = ENVIRONMENT if fixed else OBJECT
    mesh = truth.mesh
    stands, feet = standing(truth)
    place = pose_B_K @ Pose.planar((truth.place.x_m, truth.place.y_m, FOOT_PROTRUSION_M), truth.place.yaw_rad)
    if stands is not None:
        place = place @ stands
    body = spec.worldbody.add_body(name=f"object{index}", pos=place.position_m, quat=place.quat)
    if not fixed:
        body.add_freejoint(name=f"object{index}")

    centre, inertia = uniform_inertia(mesh, truth.mass_kg)
    body.explicitinertial = True
    body.mass = truth.mass_kg
    body.ipos = centre + truth.com_error_m
    body.fullinertia = (*np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2])

    for k, part in enumerate(load_hulls(truth.stl)):
        vertices = printed_hull(part, truth.scale, truth.offset_m)
        shape = spec.add_mesh(name=f"object{index}_hull{k}", uservert=vertices.ravel())
        geom = body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=shape.name, mass=0.0)
        set_category(geom, category)
        set_friction(geom, truth.friction)
    for centre in feet:
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
