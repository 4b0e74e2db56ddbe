"""Model of the camera behind a gel: a colour image of the gel's surface, lit from three sides.

For each pad, at the pitch of the image:

1. Rays against the exact mesh give the overlap h of the undeformed gel with the object (as in `gel`). With the shift s
   that the depth map's force balance has found, the gel's surface is indented by x = max(0, h + s).
2. Outside the contact, the membrane follows smoothly: G * x with the Gaussian G of `gel_blur_m`, as for a depth map.
3. Skin and optics resolve the surface to a Gaussian of `image_blur_m`.
4. The unit normal of the surface is n ~ (-dx/du, -dx/dv, 1), with u along the columns and v along the rows. Each light
   lights it by Lambert's law, I = I0 g max(0, l . n), in one colour. The gain g of each light is drawn once a trial.
5. White noise, and 8 bits.

Height map, smoothing, normals and coloured lights as in published simulators of such sensors (D. F. Gomes, P. Paoletti,
S. Luo, "Generation of GelSight Tactile Images for Sim2Real Learning", RA-L 2021; Z. Si, W. Yuan, "Taxim", RA-L 2022).
Left out: shadows cast by the surface, specular light, vignetting, and markers printed on the gel.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from glotouch_backends.mujoco.axis_proof import AxisProof
from glotouch_backends.mujoco.sensing.gel import GelSensor, Side
from glotouch_backends.mujoco.sensing.rays import SurfaceRays
from glotouch_bt.robot import Array, Conditions, GelCamera, GelImages, ImageArray, Pose
from glotouch_bt.robot.scene import stream

BRIGHTNESS = 0.6
"""Brightness, over full scale, of a surface that faces a light of gain one. Source: ours; no pixel saturates."""
FULL_SCALE = 255.0
"""Largest value of a pixel."""


def lit(indentation_m: Array, pitch_m: tuple[float, float], lights: Array) -> Array:
    """Return max(0, l . n) of each light on an indented surface: (rows, cols, 3) in 0..1.

    Args:
        indentation_m: (rows, cols) towards the camera.
        pitch_m: Distance of two pixels (along the columns of numbers, i.e. from row to row; from column to column).
        lights: (3, 3) unit directions, one row a light: along the columns, along the rows, towards the camera.
    """
    along_rows, along_columns = np.gradient(indentation_m, *pitch_m)
    normal = np.stack([-along_columns, -along_rows, np.ones_like(indentation_m)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.maximum(normal @ lights.T, 0.0)


class GelImager:
    """Cameras of both pads of a trial.

    Args:
        camera: Shape of the images and directions of the lights.
        gel: The gel of the trial, with one taxel a pixel.
        conditions, seed: Sizes of the errors, and the source of their draws.
        proof: Notes which axes altered an image.
    """

    def __init__(self, camera: GelCamera, gel: GelSensor, conditions: Conditions, seed: int, proof: AxisProof) -> None:
        self._gel, self._proof = gel, proof
        self._pitch = gel.window_m[1] / gel.shape[0], gel.window_m[0] / gel.shape[1]
        self._lights = camera.directions(right=False), camera.directions(right=True)
        self._membrane_sd_m, self._blur_sd_m = conditions.gel_blur_m, conditions.image_blur_m
        self._noise_sd = conditions.image_noise_sd
        self._gain: Array = stream(seed, "gel lights").uniform(*conditions.image_light_gain, (2, 1, 1, 3))

    def indentation(self, side: Side, surfaces: Sequence[tuple[SurfaceRays, Pose]], shift_m: float) -> Array:
        """Return the indentation (rows, cols), m, of a pad that its force balance has shifted by `shift_m`.

        Args:
            side: Which pad.
            surfaces: Each object's rays and `pose_O_pad`, as for `GelSensor.overlap`.
            shift_m: As `GelSensor.shift` returns it.
        """
        x = np.clip(self._gel.overlap(side, surfaces) + shift_m, 0.0, self._gel.depth_m)
        if self._membrane_sd_m > 0.0:
            x = np.where(x > 0.0, x, self._smoothed(x, self._membrane_sd_m))
        if self._blur_sd_m > 0.0:
            before, x = x, self._smoothed(x, self._blur_sd_m)
            self._proof.saw("image_blur_m", before, x)
        return x

    def flat(self) -> Array:
        """Return the indentation (rows, cols) of a pad that touches nothing."""
        return np.zeros(self._gel.shape)

    def images(self, stamp_s: float, left_m: Array, right_m: Array, rng: np.random.Generator) -> GelImages:
        """Return the images of two indentations; `rng` draws the noise."""
        even = np.stack([lit(x, self._pitch, l) for x, l in zip((left_m, right_m), self._lights, strict=True)])
        shown = self._gain * even
        self._proof.saw("image_light_gain", even, shown)
        shown *= BRIGHTNESS
        if self._noise_sd > 0.0:
            before, shown = shown, shown + self._noise_sd * rng.standard_normal(shown.shape)
            self._proof.saw("image_noise_sd", before, shown)
        pixels: ImageArray = np.rint(np.clip(shown, 0.0, 1.0) * FULL_SCALE).astype(np.uint8)
        return GelImages(stamp_s, pixels[0], pixels[1])

    def _smoothed(self, x: Array, sd_m: float) -> Array:
        sds = sd_m / self._pitch[0], sd_m / self._pitch[1]
        return np.asarray(scipy.ndimage.gaussian_filter(x, sds, mode="nearest"))
