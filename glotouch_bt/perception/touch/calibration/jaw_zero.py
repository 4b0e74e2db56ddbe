"""Zero error of the jaws, measured on an object of known width: the probe's handle.

A gripper's zero has a constant error (at most 0.4 mm in conditions/nominal.yaml, 1 mm in harsh.yaml) that shifts every
measured width. A flat handle of width w that indents the gels by d_L and d_R is held at a true aperture of
w - d_L - d_R.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from glotouch_bt.perception.touch.squeeze import temporal_median
from glotouch_bt.perception.touch.values import ZERO_SD_M
from glotouch_bt.robot import Observation

MIN_INDENTATION_M = 2e-4
"""Minimum median indentation of a pad in contact with the handle. Source: 0.54 mm at 60 N."""
MEASURED_SD_M = 1e-4
"""Standard deviation of the measured zero: 0.15 mm noise in 20 reports, 0.05 mm between rough and flat contacts,
0.02 mm of taxel offset and handle tolerance."""


@dataclass(frozen=True)
class JawZero:
    """Error of the reported aperture.

    Attributes:
        error_m: Reported minus true aperture; 0 if not measured.
        sd_m: Standard deviation of the error after the correction.
    """

    error_m: float = 0.0
    sd_m: float = ZERO_SD_M


def measured_zero(blocks: Sequence[Observation], width_m: float, pad_shape: tuple[int, int]) -> JawZero:
    """Measure the zero while the jaws hold flat sides `width_m` apart that are larger than the pads.

    Args:
        blocks: Observations at rest, with tactile frames.
        width_m: True width.
        pad_shape: (rows, cols) of the maps.

    Returns:
        The measured zero, or the default if a pad shows no contact.
    """
    frames = [b.tactile for b in blocks if b.tactile is not None]
    maps = temporal_median(frames, pad_shape)
    if any(np.isfinite(m).mean() < 0.5 for m in maps):
        return JawZero()
    indentation = [float(np.nanmedian(m)) for m in maps]
    if min(indentation) < MIN_INDENTATION_M:
        return JawZero()
    aperture = float(np.mean([b.gripper.aperture_m for b in blocks]))
    return JawZero(aperture + sum(indentation) - width_m, MEASURED_SD_M)
