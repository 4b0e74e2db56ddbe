"""Model of the errors of a depth map: what the gel's membrane does around a contact, and what its image loses.

Applied in this order to the true indentation d of a pad, (rows, cols):

1. Membrane, outside the contact only: G * d with a Gaussian G (as Taxim smooths a pressed surface outside the contact;
   Si and Yuan, RA-L 2022), less a bulge f D B / max(B), B = d smoothed by 3 mm and D = max(d): the gel keeps its
   volume and rises around a contact.
2. Hysteresis: d + h (m - d) where m = max(d, m exp(-t / tau)) is the remembered indentation.
3. Gain, one number a pad.
4. Smooth error: a Gaussian field, drawn anew when a contact begins and when it ends, because the error of a
   reconstruction depends on its image.
"""

from __future__ import annotations

import math

import numpy as np
import scipy

from glotouch_backends.mujoco.axis_proof import AxisProof
from glotouch_bt.robot import Array, Conditions
from glotouch_bt.robot.scene import stream

BULGE_WIDTH_M = 0.003
"""Width (sd) of the bulge around a contact. Source: ours, about twice the gel's thickness."""
SMOOTH_LENGTH_M = 0.005
"""Correlation length of the smooth error. Source: ours; published depth maps err over regions, not pixels."""
RECOVERY_S = 2.0
"""Time constant in which an unloaded gel recovers. Source: ours; silicone recovers within seconds."""
KERNEL_REACH = 3.5
"""Half width of a smoothing kernel over its sd."""


def gaussian_weights(sd: float) -> Array:
    """Return a Gaussian kernel (2 n + 1,) of sum one; `sd` in taxels, 0 for a kernel that changes nothing."""
    n = math.ceil(KERNEL_REACH * sd)
    weights = np.exp(-0.5 * (np.arange(-n, n + 1) / max(sd, 1e-9)) ** 2)
    return np.asarray(weights / weights.sum())


def smoothed(maps: Array, kernel: tuple[Array, Array]) -> Array:
    """Return maps (n, rows, cols) smoothed along rows and columns; beyond an edge they continue with its values."""
    rows = scipy.ndimage.correlate1d(maps, kernel[0], axis=1, mode="nearest")
    return np.asarray(scipy.ndimage.correlate1d(rows, kernel[1], axis=2, mode="nearest"))


class DepthErrors:
    """Errors of both pads, and what they remember.

    Args:
        conditions, seed: Sizes of the errors, and the source of their draws.
        window_m: (width along x_P, length along z_P) of a pad.
        shape: (rows, cols) of a map.
        proof: Notes which axes altered a map.
    """

    def __init__(
        self,
        conditions: Conditions,
        seed: int,
        window_m: tuple[float, float],
        shape: tuple[int, int],
        proof: AxisProof,
    ) -> None:
        c = conditions
        self._proof = proof
        self._pitch = window_m[1] / shape[0], window_m[0] / shape[1]  # along rows, along columns
        self._blur_sd, self._blur = c.gel_blur_m, self._kernel(c.gel_blur_m)
        self._bulge, self._bulge_kernel = c.gel_bulge_fraction, self._kernel(BULGE_WIDTH_M)
        self._hysteresis = c.tactile_hysteresis_fraction
        self._gain: Array = stream(seed, "tactile gain").uniform(*c.tactile_gain, (2, 1, 1))
        self._smooth_sd = c.tactile_smooth_error_sd_m
        self._smooth_kernel = self._kernel(SMOOTH_LENGTH_M / math.sqrt(2.0))
        self._rng = stream(seed, "smooth depth error")
        self._field: Array = np.zeros((2, *shape))
        self._memory: Array = np.zeros((2, *shape))
        self._felt_s = 0.0
        self._touched = False
        self._draw()

    def _kernel(self, sd_m: float) -> tuple[Array, Array]:
        rows, cols = self._pitch
        return gaussian_weights(sd_m / rows), gaussian_weights(sd_m / cols)

    def feel(self, maps_m: Array, now_s: float) -> None:
        """Note the true indentation (2, rows, cols) at a time; call whenever it was computed anew."""
        if self._hysteresis > 0.0:
            self._memory *= math.exp(-(now_s - self._felt_s) / RECOVERY_S)
            np.maximum(self._memory, maps_m, out=self._memory)
            self._felt_s = now_s
        touched = bool(maps_m.any())
        if touched != self._touched:
            self._touched = touched
            self._draw()

    def shown(self, maps_m: Array) -> Array:
        """Return the maps (2, rows, cols) that the sensor computes for a true indentation."""
        out, saw, inside = maps_m, self._proof.saw, maps_m > 0.0
        if self._touched and not inside.all():
            if self._blur_sd > 0.0:
                before, out = out, np.where(inside, out, smoothed(maps_m, self._blur))
                saw("gel_blur_m", before, out)
            if self._bulge > 0.0:
                around = smoothed(maps_m, self._bulge_kernel)
                top, deepest = around.max(axis=(1, 2)), maps_m.max(axis=(1, 2))
                height = self._bulge * np.divide(deepest, top, out=np.zeros(2), where=top > 0.0)
                before, out = out, np.where(inside, out, out - height[:, None, None] * around)
                saw("gel_bulge_fraction", before, out)
        if self._hysteresis > 0.0:
            lost = np.maximum(self._memory - maps_m, 0.0)
            before, out = out, out + self._hysteresis * lost
            if lost.any():
                saw("tactile_hysteresis_fraction", before, out)
        if self._touched:
            before, out = out, self._gain * out
            saw("tactile_gain", before, out)
        if self._smooth_sd > 0.0:
            before, out = out, out + self._field
            saw("tactile_smooth_error_sd_m", before, out)
        return out

    def _draw(self) -> None:
        """Draw the smooth error of both pads: white noise on a larger area, filtered, of unit variance, and cut out."""
        if self._smooth_sd == 0.0:
            return
        along, across = self._smooth_kernel
        rows, cols = self._field.shape[1:]
        pad = len(along) // 2, len(across) // 2
        white = self._rng.standard_normal((2, rows + 2 * pad[0], cols + 2 * pad[1]))
        unit = math.sqrt(float((along @ along) * (across @ across)))
        self._field[:] = (
            self._smooth_sd / unit * smoothed(white, (along, across))[:, pad[0] : -pad[0], pad[1] : -pad[1]]
        )
