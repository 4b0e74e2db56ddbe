"""Parameters of the likelihood; their measurement is in docs/explanation/recognition.md."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

from glotouch_bt.robot import ParamError


@dataclass(frozen=True, kw_only=True)
class LikelihoodParams:
    """Nuisance, noise, tempering and prior, the same for every object.

    Attributes:
        width_sd_m: Scale of a rigid width about its prediction (Student's t).
        width_rough: Fraction of the table's unevenness added to this scale, for poses between the cells.
        width_outlier: Probability of an outlier width.
        width_range_m: Range of the uniform density of outlier widths.
        scale_sd: Standard deviation of the object's scale against its STL. Source: uniform within 1 %; shrinkage of
            printed parts is .1 to 1.5 %.
        offset_sd_m: Standard deviation of the offset of its surface. Source: tolerances of printed parts, .2 mm.
        bias_span, bias_steps: Grid of the bias of widths, one per TouchSet: limit in standard deviations, number. The
            aperture's zero, scale and offset add up.
        shift_sd_m, shift_limit_m, shift_steps: Object's centre along x_P about the contour's: prior and grid; one for
            all parallel tracks, else one per sequence.
        slide_sd_m: Standard deviation of the slide along x_P between parallel tracks.
        z0_sd_m, z0_limit_m, z0_steps: Height of the floor, one per TouchSet: prior and grid.
        turn_sd_rad: Standard deviation of the object's turn between sequences.
        slip: Probability of a turn to an arbitrary yaw.
        image_scale: Feature distance (sqrt(mm), RMS over 35 blocks) that scales the image kernel.
        image_order: Half the effective number of independent blocks of an image.
        image_outlier: Probability of an outlier image.
        image_alike: Background probability that an image resembles a neighbouring one.
        relief_scale: Feature distance (RMS over 70 blocks) that scales the kernel of a gel image's relief.
        relief_order: Half the effective number of independent blocks of a relief.
        relief_outlier: Probability of an outlier relief.
        relief_poses: Number of likely poses at which the relief is predicted.
        height_sd_m: Standard deviation of the measured top.
        lean_rad: Mean lean of an object that stands on an uneven base, exponentially distributed. Source: 0 to 3 deg
            in conditions/realistic.yaml, 0 to 8 deg in strong.yaml.
        height_lower: Probability that a lower point of a wholly traced object was measured as its top. Source: ours; in
            recorded realistic missions nearly all low tops were those of partly traced objects.
        contour_sd_m: Standard deviation of a contour's side, besides that of the traces.
        contour_outlier: Probability that the contour covers only a part of the object.
        trace_outlier: Probability that a trace mixes the contacts of several objects, or of one before and after a
            motion. Source: ours.
        yaw_sd_rad: Standard deviation of a box contour's direction.
        temper_outline, temper_contacts, temper_width, temper_image, temper_relief: Tempering exponents of outline and
            height, of the contacts within the outline, of widths, depth maps and gel images for correlated
            observations; 0 leaves a part out (`ablation`).
        slope, offset: Calibration: log odds against the background = offset + slope * summed log ratios.
        outline_offset: The same offset for a candidate of which only outline and height were measured.
        prior_absent: Prior probability that the target is none of the candidates. Source: ours; "The likelihood
            matcher" in docs/explanation/recognition.md.
        twin: Prior probability that another object is a twin, i.e. similar to the target.
        twin_width: Probability that a twin differs at a closure, or in a height band.
        twin_width_sd_m: Scale of this difference.
        twin_slope: Calibration: log odds of a twin against the target = twin_slope * log ratio of their widths.
        twin_fit: Tempering exponent of a twin's better fit (layers are correlated).
        accept: Minimum probability of an accepted candidate.
    """

    width_sd_m: float = 0.3e-3
    width_rough: float = 0.8
    width_outlier: float = 0.01
    width_range_m: float = 0.060
    scale_sd: float = 0.006
    offset_sd_m: float = 0.2e-3
    bias_span: float = 2.0
    bias_steps: int = 5
    shift_sd_m: float = 5e-3
    shift_limit_m: float = 12.5e-3
    shift_steps: int = 11
    slide_sd_m: float = 3e-3
    z0_sd_m: float = 1.5e-3
    z0_limit_m: float = 2.5e-3
    z0_steps: int = 3
    turn_sd_rad: float = math.radians(6.0)
    slip: float = 0.02
    image_scale: float = 0.2
    image_order: float = 3.0
    image_outlier: float = 0.05
    image_alike: float = 0.6
    relief_scale: float = 0.4
    relief_order: float = 3.0
    relief_outlier: float = 0.05
    relief_poses: int = 3
    height_sd_m: float = 1.2e-3
    lean_rad: float = math.radians(3.0)
    height_lower: float = 0.03
    contour_sd_m: float = 1.5e-3
    contour_outlier: float = 0.1
    trace_outlier: float = 0.03
    yaw_sd_rad: float = math.radians(6.0)
    temper_outline: float = 1.0
    temper_contacts: float = 0.35
    temper_width: float = 0.5
    temper_image: float = 0.35
    temper_relief: float = 0.35
    slope: float = 0.75
    offset: float = -1.5
    outline_offset: float = -1.0
    prior_absent: float = 0.15
    twin: float = 0.02
    twin_width: float = 0.5
    twin_width_sd_m: float = 3e-3
    twin_slope: float = 2.4
    twin_fit: float = 1.0
    accept: float = 0.8

    def __post_init__(self) -> None:
        for f in fields(self):
            v = getattr(self, f.name)
            if not math.isfinite(v) or (v < 0 and not f.name.endswith("offset")):
                raise ParamError(f"likelihood.{f.name}", v, "finite and not negative")
            if f.name.endswith(("_sd_m", "_sd_rad", "_range_m", "lean_rad", "_scale", "_poses")) and v == 0:
                raise ParamError(f"likelihood.{f.name}", v, "positive")
            if f.name.endswith("_steps") and v % 2 == 0:
                raise ParamError(f"likelihood.{f.name}", v, "odd, so that the grid contains zero")
        for name in (
            "width_outlier", "slip", "image_outlier", "image_alike", "relief_outlier", "height_lower",
            "contour_outlier", "trace_outlier", "prior_absent", "twin", "twin_width",
        ):  # fmt: skip
            if not 0 < getattr(self, name) < 1:
                raise ParamError(f"likelihood.{name}", getattr(self, name), "between 0 and 1")

    def ablation(self) -> dict[str, LikelihoodParams]:
        """Return the parameters with parts of the likelihood left out, by what is left of it."""
        return {
            "outline": replace(self, temper_width=0.0, temper_image=0.0, twin_fit=0.0),
            "widths": replace(self, temper_outline=0.0, temper_image=0.0),
        }
