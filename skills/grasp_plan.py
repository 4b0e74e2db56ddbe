"""Where to take hold of a recognised object: at the best closure already felt on it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from glotouch_bt.recognition import Match
from glotouch_bt.robot import Array
from glotouch_bt.robot.meshes import Mesh
from glotouch_bt.touch import Candidate, Layer, TouchSet, patch_statistics

AREA_SCALE = 0.15
"""Contact area, as a fraction of the pad, that counts as half of a good hold."""
LEVER_SCALE_M = 0.015
"""Distance of the pads from the centre of mass that halves a hold's worth: the object would turn about the pads."""
STALENESS = 0.7
"""What a hold is worth after each later sequence: squeezing turns and shifts the object."""
ALTERNATIVES = 5


@dataclass(frozen=True)
class GraspPlan:
    """One grasp, and what to try if it cannot be made.

    Attributes:
        candidate: Index of the candidate.
        position_K_m: (3,) pads' mid-point in K (z above the floor).
        yaw_rad: Direction of x_P in K.
        aperture_m: Opening felt there; the jaws must stop near it.
        opening_m: Opening to go in with.
        alternatives: Other grasps of the same object, the better ones first.
    """

    candidate: int
    position_K_m: Array
    yaw_rad: float
    aperture_m: float
    opening_m: float
    alternatives: tuple[GraspPlan, ...] = ()


def plan_grasp(touchset: TouchSet, match: Match, mesh: Mesh, side_gap_m: float = 0.010) -> GraspPlan:
    """Rank the stable layers: large two-sided contact, near the centre of mass, felt late; the best, and the next ones.

    The centre of mass comes from the STL placed at the fitted pose; every layer was reached once, so it can be again.
    """
    com = mesh.as_trimesh().center_mass
    x, y, yaw = match.pose_K_O
    c, s = np.cos(yaw), np.sin(yaw)
    com_K = np.array([x + c * com[0] - s * com[1], y + s * com[0] + c * com[1], com[2]])

    def worth(layer: Layer, later: int) -> float:
        areas = [patch_statistics(d).area_fraction for d in (layer.left_m, layer.right_m)]
        hold = math.prod([a / (a + AREA_SCALE) for a in areas])
        across = np.array([np.cos(layer.yaw_rad), np.sin(layer.yaw_rad)])
        lever = math.hypot(across @ (com_K[:2] - layer.position_K_m), 0.5 * (com_K[2] - layer.height_m))
        return float(layer.stable) * hold * STALENESS**later / (1.0 + (lever / LEVER_SCALE_M) ** 2)

    count = len(touchset.sequences)
    rated = [(worth(layer, count - 1 - k), layer) for k, q in enumerate(touchset.sequences) for layer in q.layers]
    rated.sort(key=lambda r: -r[0])
    plans = [
        GraspPlan(
            candidate=touchset.candidate.index,
            position_K_m=np.array([*layer.position_K_m, layer.height_m]),
            yaw_rad=layer.yaw_rad,
            aperture_m=layer.aperture_m,
            opening_m=_extent(touchset.candidate, layer) + 2 * side_gap_m,
        )
        for _, layer in rated[: 1 + ALTERNATIVES]
    ]
    return replace(plans[0], alternatives=tuple(plans[1:]))


def _extent(candidate: Candidate, layer: Layer) -> float:
    """How wide the object was traced across the layer's closing direction, or felt there if that is wider."""
    low, high = candidate.span_m(layer.yaw_rad + 0.5 * np.pi)
    return max(high - low, layer.aperture_m)
