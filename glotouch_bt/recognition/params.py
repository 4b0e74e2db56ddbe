"""The matching loss's parameters: one frozen set for every object. Reasons: docs/recognition.md."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

from glotouch_bt.robot import ParamError


@dataclass(frozen=True, kw_only=True)
class LossParams:
    """Switches, weights and scales of the loss. Dimensionless unless the name carries a unit.

    Attributes:
        unit_m: One unit of width residual (feasibility study).
        huber: Residual, in units, where Huber turns linear.
        w_absolute, w_centred, w_vertical, w_cross: The four residual families (feasibility study).
        coverage: lambda_C on the fraction of layers without predicted support.
        bias: lambda_b on |b| / bias_limit_m.
        bias_limit_m: b_0, the largest aperture bias tried (CONDITIONS: +-1.0 mm harsh, and the gel's own error).
        bias_steps: Biases tried within +-bias_limit_m; odd.
        shift_m, shift_steps: Window shifts delta tried within +-shift_m; odd.
        shift_sd_m: Spread of the object's middle about the contour's.
        shift_prior: Weight of (delta / sd)^2 / 2.
        z0_m, z0_steps: Height offsets tried within +-z0_m; odd.
        z0_sd_m: Spread of the height offset (registration, feet, tilt).
        z0_prior: Weight of (z0 / sd)^2 / 2.
        scales: Model scales tried; (1.0,) as an STL is in metres and objects are made to it.
        scale_prior: lambda_s on |log s|, times (1 + anisotropy).
        drift_yaw_rad: How far one sequence's yaw may differ from the common pose.
        drift_cost: Loss per table step of yaw (5 deg) of such a difference.
        unilateral: Weight of a layer that only one pad felt, against 1 for both.
        tau_t_m, tau_R_rad: Reference scales of eq. (coupled_probability).
        known_motion: Use the known motion between sequences in both modes (the coupled branch always).
        depth, depth_anisotropy: lambda_D0 and gamma.
        depth_sd: sigma_D.
        depth_eps: epsilon in I_M.
        mode: lambda_cm.
        mode_floor: Smallest probability given to a contour kind.
        paper_mode: Use the paper's a_M^2 (1 - p_c) instead of -log P(kind | model).
        height: Weight of the top height's evidence.
        height_sd_m: Its spread: the floor's datum, and what a ball feels of a point.
        contour: Weight of the contour size's evidence.
        contour_sd_m: Its spread besides the outline's own misfit.
        yaw_prior: Weight of the contour's direction (boxes only).
        yaw_sd_rad: Its spread.
        image: Weight of the pad images' distance.
        image_sd: Scale of the image distance, sqrt(mm) RMS per block.
        image_cap: Largest loss one image can give, in the same unit as 1 = (distance = image_sd).
    """

    unit_m: float = 2e-3
    huber: float = 1.5
    w_absolute: float = 0.4
    w_centred: float = 0.25
    w_vertical: float = 0.2
    w_cross: float = 0.15
    coverage: float = 1.0
    bias: float = 0.1
    bias_limit_m: float = 1.2e-3
    bias_steps: int = 5
    shift_m: float = 0.009
    shift_steps: int = 9
    shift_sd_m: float = 3e-3
    shift_prior: float = 0.05
    z0_m: float = 4e-3
    z0_steps: int = 5
    z0_sd_m: float = 2e-3
    z0_prior: float = 0.05
    scales: tuple[float, ...] = (1.0,)
    scale_prior: float = 2.0
    drift_yaw_rad: float = math.radians(10.0)
    drift_cost: float = 0.03
    unilateral: float = 0.35
    tau_t_m: float = 0.012
    tau_R_rad: float = math.radians(15.0)
    known_motion: bool = True
    depth: float = 0.15
    depth_anisotropy: float = 1.0
    depth_sd: float = 0.05
    depth_eps: float = 0.02
    mode: float = 0.3
    mode_floor: float = 0.1
    paper_mode: bool = False
    height: float = 0.25
    height_sd_m: float = 3e-3
    contour: float = 0.25
    contour_sd_m: float = 4e-3
    yaw_prior: float = 0.1
    yaw_sd_rad: float = math.radians(8.0)
    image: float = 1.0
    image_sd: float = 0.25
    image_cap: float = 2.0

    def __post_init__(self) -> None:
        for f in fields(self):
            v = getattr(self, f.name)
            if isinstance(v, bool):
                continue
            values = v if isinstance(v, tuple) else (v,)
            if not values or not all(math.isfinite(x) and x >= 0 for x in values):
                raise ParamError(f"loss.{f.name}", v, "finite and not negative")
        scales = ("unit_m", "bias_limit_m", "shift_sd_m", "z0_sd_m", "tau_t_m", "tau_R_rad", "depth_sd", "height_sd_m")
        positive = (*scales, "huber", "depth_eps", "mode_floor", "contour_sd_m", "yaw_sd_rad", "image_sd", "image_cap")
        for name in positive:
            if getattr(self, name) <= 0:
                raise ParamError(f"loss.{name}", getattr(self, name), "positive")
        for name in ("bias_steps", "shift_steps", "z0_steps"):
            if getattr(self, name) < 1 or getattr(self, name) % 2 == 0:
                raise ParamError(f"loss.{name}", getattr(self, name), "odd, so that zero is tried")
        if min(self.scales) <= 0:
            raise ParamError("loss.scales", self.scales, "positive")

    def only(self, *terms: str) -> LossParams:
        """The same loss with every term off but the width loss and `terms` (depth, mode, height, contour, image).

        Raises:
            ParamError: An unknown term.
        """
        known = {t: (t,) for t in ("depth", "mode", "height", "image")} | {"contour": ("contour", "yaw_prior")}
        for t in terms:
            if t not in known:
                raise ParamError("terms", t, f"one of {', '.join(known)}")
        off = {name: 0.0 for t, names in known.items() if t not in terms for name in names}
        return replace(self, **off)  # type: ignore[arg-type]

    @classmethod
    def paper(cls, *terms: str) -> LossParams:
        """The paper's loss: width, and `terms` of depth and mode, with its own branch mixture and mode term."""
        return replace(cls(), known_motion=False, paper_mode=True).only(*terms)


MatchParams = LossParams
