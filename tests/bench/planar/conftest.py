"""Solids whose felt sections are known in closed form, and worlds of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
import trimesh

from glotouch_bt.bench.planar import ContactModel, PlanarWorld, felt_section
from glotouch_bt.robot import Array
from glotouch_bt.robot.scene.meshes import Mesh

TIP = 0.006
HALF = np.array([0.15, 0.20])
IDEAL = ContactModel(localisation_sd_m=0.0, overshoot_m={}, direction_sd_rad=0.0)


def as_mesh(solid: trimesh.Trimesh, name: str = "solid") -> Mesh:
    vertices = np.array(solid.vertices, dtype=np.float64)
    vertices[:, 2] -= vertices[:, 2].min()
    return Mesh(name, vertices, np.array(solid.faces, dtype=np.int64), f"{name} {vertices.tobytes()!r}")


def cylinder(radius: float, height: float = 0.06, name: str = "cylinder") -> Mesh:
    return as_mesh(trimesh.creation.cylinder(radius, height, sections=256), name)


def box(x: float, y: float, z: float = 0.06, name: str = "box") -> Mesh:
    return as_mesh(trimesh.creation.box((x, y, z)), name)


def mushroom(stem: float, cap: float) -> Mesh:
    """A solid of revolution: a stem up to 40 mm, a cap from there to 50 mm."""
    profile = np.array([[0, 0], [stem, 0], [stem, 0.04], [cap, 0.04], [cap, 0.05], [0, 0.05]])
    return as_mesh(trimesh.creation.revolve(profile, sections=256), "mushroom")


def centres_of(world: PlanarWorld) -> Array:
    """True centres (k, 2) of the sections in K."""
    return np.array([world.to_K(i, s.centre_m[None])[0] for i, s in enumerate(world.sections)]).reshape(-1, 2)


WorldOf = Callable[..., PlanarWorld]


@pytest.fixture
def world_of() -> WorldOf:
    def build(
        meshes: Sequence[Mesh], poses: Sequence[Sequence[float]], model: ContactModel = IDEAL, seed: int = 0
    ) -> PlanarWorld:
        sections = [felt_section(m) for m in meshes]
        start: Array = np.array([-0.13, -0.18])
        return PlanarWorld(sections, np.array(poses), HALF, TIP, np.random.default_rng(seed), model, start)

    return build
