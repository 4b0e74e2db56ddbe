"""Ground truth of one trial: the nominal world changed by the conditions. Skills never see it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from glotouch_backends.mujoco.axis_proof import AxisProof
from glotouch_backends.mujoco.printed import printed_mesh
from glotouch_bt.robot import Array, BadInput, Conditions, Pose, RobotDescription, World, rpy_to_matrix
from glotouch_bt.robot.scene import Mesh, Placement, draw_layout, load_folder, moved_apart, outline, stream


@dataclass(frozen=True)
class ObjectTruth:
    """One object.

    Attributes:
        mesh: The true solid.
        place: Its place in the true K.
        mass_kg: Mass.
        friction: Friction on the floor.
        stl: The solid of its file.
        scale, offset_m: The changes that lead from the file to the true solid; see `printed`.
        com_error_m: (3,) true centre of mass from that of a uniform solid, in the mesh frame.
        lean_rad, lean_about_rad: Lean on its uneven base, and the direction in which its top leans.
    """

    mesh: Mesh
    place: Placement
    mass_kg: float
    friction: float
    stl: Mesh
    scale: float
    offset_m: float
    com_error_m: Array
    lean_rad: float
    lean_about_rad: float


@dataclass(frozen=True)
class Truth:
    """All random draws of a trial.

    Attributes:
        pose_B_K: True container frame.
        pose_handle_shaft: The shaft frame (origin at the handle's centre) in the handle's frame: identity plus the
            grasp offset, so that the ball is not exactly at its nominal place.
        pad_friction: Friction of the pads.
        objects: In the order of the world's object set.
        probe_stiffness_Nm_rad: Of the held probe about x_P and about y_P, infinite if rigid.
        joint_errors_rad: (joints, 3) rotation vector of each joint's frame against the description.
        contact_s, housing_s: Time constants of contacts; see `Conditions`.
        fixed: The objects are bolted to the container's floor instead of standing on it.
    """

    pose_B_K: Pose
    pose_handle_shaft: Pose
    pad_friction: float
    objects: tuple[ObjectTruth, ...]
    probe_stiffness_Nm_rad: tuple[float, float]
    joint_errors_rad: Array
    contact_s: float
    housing_s: float
    fixed: bool = False


def rotation_vector(v: Array) -> Pose:
    """Return the pure rotation by the vector v (3,), rad."""
    angle = float(np.linalg.norm(v))
    axis = v / angle if angle > 0.0 else np.array([0.0, 0.0, 1.0])
    quat = np.array([np.cos(0.5 * angle), *(np.sin(0.5 * angle) * axis)])
    return Pose(np.zeros(3), quat / np.linalg.norm(quat))


def _true_container(world: World, conditions: Conditions, seed: int, proof: AxisProof) -> Pose:
    rng, tilt_rng = stream(seed, "registration"), stream(seed, "floor tilt")
    nominal = world.container.pose_B_K
    shift = conditions.registration_sd_m * rng.standard_normal(3)
    yaw = np.deg2rad(conditions.registration_sd_deg) * rng.standard_normal()
    there = nominal @ Pose.planar(shift, float(yaw))
    if conditions.floor_tilt_sd_deg == 0.0:
        return there
    tilt = np.deg2rad(conditions.floor_tilt_sd_deg) * tilt_rng.standard_normal(2)
    proof.saw("floor_tilt_sd_deg", 0.0, tilt)
    return there @ rotation_vector(np.array([tilt[0], tilt[1], 0.0]))


def _true_shaft(conditions: Conditions, rng: np.random.Generator) -> Pose:
    """Draw a tilt about the handle's centre and a shift across the shaft."""
    shift = conditions.tip_offset_sd_m * rng.standard_normal(2)
    tilt = np.deg2rad(conditions.tip_tilt_sd_deg) * rng.standard_normal(2)
    return Pose(np.array([shift[0], shift[1], 0.0])) @ rotation_vector(np.array([tilt[0], tilt[1], 0.0]))


def _object(
    stl: Mesh,
    place: Placement,
    mass_kg: float,
    friction: float,
    c: Conditions,
    rng: np.random.Generator,
    proof: AxisProof,
) -> ObjectTruth:
    """Draw the shape, the balance and the base of one object; every axis takes its numbers, set or not."""
    scale, offset = float(rng.uniform(*c.object_scale)), float(rng.uniform(*c.object_surface_offset_m))
    com = c.object_com_sd_m * rng.standard_normal(3)
    lean, about = np.deg2rad(float(rng.uniform(*c.object_lean_deg))), float(rng.uniform(-np.pi, np.pi))
    proof.saw("object_scale", stl.vertices_m, scale * stl.vertices_m)
    mesh = printed_mesh(stl, scale, offset)
    proof.saw("object_surface_offset_m", scale * stl.vertices_m, mesh.vertices_m)
    proof.saw("object_com_sd_m", 0.0, com)
    proof.saw("object_lean_deg", 0.0, lean)
    return ObjectTruth(mesh, place, mass_kg, friction, stl, scale, offset, com, float(lean), about)


def _true_outline(truth: ObjectTruth) -> Array:
    """Return the convex outline (n, 2) of an object from above as it stands, before its yaw, anticlockwise."""
    axis = np.array([-np.sin(truth.lean_about_rad), np.cos(truth.lean_about_rad), 0.0])
    stands = rotation_vector(truth.lean_rad * axis) @ Pose(np.zeros(3), np.array(truth.place.quat))
    return outline(replace(truth.mesh, vertices_m=stands.apply(truth.mesh.vertices_m)))


def _probe_stiffness(
    world: World, conditions: Conditions, rng: np.random.Generator, proof: AxisProof
) -> tuple[float, float]:
    """Return the stiffness about x_P and y_P, Nm/rad, that gives the ball's compliance: lever squared over it."""
    stiffness = []
    for axis in ("probe_compliance_across_m_per_N", "probe_compliance_about_m_per_N"):
        compliance = float(rng.uniform(*getattr(conditions, axis)))
        proof.saw(axis, 0.0, compliance)
        stiffness.append(world.probe.grasp_to_tip_m**2 / compliance if compliance > 0.0 else math.inf)
    return stiffness[0], stiffness[1]


def _joint_errors(
    description: RobotDescription, world: World, conditions: Conditions, rng: np.random.Generator, proof: AxisProof
) -> Array:
    """Draw small rotations of the joints' frames that displace P above the box with the given sd along an axis.

    A rotation by e displaces a point at r from the joint by e x r; an isotropic e of sd s gives s |r| sqrt(2 / 3) along
    an axis, in the mean over the directions. The displacements of the joints add up as squares.
    """
    errors = rng.standard_normal((len(description.joints), 3))
    if conditions.kinematic_error_sd_m == 0.0:
        return np.zeros_like(errors)
    place = world.container.pose_B_K.position_m + np.array([0.0, 0.0, world.container.interior_m[2]])
    levers = np.array([pose.position_m for pose in joint_poses(description, description.home_q)]) - place
    errors *= conditions.kinematic_error_sd_m / math.sqrt(2.0 / 3.0 * float((levers * levers).sum()))
    proof.saw("kinematic_error_sd_m", 0.0, errors)
    return errors


def joint_poses(description: RobotDescription, q: Sequence[float]) -> list[Pose]:
    """Return the frame in B of each joint, before its rotation."""
    pose, frames = Pose(np.zeros(3)), []
    for joint, angle in zip(description.joints, q, strict=True):
        pose = pose @ Pose.from_matrix(joint.origin_m, rpy_to_matrix(joint.origin_rpy_rad))
        frames.append(pose)
        pose = pose @ rotation_vector(angle * np.asarray(joint.axis))
    return frames


def _softness(axis: str, conditions: Conditions, seed: int, proof: AxisProof) -> float:
    """Draw a time constant."""
    drawn = float(stream(seed, axis).uniform(*getattr(conditions, axis)))
    proof.saw(axis, getattr(Conditions(), axis)[0], drawn)
    return drawn


def draw_truth(
    description: RobotDescription,
    world: World,
    conditions: Conditions,
    seed: int,
    proof: AxisProof,
    layout: Mapping[str, tuple[float, float, float]] | None = None,
) -> Truth:
    """Draw the ground truth of a trial.

    Args:
        description: The robot as it is believed to be.
        world: The nominal world.
        conditions: The disturbances.
        seed: Seed of all draws, with one random stream a purpose.
        proof: Notes which axes alter the world.
        layout: (x m, y m, yaw rad) in K of every object by name, instead of random places.

    Raises:
        BadInput: A mesh is not usable, the objects do not fit, or the layout leaves one out.
    """
    meshes = load_folder(world.objects.folder, world.objects.names)
    if layout is None:
        places = draw_layout(meshes, world, seed)
    else:
        missing = [m.name for m in meshes if m.name not in layout]
        if missing:
            raise BadInput(
                f"option layout: no place for {', '.join(missing)} (it names {', '.join(layout) or 'nothing'})"
            )
        places = [Placement(*layout[m.name]) for m in meshes]
    rng = stream(seed, "objects")
    masses = rng.uniform(*conditions.object_mass_kg, len(meshes))
    frictions = rng.uniform(*conditions.object_friction, len(meshes))
    objects = [
        _object(m, p, float(mass), float(mu), conditions, stream(seed, f"object {m.name}"), proof)
        for m, p, mass, mu in zip(meshes, places, masses, frictions, strict=True)
    ]
    if layout is None:
        apart = moved_apart([_true_outline(o) for o in objects], places, world.container.interior_m[:2])
        objects = [replace(o, place=p) for o, p in zip(objects, apart, strict=True)]
    return Truth(
        pose_B_K=_true_container(world, conditions, seed, proof),
        pose_handle_shaft=_true_shaft(conditions, stream(seed, "probe")),
        pad_friction=float(stream(seed, "pads").uniform(*conditions.pad_friction)),
        objects=tuple(objects),
        probe_stiffness_Nm_rad=_probe_stiffness(world, conditions, stream(seed, "probe compliance"), proof),
        joint_errors_rad=_joint_errors(description, world, conditions, stream(seed, "kinematics"), proof),
        contact_s=_softness("contact_softness_s", conditions, seed, proof),
        housing_s=_softness("housing_softness_s", conditions, seed, proof),
    )
