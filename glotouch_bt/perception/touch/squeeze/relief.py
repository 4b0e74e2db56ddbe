"""Fine relief of a touched surface (edges, ridges, grooves, texture) from colour images of the gel.

Photometric stereo (R. J. Woodham, 1980): on a matt surface, the brightness over that of the untouched, flat gel is
r = (l . n) / l_w for a light in the direction l, with w the normal of the flat gel. Three lights give the unit normal
n, and so the slopes. The division removes the brightness of each light.

Relief is what is left of the slopes without the object's shape: they are smoothed to `RESOLVED_M`, and their mean over
`SHAPE_M` is subtracted. Its power is averaged in 7 x 5 blocks, as a recogniser does not know the place of a groove
better than some millimetres. The same function measures a predicted surface.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import scipy

from glotouch_bt.robot import Array, GelImages, Gripper, ImageArray, Observation, ParamError

BLOCKS = (7, 5)
"""Rows and columns of blocks of a relief; those of a pooled depth map."""
RESOLVED_M = 0.3e-3
"""Slopes are smoothed by a Gaussian of this sd. Source: ours, half a millimetre is resolved, noise of pixels is not."""
SHAPE_M = 1.2e-3
"""Slopes smoothed by a Gaussian of this sd are shape, not relief. Source: ours; a groove of 2 mm remains, most of the
curvature of a wall of 10 mm radius does not."""
UNTOUCHED_M = 2e-3
"""The untouched gel is flat, so its image is smoothed by a Gaussian of this sd against noise. Source: ours."""
MIN_FACING = 0.1
"""Least cosine between a surface and the camera: steeper slopes are clipped to those of this one. Source: ours."""


def slopes_of_image(image: ImageArray, untouched: Array, lights: Array) -> Array:
    """Return the slopes (2, rows, cols) of the gel's surface towards the camera: along the rows' axis, along columns.

    Args:
        image: (rows, cols, 3).
        untouched: (rows, cols, 3) image of the flat gel, smooth and positive.
        lights: (3, 3) unit directions, one row a light: along the columns, along the rows, towards the camera.
    """
    ratio = image / untouched
    normal = (ratio * lights[:, 2]) @ np.linalg.inv(lights).T
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-9)
    facing = np.maximum(normal[..., 2], MIN_FACING)
    return np.stack([-normal[..., 1] / facing, -normal[..., 0] / facing])


def relief_power(slopes: npt.NDArray[np.floating], pitch_m: tuple[float, float]) -> Array:
    """Return the mean square of the relief's slopes in each block, (..., 2, 7, 5).

    Args:
        slopes: (..., 2, rows, cols) along the rows' axis, along columns.
        pitch_m: Distance of two cells (from row to row, from column to column).
    """
    resolved, shape = (_smoothed(slopes, sd_m, pitch_m) for sd_m in (RESOLVED_M, SHAPE_M))
    return _block_means((resolved - shape) ** 2)


def relief_of_surface(indentation_m: npt.NDArray[np.floating], pitch_m: tuple[float, float]) -> Array:
    """Return the RMS slope (..., 2, 7, 5) of the relief of an indented surface (..., rows, cols)."""
    slopes = np.stack(np.gradient(indentation_m, *pitch_m, axis=(-2, -1)), axis=-3)
    return np.asarray(np.sqrt(relief_power(slopes, pitch_m)))


def relief_of_images(pressed: GelImages, untouched: GelImages, gripper: Gripper) -> Array:
    """Return the RMS slope of the relief in each block of both pads' images, less that of noise.

    Args:
        pressed: Images during a closure.
        untouched: Images of the same pads when they touched nothing.
        gripper: The hand.

    Returns:
        (2, 2, 7, 5): left and right pad; along z_P and along x_P; rows; columns.

    Raises:
        ParamError: The gripper has no camera, or the images have another shape than its.
    """
    pitch_m, camera = gripper.image_pitch_m, gripper.camera
    assert camera is not None  # or there was no pitch
    shape = (*camera.shape, 3)
    for image in (pressed.left, pressed.right, untouched.left, untouched.right):
        if image.shape != shape:
            raise ParamError("images", image.shape, f"of shape {shape}")
    powers = []
    for touched, free, right in ((pressed.left, untouched.left, False), (pressed.right, untouched.right, True)):
        lights = camera.directions(right=right)
        sds = UNTOUCHED_M / pitch_m[0], UNTOUCHED_M / pitch_m[1], 0.0
        flat = np.maximum(scipy.ndimage.gaussian_filter(free.astype(np.float64), sds, mode="nearest"), 1.0)
        noise = relief_power(slopes_of_image(free, flat, lights), pitch_m)
        power = relief_power(slopes_of_image(touched, flat, lights), pitch_m)
        powers.append(np.maximum(power - np.median(noise, axis=(1, 2), keepdims=True), 0.0))
    return np.asarray(np.sqrt(np.stack(powers)))


def relief_of_closure(before: Sequence[Observation], pressed: Sequence[Observation], gripper: Gripper) -> Array | None:
    """Return the relief of the last images of a closure, as `relief_of_images`; None if images are missing.

    Args:
        before: Observations from the open jaws on, with images of the untouched gels.
        pressed: Observations while the jaws press.
        gripper: The hand.
    """
    free = [o.images for o in before if o.images is not None]
    felt = [o.images for o in pressed if o.images is not None]
    return relief_of_images(felt[-1], free[0], gripper) if free and felt else None


def _smoothed(fields: npt.NDArray[np.floating], sd_m: float, pitch_m: tuple[float, float]) -> npt.NDArray[np.floating]:
    still = (0.0,) * (fields.ndim - 2)
    sds = (*still, sd_m / pitch_m[0], sd_m / pitch_m[1])
    return np.asarray(scipy.ndimage.gaussian_filter(fields, sds, mode="nearest"))


def _block_means(fields: npt.NDArray[np.floating]) -> Array:
    """Return the means (..., 7, 5) of blocks of fields (..., rows, cols)."""
    out = np.asarray(fields, dtype=np.float64)
    for axis, blocks in ((-2, BLOCKS[0]), (-1, BLOCKS[1])):
        n = out.shape[axis]
        edges = np.rint(np.linspace(0, n, blocks + 1)).astype(np.int64)
        total = np.add.reduceat(out, edges[:-1], axis=axis)
        size = np.diff(edges).reshape((-1, 1) if axis == -2 else (-1,))
        out = total / size
    return out
