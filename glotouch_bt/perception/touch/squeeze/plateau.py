"""Aperture plateau of a closure and its evidence layer (paper IV-A)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from glotouch_bt.perception.touch.squeeze.object_motion import ObjectMotion
from glotouch_bt.perception.touch.squeeze.patches import temporal_median
from glotouch_bt.perception.touch.values import PAD_NOISE_M, Layer
from glotouch_bt.robot import Array, Observation, ParamError

DURATION_S = 0.1
"""Minimum duration of a plateau. Source: six periods of a 60 Hz tactile sensor."""
TOLERANCE_M = 0.00025
"""Maximum aperture drift: difference between the means of the halves, beyond what the scatter explains. Source:
aperture noise of the harsh conditions with a margin."""
FORCE_FRACTION = 0.7
"""Minimum fraction of the commanded jaw force; an empty closure does not reach it."""
ARM_M = 0.0005
"""Maximum motion of the pads' mid-point. Source: half a pad pixel."""
EMPTY_M = 0.003
"""Apertures below this mean empty jaws. Source: aperture bias of the harsh conditions."""


@dataclass(frozen=True)
class Plateau:
    """End of a closure.

    Attributes:
        stable: All conditions hold.
        aperture_m: Median aperture.
        force_N: Median jaw force.
        start_s: Robot clock at the start of the plateau.
        why_not: The failed condition; "" if stable.
    """

    stable: bool
    aperture_m: float
    force_N: float
    start_s: float
    why_not: str


def find_plateau(blocks: Sequence[Observation], force_N: float) -> Plateau:
    """Evaluate the last `DURATION_S` of a closure commanded with jaw force `force_N`.

    Raises:
        ParamError: No blocks.
    """
    if not blocks:
        raise ParamError("blocks", 0, "at least one observation")
    end = blocks[-1].now_s
    window = [b for b in blocks if b.now_s > end - DURATION_S + 1e-9]
    aperture = np.array([b.gripper.aperture_m for b in window])
    force = np.array([b.gripper.force_N for b in window])
    start = float(window[0].stamp_s[0])
    half = len(aperture) // 2
    drift = scatter = 0.0
    if half:
        drift = abs(float(np.mean(aperture[half:]) - np.mean(aperture[:half])))
        scatter = 2.0 * float(np.std(np.diff(aperture))) / np.sqrt(len(aperture))
    positions = np.concatenate([b.position_B_P for b in window])
    moved = float(np.max(np.linalg.norm(positions - positions[-1], axis=1)))
    felt = float(np.median(force))
    opening = float(np.median(aperture))
    first = float(blocks[0].stamp_s[0])
    if end - first < 0.8 * DURATION_S:
        why = f"watched for {end - first:.3f} s only"
    elif drift > TOLERANCE_M + scatter:
        why = f"aperture still drifts by {1e3 * drift:.2f} mm"
    elif felt < FORCE_FRACTION * force_N:
        why = f"jaw force {felt:.1f} N of {force_N:.1f} N"
    elif opening < EMPTY_M:
        why = f"jaws met at {1e3 * opening:.1f} mm"
    elif moved > ARM_M:
        why = f"the arm moved {1e3 * moved:.2f} mm"
    else:
        why = ""
    return Plateau(not why, opening, felt, start, why)


def make_layer(
    blocks: Sequence[Observation],
    *,
    height_m: float,
    position_K_m: Array,
    yaw_rad: float,
    force_N: float,
    pad_shape: tuple[int, int],
    object_motion: ObjectMotion | None = None,
    noise_m: tuple[float, float] = (PAD_NOISE_M, PAD_NOISE_M),
    relief: Array | None = None,
) -> Layer:
    """Build a `Layer` from one closure: aperture and force on the plateau, median maps of the frames TAKEN during it.

    Args:
        blocks: Observations of the closure, oldest first, with tactile frames.
        height_m: Pads' mid-point above the floor.
        position_K_m: (2,) pads' mid-point in K.
        yaw_rad: Direction of x_P in K.
        force_N: Commanded jaw force.
        pad_shape: (rows, cols) of the maps.
        object_motion: Motion of the object during the closure, if estimated.
        noise_m, relief: As in `Layer`.

    Raises:
        ParamError: No blocks, or maps of another shape.
    """
    plateau = find_plateau(blocks, force_N)
    frames = [b.tactile for b in blocks if b.tactile is not None]
    # Frames arrive late: select by their stamp; use the newest if none was taken on the plateau.
    on_plateau = [f for f in frames if f.stamp_s >= plateau.start_s] or frames[-1:]
    left, right = temporal_median(on_plateau, pad_shape)
    return Layer(
        height_m=height_m,
        aperture_m=plateau.aperture_m,
        position_K_m=np.asarray(position_K_m, dtype=np.float64)[:2],
        yaw_rad=yaw_rad,
        left_m=left,
        right_m=right,
        force_N=plateau.force_N,
        stable=plateau.stable,
        why_not=plateau.why_not,
        slide_m=math.nan if object_motion is None else object_motion.slide_m,
        turn_rad=math.nan if object_motion is None else object_motion.turn_rad,
        compliance_m=math.nan if object_motion is None else object_motion.compliance_m,
        noise_m=noise_m,
        relief=relief,
    )
