"""Ground truth of one trial: the nominal world changed by the conditions. Skills never see it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from glotouch_bt.robot import Array, BadInput, Conditions, Pose, World
from glotouch_bt.robot.scene import Mesh, Placement, draw_layout, load_folder, stream


@dataclass(frozen=True)
class ObjectTruth:
    """One object: its mesh, its place in the true K, its mass, and its friction on the floor."""

    mesh: Mesh
    place: Placement
    mass_kg: float
    friction: float


@dataclass(frozen=True)
class Truth:
    """All random draws of a trial.

    Attributes:
        pose_B_K: True container frame.
        pose_handle_shaft: The shaft frame (origin at the handle's centre) in the handle's frame: identity plus the
            grasp offset, so that the ball is not exactly at its nominal place.
        pad_friction: Friction of the pads.
        objects: In the order of the world's object set.
        fixed: The objects are bolted to the container's floor instead of standing on it.
    """

    pose_B_K: Pose
    pose_handle_shaft: Pose
    pad_friction: float
    objects: tuple[ObjectTruth, ...]
    fixed: bool = False


def rotation_vector(v: Array) -> Pose:
    """Return the pure rotation by the vector v (3,), rad."""
    angle = float(np.linalg.norm(v))
    axis = v / angle if angle > 0.0 else np.array([0.0, 0.0, 1.0])
    quat = np.array([np.cos(0.5 * angle), *(np.sin(0.5 * angle) * axis)])
    return Pose(np.zeros(3), quat / np.linalg.norm(quat))


def _true_container(world: World, conditions: Conditions, rng: np.random.Generator) -> Pose:
    nominal = world.container.pose_B_K
    shift = conditions.registration_sd_m * rng.standard_normal(3)
    yaw = np.deg2rad(conditions.registration_sd_deg) * rng.standard_normal()
    return nominal @ Pose.planar(shift, float(yaw))


def _true_shaft(world: World, conditions: Conditions, rng: np.random.Generator) -> Pose:
    """Draw a tilt about the handle's centre and a shift across the shaft."""
    shift = conditions.tip_offset_sd_m * rng.standard_normal(2)
    tilt = np.deg2rad(conditions.tip_tilt_sd_deg) * rng.standard_normal(2)
    return Pose(np.array([shift[0], shift[1], 0.0])) @ rotation_vector(np.array([tilt[0], tilt[1], 0.0]))


def draw_truth(
    world: World, conditions: Conditions, seed: int, layout: Mapping[str, tuple[float, float, float]] | None = None
) -> Truth:
    """Draw the ground truth of a trial.

    Args:
        world: The nominal world.
        conditions: The disturbances.
        seed: Seed of all draws, with one random stream a purpose.
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
    return Truth(
        pose_B_K=_true_container(world, conditions, stream(seed, "registration")),
        pose_handle_shaft=_true_shaft(world, conditions, stream(seed, "probe")),
        pad_friction=float(stream(seed, "pads").uniform(*conditions.pad_friction)),
        objects=tuple(
            ObjectTruth(m, p, float(mass), float(mu))
            for m, p, mass, mu in zip(meshes, places, masses, frictions, strict=True)
        ),
    )
