"""Weights, scales and search ranges of the paper's matching loss; reasons in docs/explanation/paper_matcher.md."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from typing import Literal

from glotouch_bt.robot import ParamError

Branch = Literal["mixed", "coupled", "independent"]

TERMS: dict[str, tuple[str, ...]] = {
    "absolute": ("w_absolute",),
    "centred": ("w_centred",),
    "vertical": ("w_vertical",),
    "cross": ("w_cross",),
    "coverage": ("coverage",),
    "bias": ("bias",),
    "scale": ("scale_prior",),
    "depth": ("depth",),
    "mode": ("mode",),
}
"""Terms of the loss, with the weights that switch them off."""


@dataclass(frozen=True, kw_only=True)
class PaperParams:
    """Parameters, the same for every object. Dimensionless unless the name has a unit; the paper gives no values.

    Attributes:
        unit_m: Unit of a residual.
        huber: Residual, in units, at which the Huber loss becomes linear.
        w_absolute, w_centred, w_vertical, w_cross: w_a, w_c, w_v, w_x.
        coverage: lambda_C.
        bias: lambda_b.
        bias_unit_m: b_0.
        bias_limit_m: Maximum aperture bias; 0 disables the bias.
        shift_m, shift_steps: Grid of window shifts delta: limit and odd number.
        z0_m, z0_steps: Grid of height offsets z_0: limit and odd number.
        scales: Model scales s.
        scale_prior, scale_anisotropy: lambda_s = scale_prior (1 + scale_anisotropy a_M).
        unilateral: Weight w of a layer with one pad in contact, relative to 1 for both.
        pair_gap_m: Maximum height difference of layers that Delta_a compares.
        tau_t_m, tau_R_rad, floor_t_m, floor_R_rad: Scales and floors of eq. (coupled_probability).
        branch: Both branches mixed by p_c, or one branch.
        depth, depth_anisotropy: lambda_D0 and gamma.
        depth_sd: sigma_D.
        depth_eps: epsilon of I_M.
        mode: lambda_cm.
    """

    unit_m: float = 2e-3
    huber: float = 1.5
    w_absolute: float = 0.4
    w_centred: float = 0.25
    w_vertical: float = 0.2
    w_cross: float = 0.15
    coverage: float = 1.0
    bias: float = 0.1
    bias_unit_m: float = 2e-3
    bias_limit_m: float = 3e-3
    shift_m: float = 0.009
    shift_steps: int = 9
    z0_m: float = 4e-3
    z0_steps: int = 5
    scales: tuple[float, ...] = (0.9, 0.95, 1.0, 1.05, 1.1)
    scale_prior: float = 2.0
    scale_anisotropy: float = 1.0
    unilateral: float = 0.4
    pair_gap_m: float = 4e-3
    tau_t_m: float = 0.012
    tau_R_rad: float = math.radians(15.0)
    floor_t_m: float = 1e-4
    floor_R_rad: float = math.radians(0.5)
    branch: Branch = "mixed"
    depth: float = 0.15
    depth_anisotropy: float = 1.0
    depth_sd: float = 0.05
    depth_eps: float = 0.02
    mode: float = 1.0

    def __post_init__(self) -> None:
        for f in fields(self):
            v = getattr(self, f.name)
            if isinstance(v, str):
                continue
            values = v if isinstance(v, tuple) else (v,)
            if not values or not all(math.isfinite(x) and x >= 0 for x in values):
                raise ParamError(f"paper.{f.name}", v, "finite and not negative")
        for name in (
            "unit_m", "huber", "bias_unit_m", "tau_t_m", "tau_R_rad", "floor_t_m", "floor_R_rad", "depth_sd",
            "depth_eps",
        ):  # fmt: skip
            if getattr(self, name) <= 0:
                raise ParamError(f"paper.{name}", getattr(self, name), "positive")
        for name in ("shift_steps", "z0_steps"):
            if getattr(self, name) < 1 or getattr(self, name) % 2 == 0:
                raise ParamError(f"paper.{name}", getattr(self, name), "odd, so that the grid contains zero")
        if not 0.5 <= min(self.scales) <= max(self.scales) <= 2.0:
            raise ParamError("paper.scales", self.scales, "within 0.5 .. 2")
        if self.unilateral > 1:
            raise ParamError("paper.unilateral", self.unilateral, "<= 1, the weight of a two-sided layer")
        if self.branch not in ("mixed", "coupled", "independent"):
            raise ParamError("paper.branch", self.branch, "mixed, coupled or independent")

    def only(self, *terms: str) -> PaperParams:
        """Switch off all terms but `terms`.

        Raises:
            ParamError: An unknown term.
        """
        return self._off(t for t in TERMS if t not in _known(terms))

    def without(self, *terms: str) -> PaperParams:
        """Switch off `terms`.

        Raises:
            ParamError: An unknown term.
        """
        return self._off(_known(terms))

    def _off(self, terms: Iterable[str]) -> PaperParams:
        off = {name: 0.0 for t in terms for name in TERMS[t]}
        return replace(self, **off)  # type: ignore[arg-type]

    def width_only(self) -> PaperParams:
        """Return the first row of the paper's ablation: width and action only."""
        return self.without("depth", "mode")

    def width_depth(self) -> PaperParams:
        """Return the second row: plus local depth."""
        return self.without("mode")

    def ablation(self) -> dict[str, PaperParams]:
        """Return the three rows of the paper's ablation, in its order."""
        return {"width": self.width_only(), "+ depth": self.width_depth(), "+ mode (full)": self}


def _known(terms: tuple[str, ...]) -> tuple[str, ...]:
    for t in terms:
        if t not in TERMS:
            raise ParamError("terms", t, f"one of {', '.join(TERMS)}")
    return terms
