"""Pairs of objects that outline and height would confuse, and the closures that would tell them apart.

An estimate from the tables of the two models alone, without the probe, neighbours or errors of calibration:

- Outline and height confuse two objects if those of one fit the other almost as well: the log ratio of the two
  densities, with the errors in which the recogniser believes (`LikelihoodParams`), is below the log odds of
  `CONFIDENCE`.
- A closure on b at some yaw, place and height weighs b against a by its width and the images of its two pads: half the
  squared difference of the widths in standard deviations, and the log of the image kernel. Each is at most the log of
  one over the probability of an outlier, and tempered as in the likelihood.
- a is turned to the yaw at which it is most like b, and the mean over all places counts. A mission picks better places,
  but it does not know the pose at first.
- Two equally probable objects are told apart when the summed weights reach the log odds of `CONFIDENCE`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from glotouch_bt.perception.recognition import TargetModel
from glotouch_bt.perception.recognition.likelihood import LikelihoodParams
from glotouch_bt.perception.recognition.model import Array32
from glotouch_bt.perception.touch import ContourKind
from glotouch_bt.perception.touch.calibration import JawZero
from glotouch_bt.robot import Array

CONFIDENCE = 0.95
"""Probability at which one of two objects counts as known. Source: the default of `retrieve`."""
MAX_CLOSURES = 40
"""More closures than this are not worth waiting for: touch cannot tell the two apart. Source: ours."""
MAX_SHIFT_M = 0.008
"""Places up to this far from the middle of the footprint are compared. Source: half the pads' width."""


@dataclass(frozen=True)
class LookAlike:
    """Two objects that outline and height would confuse.

    Attributes:
        first, second: Their names.
        closures: Closures that tell them apart; None if more than `MAX_CLOSURES`.
    """

    first: str
    second: str
    closures: int | None


def look_alikes(models: Sequence[TargetModel]) -> list[LookAlike]:
    """Return the look-alikes among objects with different names."""
    p = LikelihoodParams()
    found: list[LookAlike] = []
    needed = math.log(CONFIDENCE / (1 - CONFIDENCE))
    for a, b in combinations(models, 2):
        if min(_outline_nats(a, b, p), _outline_nats(b, a, p)) < needed:
            weight = min(_weight_of_closure(a, b, p), _weight_of_closure(b, a, p))
            closures = needed / max(weight, 1e-9)
            found.append(LookAlike(a.name, b.name, None if closures > MAX_CLOSURES else math.ceil(closures)))
    return found


def _outline_nats(a: TargetModel, b: TargetModel, p: LikelihoodParams) -> float:
    """Return the log ratio by which the outline and height of b fit b better than a, with Gaussian errors."""
    kind: ContourKind = "box" if b.outline.p_box > 0.5 else "round"
    shares = [m.outline.p_box if kind == "box" else 1 - m.outline.p_box for m in (a, b)]
    twice = 2 * math.log(shares[1] / shares[0]) + ((a.height_m - b.height_m) / p.height_sd_m) ** 2
    traced = a.outline.of(kind), b.outline.of(kind)
    for i in range(1 if kind == "round" else 2):
        sds = [math.hypot(p.contour_sd_m, t.size_sd_m[i]) for t in traced]
        twice += ((traced[0].size_m[i] - traced[1].size_m[i]) / sds[0]) ** 2 + 2 * math.log(sds[0] / sds[1])
    return 0.5 * twice


def _weight_of_closure(a: TargetModel, b: TargetModel, p: LikelihoodParams) -> float:
    """Return the expected evidence (nats) of a closure on b for b against a, at the pose of a that is most like b."""
    heights, half_turn = min(len(a.z_m), len(b.z_m)), len(b.phi_rad) // 2
    width_a, width_b, uneven_a, image_a, image_b = (
        _middle(table, model.l_m)[:, :, :heights]
        for table, model in (
            (a.width_m, a), (b.width_m, b), (a.unevenness_m, a), (a.images, a), (b.images, b),
        )
    )  # fmt: skip
    felt = np.isfinite(width_b)
    limit, image_limit = -math.log(p.width_outlier), -math.log(p.image_outlier)
    weights = []
    for turn in range(len(a.phi_rad)):
        width, uneven = np.roll(width_a, turn, axis=0), np.roll(uneven_a, turn, axis=0)
        both = np.isfinite(width) & felt
        variance = p.width_sd_m**2 + JawZero().sd_m ** 2 + (p.width_rough * np.where(both, uneven, 0.0)) ** 2
        squared = np.where(both, width - width_b, 0.0) ** 2 / variance
        by_width = np.where(np.isfinite(width) != felt, limit, np.minimum(0.5 * squared, limit))
        unlike = ((np.roll(image_a, turn, axis=0) - image_b) ** 2).mean(axis=-1)
        left = np.minimum(p.image_order * np.log1p(unlike / p.image_scale**2), image_limit)
        right = np.roll(left[:, ::-1], half_turn, axis=0)
        evidence = (p.temper_width * by_width + p.temper_image * (left + right))[felt]
        weights.append(p.slope * float(evidence.mean()) if len(evidence) else 0.0)
    return min(weights)


def _middle(table: Array32, l_m: Array) -> Array32:
    """Return the table near the middle of the footprint; the grids of two objects agree there."""
    middle = len(l_m) // 2
    reach = int(min(MAX_SHIFT_M // (l_m[1] - l_m[0]), middle))
    return np.asarray(table[:, middle - reach : middle + reach + 1])
