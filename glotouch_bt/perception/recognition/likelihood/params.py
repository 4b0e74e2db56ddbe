"""Spreads of the likelihood: one frozen set for every object. Sources: docs/explanation/recognition.md."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from glotouch_bt.robot import ParamError


@dataclass(frozen=True, kw_only=True)
class LikelihoodParams:
    """Nuisance, noise, tempering and prior.

    Attributes:
        width_sd_m: Scale of a rigid width about the prediction at the right pose (Student's t).
        width_rough: Share of the table's unevenness that is added to it: a pose lies between the cells.
        width_outlier: Probability that a width has nothing to do with the prediction.
        width_range_m: Such a width is uniform over this.
        bias_span, bias_steps: Aperture bias, one a TouchSet: tried to so many of its standard deviations.
        shift_sd_m, shift_limit_m, shift_steps: Object's middle along x_P about the contour's; one for all
            parallel tracks, else one a sequence.
        slide_sd_m: Spread of the object's own sliding along x_P between parallel tracks.
        z0_sd_m, z0_limit_m, z0_steps: Floor's datum, one a TouchSet.
        turn_sd_rad: Spread of the object's own turning between sequences.
        slip: Probability that it turned to any yaw at all.
        image_scale: Feature distance (sqrt(mm), RMS over 35 blocks) at which an image is half as good.
        image_order: Half the effective number of independent blocks of an image.
        image_outlier: Probability that an image shows something not in the STL's table.
        image_alike: Probability, under the background, that an image is like one felt beside it.
        height_sd_m: Spread of the top found.
        height_lower: Probability that a lower place than the top was taken for it.
        contour_sd_m: Spread of a fitted contour's side besides the traces' own.
        contour_outlier: Probability that the contour is of a part of the object only.
        yaw_sd_rad: Spread of a box contour's direction.
        temper_width, temper_image: Powers that make correlated observations count as fewer.
        slope, offset: Calibration: log odds against the background = offset + slope * summed log ratios.
        prior_absent: Probability, before touching, that the target is none of the candidates.
        twin: Probability that some other object is a twin: made much like the target.
        twin_width: Probability that a closure, or a height, meets a place where a twin differs.
        twin_width_sd_m: By how much it then does.
        twin_slope: Calibration: log odds of a twin against the target = twin_slope * log ratio of their widths.
        twin_fit: Power of how much better than a candidate a twin would fit (layers are correlated).
        accept: Least probability of the best to act on.
        evidence: Least number of layers both pads felt on the best.
    """

    width_sd_m: float = 0.3e-3
    width_rough: float = 0.6
    width_outlier: float = 0.01
    width_range_m: float = 0.060
    bias_span: float = 1.5
    bias_steps: int = 3
    shift_sd_m: float = 3e-3
    shift_limit_m: float = 7.5e-3
    shift_steps: int = 7
    slide_sd_m: float = 1.5e-3
    z0_sd_m: float = 1.5e-3
    z0_limit_m: float = 2.5e-3
    z0_steps: int = 3
    turn_sd_rad: float = math.radians(4.0)
    slip: float = 0.02
    image_scale: float = 0.12
    image_order: float = 3.0
    image_outlier: float = 0.05
    image_alike: float = 0.6
    height_sd_m: float = 1e-3
    height_lower: float = 0.15
    contour_sd_m: float = 1.5e-3
    contour_outlier: float = 0.1
    yaw_sd_rad: float = math.radians(6.0)
    temper_width: float = 0.5
    temper_image: float = 0.35
    slope: float = 0.8
    offset: float = -3.2
    prior_absent: float = 0.2
    twin: float = 0.12
    twin_width: float = 0.5
    twin_width_sd_m: float = 3e-3
    twin_slope: float = 2.3
    twin_fit: float = 0.6
    accept: float = 0.8
    evidence: float = 2.0

    def __post_init__(self) -> None:
        for f in fields(self):
            v = getattr(self, f.name)
            if not math.isfinite(v) or (v < 0 and f.name != "offset"):
                raise ParamError(f"likelihood.{f.name}", v, "finite and not negative")
            if (f.name.endswith(("_sd_m", "_sd_rad", "_range_m")) or f.name.startswith("image_s")) and v == 0:
                raise ParamError(f"likelihood.{f.name}", v, "positive")
            if f.name.endswith("_steps") and v % 2 == 0:
                raise ParamError(f"likelihood.{f.name}", v, "odd, so that zero is tried")
        for name in (
            "width_outlier",
            "slip",
            "image_outlier",
            "image_alike",
            "height_lower",
            "contour_outlier",
            "prior_absent",
            "twin",
            "twin_width",
        ):
            if not 0 < getattr(self, name) < 1:
                raise ParamError(f"likelihood.{name}", getattr(self, name), "between 0 and 1")
