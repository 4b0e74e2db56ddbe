"""Where to take hold of a recognised object: at the best closure already felt on it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from glotouch_bt.recognition import Match
from glotouch_bt.robot import Array
from glotouch_bt.robot.meshes import Mesh
from glotouch_bt.touch import Layer, TouchSet, patch_statistics

AREA_SCALE = 0.15
"""Contact area, as a fraction of the pad, that counts as half of a good hold."""
LEVER_SCALE_M = 0.015
"""Distance of the pads from the centre of mass that halves a hold's worth: the object would turn about the pads."""


@dataclass(frozen=True)
class GraspPlan:
    """One grasp.

    Attributes:
        candidate: Index of the candidate.
        position_K_m: (3,) pads' mid-point in K (z above the floor).
        yaw_rad: Direction of x_P in K.
        aperture_m: Opening felt there; the jaws must stop near it.
        opening_m: Opening to go in with.
    """

    candidate: int
    position_K_m: Array
    yaw_rad: float
    aperture_m: float
    opening_m: float


def plan_grasp(touchset: TouchSet, match: Match, mesh: Mesh, side_gap_m: float = 0.010) -> GraspPlan:
    """Choose the stable layer with large two-sided contact nearest to the object's centre of mass.

    The centre of mass comes from the STL placed at the fitted pose; every layer was reached once, so it can be again.
    """
    com = mesh.as_trimesh().center_mass
    x, y, yaw = match.pose_K_O
    c, s = np.cos(yaw), np.sin(yaw)
    com_K = np.array([x + c * com[0] - s * com[1], y + s * com[0] + c * com[1], com[2]])

    def worth(layer: Layer) -> float:
        areas = [patch_statistics(d).area_fraction for d in (layer.left_m, layer.right_m)]
        hold = math.prod([a / (a + AREA_SCALE) for a in areas])
        across = np.array([np.cos(layer.yaw_rad), np.sin(layer.yaw_rad)])
        lever = math.hypot(across @ (com_K[:2] - layer.position_K_m), 0.5 * (com_K[2] - layer.height_m))
        return float(layer.stable) * hold / (1.0 + (lever / LEVER_SCALE_M) ** 2)

    best = max(touchset.layers, key=worth)
    return GraspPlan(
        candidate=touchset.candidate.index,
        position_K_m=np.array([*best.position_K_m, best.height_m]),
        yaw_rad=best.yaw_rad,
        aperture_m=best.aperture_m,
        opening_m=touchset.candidate.contour.size_m[1] + 2 * side_gap_m,
    )
