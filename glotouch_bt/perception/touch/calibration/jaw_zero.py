"""What the jaws report too much: told by something of known width between the pads, the probe's own handle.

A gripper's zero is off by tenths of a millimetre (CONDITIONS: 0.4 mm nominal, 1 mm harsh) and stays so: every width
felt has the same error. A handle with flat sides of width w, sunk by d_L and d_R into the gels, is felt at an aperture
of w - d_L - d_R; what is reported beyond that is the error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from glotouch_bt.perception.touch.squeeze import temporal_median
from glotouch_bt.perception.touch.values import ZERO_SD_M
from glotouch_bt.robot import Observation

MIN_SUNK_M = 2e-4
"""Less than this in the middle of a pad, and it does not press on the handle's side. At 60 N it is 0.54 mm."""
MEASURED_SD_M = 1e-4
"""What remains: 0.15 mm of noise in 20 reports, 0.05 mm that the tops of rough contacts read differently from flat
ones, 0.02 mm of taxel offset and of the handle's own tolerance."""


@dataclass(frozen=True)
class JawZero:
    """Error of the reported aperture.

    Attributes:
        error_m: Reported minus true aperture; 0 if nobody measured it.
        sd_m: Standard deviation of what remains after subtracting it.
    """

    error_m: float = 0.0
    sd_m: float = ZERO_SD_M


def measured_zero(blocks: Sequence[Observation], width_m: float, pad_shape: tuple[int, int]) -> JawZero:
    """The error while the jaws hold flat sides `width_m` apart that are larger than the pads.

    Args:
        blocks: Observations at rest, tactile frames asked for.
        width_m: True width.
        pad_shape: (rows, cols) of the maps.

    Returns:
        An unmeasured zero if a pad does not show that it is pressed, or if nothing was seen.
    """
    frames = [b.tactile for b in blocks if b.tactile is not None]
    maps = temporal_median(frames, pad_shape)
    if any(np.isfinite(m).mean() < 0.5 for m in maps):
        return JawZero()
    sunk = [float(np.nanmedian(m)) for m in maps]
    if min(sunk) < MIN_SUNK_M:
        return JawZero()
    aperture = float(np.mean([b.gripper.aperture_m for b in blocks]))
    return JawZero(aperture + sum(sunk) - width_m, MEASURED_SD_M)
