"""Missions with objects that make their runs short."""

from __future__ import annotations

import json
from dataclasses import replace

import trimesh

from glotouch_bt.campaign import Campaign
from glotouch_bt.mission import load_mission
from glotouch_bt.robot import BadInput

PLACE_PARAMETERS = frozenset({"x", "y", "width"})
"""Parameters of a mission that grasps at a given place."""
BLOCK_M = (0.05, 0.04, 0.06)
"""Size of the block, m."""
AT_MM = (20.0, 50.0)
"""Place of the block in the container, mm along x_K and y_K."""


def block_scene(mission: str, base: Campaign) -> Campaign:
    """Return the campaign of a mission with one block at a known place; the block's STL is in the folder of `base`.

    Raises:
        BadInput: The mission cannot be run so, or the STL cannot be written.
    """
    x, y = AT_MM
    settings = {"layout": json.dumps({"block": [x / 1e3, y / 1e3, 0.0]})}
    if load_mission(mission, {}).parameters.keys() >= PLACE_PARAMETERS:
        settings |= {"x": f"{x:g}", "y": f"{y:g}", "width": f"{1e3 * BLOCK_M[1]:g}"}
    folder = base.out / "block"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        trimesh.creation.box(BLOCK_M).export(folder / "block.stl")
    except OSError as e:
        raise BadInput(f"{folder}: the block cannot be written there ({e.strerror})") from e
    return replace(base, mission=mission, settings={**settings, **base.settings}, objects=folder)
