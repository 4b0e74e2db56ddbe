"""Draw a solid as a shaded picture. Rays find the surface, so neither a display nor OpenGL is needed."""

from __future__ import annotations

import io

import numpy as np
import PIL.Image

from glotouch_bt.objects.jaws import JawFit
from glotouch_bt.robot import Array
from glotouch_bt.robot.scene import Mesh

PIXELS, SMALL_PIXELS = 240, 72
"""Width and height of a picture, and of one among many."""
SAMPLES = 2
"""Rays a pixel along each side."""
AZIMUTH_RAD, ELEVATION_RAD = np.deg2rad(-60.0), np.deg2rad(25.0)
"""Direction from which the picture is taken."""
COLOUR = np.array([96.0, 140.0, 190.0])
"""Colour of the surface in full light."""
FITS, TOO_WIDE, NOTHING = (120, 180, 120), (214, 106, 96), (225, 225, 225)
"""Colours of the map of the jaws."""
CELL_PIXELS = 5
"""Width and height of a cell of the map."""


def picture(mesh: Mesh, pixels: int = PIXELS) -> bytes:
    """Return a square PNG of a solid, seen from the side and a little from above."""
    ca, sa, ce, se = (f(x) for x in (AZIMUTH_RAD, ELEVATION_RAD) for f in (np.cos, np.sin))
    toward = np.array([ca * ce, sa * ce, se])  # from the solid to the eye
    right, up = np.array([-sa, ca, 0.0]), np.array([-ca * se, -sa * se, ce])
    solid = mesh.as_trimesh()
    seen = np.column_stack([mesh.vertices_m @ right, mesh.vertices_m @ up])
    low, high = seen.min(axis=0), seen.max(axis=0)
    side = 1.1 * float((high - low).max())
    n = pixels * SAMPLES
    step = (np.arange(n) + 0.5) / n - 0.5
    u, v = np.meshgrid(0.5 * (low + high)[0] + side * step, 0.5 * (low + high)[1] - side * step)
    far = 2.0 * float(np.abs(mesh.vertices_m).max()) + 1.0
    origins = u.reshape(-1, 1) * right + v.reshape(-1, 1) * up + far * toward
    hit = solid.ray.intersects_first(origins, np.tile(-toward, (len(origins), 1)))
    light = np.array([-sa, ca, 0.0]) * -0.35 + up * 0.5 + toward * 0.8
    shade = np.clip(solid.face_normals[hit] @ (light / np.linalg.norm(light)), 0.0, 1.0)
    colours = np.where((hit >= 0)[:, None], COLOUR * (0.35 + 0.65 * shade)[:, None] + 30.0 * shade[:, None] ** 8, 255.0)
    averaged = colours.reshape(pixels, SAMPLES, pixels, SAMPLES, 3).mean(axis=(1, 3))
    return _png(np.clip(averaged, 0.0, 255.0))


def jaw_map(fit: JawFit) -> bytes:
    """Return a PNG of the jaws' fit: yaw to the right, height upwards."""
    cells = np.where(
        fit.fits[..., None], FITS, np.where(np.isfinite(fit.opening_m)[..., None], TOO_WIDE, NOTHING)
    )  # (yaws, heights, 3)
    image = cells.transpose(1, 0, 2)[::-1]
    return _png(image.repeat(CELL_PIXELS, axis=0).repeat(CELL_PIXELS, axis=1))


def _png(pixels: Array) -> bytes:
    buffer = io.BytesIO()
    PIL.Image.fromarray(pixels.astype(np.uint8)).save(buffer, "png", optimize=True)
    return buffer.getvalue()
