"""A solid differs from its mirror image in which pad feels what, never in the widths at one yaw."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from glotouch_bt.perception.recognition import TargetModel
from glotouch_bt.perception.recognition.model.raster import mirrored

HEIGHT_M = 0.07
CORNERS_M = np.array([[-0.030, -0.016], [0.030, -0.016], [-0.009, 0.034]])


def prism(solids, corners_m: np.ndarray, name: str):
    """An upright prism over a triangle."""
    solid = trimesh.convex.convex_hull(
        np.vstack([np.column_stack([corners_m, np.full(3, z)]) for z in (0.0, HEIGHT_M)])
    )
    return solids.as_mesh(solid, name)


@pytest.fixture(scope="module")
def pair(solids):
    """Over a scalene triangle, and its mirror image."""
    return tuple(prism(solids, CORNERS_M * [1.0, side], f"prism{side}") for side in (1.0, -1.0))


def test_widths_of_a_mirror_image_are_those_at_the_opposite_yaw_with_the_pads_swapped(pair) -> None:
    """y -> -y turns a closure at yaw phi into one at -phi, place and width kept, left for right: exact, so that all
    closures at one yaw leave only the pads' sides to tell, up to the unknown yaw of the object."""
    one, other = (TargetModel.from_mesh(m) for m in pair)
    opposite = -np.arange(len(one.phi_rad)) % len(one.phi_rad)
    np.testing.assert_allclose(one.l_m, other.l_m)
    both = np.isfinite(one.width_m) & np.isfinite(other.width_m[opposite])
    assert both.mean() > 0.3
    np.testing.assert_allclose(one.width_m[both], other.width_m[opposite][both], atol=1e-5)
    np.testing.assert_allclose(
        np.nan_to_num(one.reach_m)[both], np.nan_to_num(mirrored(other.reach_m)[opposite])[both], atol=1e-5
    )
