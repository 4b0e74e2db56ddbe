"""Analytic solids for the recognition tests, as the fixture `solids`."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from glotouch_bt.perception.touch import TouchSet
from glotouch_bt.robot.scene.meshes import Mesh


def as_mesh(solid: trimesh.Trimesh, name: str = "solid") -> Mesh:
    v = np.array(solid.vertices, dtype=np.float64)
    v[:, 2] -= v[:, 2].min()
    f = np.array(solid.faces, dtype=np.int64)
    return Mesh(name, v, f, hashlib.sha256(v.round(9).tobytes() + f.tobytes()).hexdigest())


def box(x: float, y: float, z: float) -> Mesh:
    return as_mesh(trimesh.creation.box([x, y, z]))


def cylinder(radius: float, height: float) -> Mesh:
    return as_mesh(trimesh.creation.cylinder(radius, height, sections=128))


def sphere(radius: float) -> Mesh:
    return as_mesh(trimesh.creation.icosphere(5, radius))


def cone(radius: float, height: float) -> Mesh:
    return as_mesh(trimesh.creation.cone(radius, height, sections=128))


def moved(mesh: Mesh, yaw: float, x: float, y: float) -> Mesh:
    c, s = np.cos(yaw), np.sin(yaw)
    v = np.array(mesh.vertices_m)
    v[:, :2] = v[:, :2] @ np.array([[c, s], [-s, c]]) + [x, y]
    solid = trimesh.Trimesh(v, mesh.faces, process=False)
    return as_mesh(solid, "moved")


def refined(mesh: Mesh) -> Mesh:
    return as_mesh(mesh.as_trimesh().subdivide().subdivide(), "refined")


@pytest.fixture(scope="session")
def solids():
    return SimpleNamespace(
        as_mesh=as_mesh, box=box, cylinder=cylinder, sphere=sphere, cone=cone, moved=moved, refined=refined
    )


@pytest.fixture(scope="module")
def meshes(solids):
    """Five solids that touch tells apart."""
    return [
        solids.cylinder(0.025, 0.070),
        solids.cone(0.032, 0.080),
        solids.box(0.080, 0.040, 0.060),
        solids.box(0.060, 0.045, 0.060),
        solids.sphere(0.032),
    ]


def changed(touchset: TouchSet, **layer) -> TouchSet:
    """The touches with other values in every layer: name = function of the layer."""
    sequences = tuple(
        replace(s, layers=tuple(replace(l, **{k: v(l) for k, v in layer.items()}) for l in s.layers))
        for s in touchset.sequences
    )
    return replace(touchset, sequences=sequences)
