"""Convex decomposition of meshes into collision hulls and foot spheres, with its cache. No MuJoCo."""

from glotouch_backends.mujoco.hulls.decompose import load_hulls
from glotouch_backends.mujoco.hulls.feet import FOOT_PROTRUSION_M, FOOT_RADIUS_M, foot_centres
