"""Pictures of the simulated world. Needs OpenGL (MUJOCO_GL=egl works without a display).

Only what draws imports this module; a mission does not.
"""

from __future__ import annotations

import mujoco
import numpy as np
import numpy.typing as npt

from glotouch_backends.mujoco.robot import MujocoRobot
from glotouch_bt.robot import BackendError, UnknownName

# (body to look at, height above it m, distance m, azimuth deg, elevation deg)
CAMERAS: dict[str, tuple[str, float, float, float, float]] = {
    "overview": ("container", 0.17, 1.12, 142.0, -27.0),
    "whole": ("container", 0.34, 1.75, 142.0, -14.0),
    "container": ("container", 0.05, 0.72, 150.0, -38.0),
    "above": ("container", 0.0, 0.75, 180.0, -89.0),
    "holder": ("holder", 0.0, 0.45, 120.0, -15.0),
    "hand": ("hand", -0.15, 0.5, 120.0, -10.0),
}


def render(robot: MujocoRobot, width: int = 960, height: int = 720, camera: str = "overview") -> npt.NDArray[np.uint8]:
    """Return a picture (height, width, 3), RGB, of the present world.

    Raises:
        UnknownName: There is no such camera.
        BackendError: OpenGL is not available.
    """
    if camera not in CAMERAS:
        raise UnknownName("camera", camera, CAMERAS)
    body, above_m, distance, azimuth, elevation = CAMERAS[camera]
    view = mujoco.MjvCamera()
    view.lookat[:] = robot.data.body(body).xpos
    view.lookat[2] += above_m
    view.distance, view.azimuth, view.elevation = distance, azimuth, elevation
    option = mujoco.MjvOption()
    option.geomgroup[:] = 1
    for g in np.flatnonzero(
        (robot.model.geom_group == 3) & np.isin(robot.model.geom_bodyid, robot.handles.object_bodies)
    ):
        robot.model.geom_rgba[g, 3] = 0.0  # hide hulls and feet, show the true mesh
    try:
        with mujoco.Renderer(robot.model, height, width) as renderer:
            renderer.update_scene(robot.data, view, option)
            return np.array(renderer.render())
    except Exception as e:  # each OpenGL platform raises its own error
        raise BackendError(f"no picture: OpenGL is not available ({e})") from e
