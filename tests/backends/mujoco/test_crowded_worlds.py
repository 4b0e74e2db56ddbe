"""The crowded worlds stand still in MuJoCo: nothing overlaps, nothing is thrown apart."""

from __future__ import annotations

import numpy as np
import pytest

from glotouch_backends.mujoco.backend import RIZON4_XENSE, MujocoOptions, build_world
from glotouch_bt.mission.read import load_world
from glotouch_bt.mission.read.worlds import load_conditions

MAX_OVERLAP_M = 3e-4
"""Contacts of the solver are soft."""
MAX_SETTLING_M = 0.010
"""Of an upright object. Layouts are drawn without the lean: one that leans towards a wall which it touches starts
inside the wall and is pushed out. Measured: 7 mm after an overlap of 1.5 mm (clutter_ten, seed 0)."""


@pytest.mark.parametrize("name", ["touching_five", "clutter_ten"])
def test_a_crowded_world_is_settled(name: str) -> None:
    world = load_world(name)
    for seed in range(3):
        built = build_world(RIZON4_XENSE, world, load_conditions("realistic"), seed, MujocoOptions())
        model, data, bodies = built.model, built.data, built.handles.object_bodies
        pairs = (data.contact[i] for i in range(data.ncon))
        overlaps = [-c.dist for c in pairs if np.isin(model.geom_bodyid[[c.geom1, c.geom2]], bodies).all()]
        assert max(overlaps, default=0.0) < MAX_OVERLAP_M
        places = np.array([(o.place.x_m, o.place.y_m) for o in built.truth.objects])
        in_K = np.array([built.truth.pose_B_K.inverse().apply(data.xpos[b])[:2] for b in bodies])
        upright = np.array([o.place.quat == (1.0, 0.0, 0.0, 0.0) for o in built.truth.objects])
        assert np.linalg.norm(in_K - places, axis=1)[upright].max() < MAX_SETTLING_M
