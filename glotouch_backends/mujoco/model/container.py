"""The container as five boxes at its true pose, and the table below it."""

from __future__ import annotations

import mujoco

from glotouch_backends.mujoco.model.contact import ENVIRONMENT, set_category, set_friction
from glotouch_bt.robot import Container, Pose

FLOOR_COLOUR, WALL_COLOUR, TABLE_COLOUR = (0.55, 0.47, 0.38, 1.0), (0.62, 0.54, 0.44, 0.45), (0.88, 0.88, 0.86, 1.0)


def add_container(spec: mujoco.MjSpec, container: Container, pose_B_K: Pose) -> None:
    """Add the body `container` with geoms `floor` and `wall_*`, and the plane `table` below it.

    The floor has no friction: MuJoCo uses the larger of two frictions, so each object sets its own friction on the
        floor.
    """
    lx, ly, height = (0.5 * s for s in container.interior_m)
    t = 0.5 * container.wall_m
    body = spec.worldbody.add_body(name="container", pos=pose_B_K.position_m, quat=pose_B_K.quat)
    boxes = {
        "floor": ((0.0, 0.0, -t), (lx + 2 * t, ly + 2 * t, t)),
        "wall_x0": ((-lx - t, 0.0, height), (t, ly + 2 * t, height)),
        "wall_x1": ((lx + t, 0.0, height), (t, ly + 2 * t, height)),
        "wall_y0": ((0.0, -ly - t, height), (lx, t, height)),
        "wall_y1": ((0.0, ly + t, height), (lx, t, height)),
    }
    for name, (centre, half) in boxes.items():
        colour = FLOOR_COLOUR if name == "floor" else WALL_COLOUR
        geom = body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_BOX, pos=centre, size=half, rgba=colour)
        set_category(geom, ENVIRONMENT)
        set_friction(geom, 0.0)
    table = spec.worldbody.add_geom(
        name="table",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        pos=(0.0, 0.0, float(container.pose_B_K.position_m[2]) - container.wall_m),
        size=(1.5, 1.5, 0.1),
        rgba=TABLE_COLOUR,
    )
    set_category(table, ENVIRONMENT)
    set_friction(table, 0.5)
