"""Ranking of candidates by loss and decision by gates."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from glotouch_bt.robot import Array, ParamError
from glotouch_bt.robot.scene import UPRIGHT, Quat


@dataclass(frozen=True)
class Fit:
    """Nuisance parameters at the minimum of the loss.

    Attributes:
        yaw_rad: Yaw of the mesh's frame O in K, in (-pi, pi].
        shift_m: Window shift delta along x_P.
        z0_m: Height offset.
        scale: Model scale.
        bias_m: Aperture bias.
    """

    yaw_rad: float
    shift_m: float
    z0_m: float
    scale: float
    bias_m: float


@dataclass(frozen=True)
class Match:
    """Match of one candidate's TouchSet with the target.

    Attributes:
        index: Index of the candidate.
        loss: Loss of the matcher, comparable within a ranking; infinite without the touches it needs.
        terms: Terms of the loss or the evidence, by the matcher's names.
        fit: Fitted pose; None without contact.
        pose_K_O: (x, y, yaw) of the mesh's frame O in K, m and rad; the contour's centre and yaw without contact.
        evidence: Number of two-sided layers; all one-sided layers together add at most 1.
        probability: Posterior probability that this candidate is the target; NaN outside a ranking.
        quat: Rotation (w, x, y, z) of the mesh onto the side on which it stands; `pose_K_O` is then that of the turned
            mesh, whose bounding box has its middle at x = y = 0.
    """

    index: int
    loss: float
    terms: Mapping[str, float]
    fit: Fit | None
    pose_K_O: tuple[float, float, float]
    evidence: float
    probability: float = math.nan
    quat: Quat = UPRIGHT


Part = Literal["outline", "top"]
PARTS: tuple[Part, ...] = ("outline", "top")
"""The measurements of a candidate by the probe, in the order in which they are made."""


@dataclass(frozen=True)
class ProbeTouch:
    """A possible next measurement with the probe.

    Attributes:
        candidate: Index of the candidate.
        part: Its outline at the sensing height, or its top.
        gain_nats: As in `Closure`.
    """

    candidate: int
    part: Part
    gain_nats: float = math.nan


@dataclass(frozen=True)
class Closure:
    """A possible next closure of the jaws.

    Attributes:
        candidate: Index of the candidate.
        yaw_K_rad: Direction of x_P in K.
        height_m: Height of the pads' mid-point above the floor.
        position_K_m: (2,) pads' mid-point in K.
        gain_nats: Expected information gain about which candidate, or none, is the target; NaN if not computed.
    """

    candidate: int
    yaw_K_rad: float
    height_m: float
    position_K_m: Array
    gain_nats: float = math.nan


@dataclass(frozen=True, kw_only=True)
class Gates:
    """Conditions for accepting the best candidate.

    Attributes:
        margin: Minimum difference between the second and the best loss.
        loss: Maximum loss of the best.
        evidence: Minimum number of two-sided layers of the best.
    """

    margin: float = 0.1
    loss: float = 2.0
    evidence: float = 2.5

    def __post_init__(self) -> None:
        for name in ("margin", "loss", "evidence"):
            v = getattr(self, name)
            if not math.isfinite(v) or v < 0:
                raise ParamError(f"gates.{name}", v, "finite and not negative")


@dataclass(frozen=True)
class Ranking:
    """Ranked candidates, and the decision about the best.

    Attributes:
        matches: Matches by increasing loss; ties by index.
        margin: Second loss minus best loss; infinite for a single candidate with contact, 0 without any contact.
        accepted: The best candidate is accepted as the target.
        reasons: Failed conditions; empty if accepted.
        p_absent: Probability that none is the target; it and the matches' probabilities sum to 1.
        next_touch: The most informative next closure; None if the matcher gives none.
        gates: Gates of the decision; None if decided by probability.
    """

    matches: tuple[Match, ...]
    margin: float
    accepted: bool
    reasons: tuple[str, ...] = field(default=())
    p_absent: float = math.nan
    next_touch: Closure | None = None
    gates: Gates | None = None

    @property
    def best(self) -> Match:
        """The match with the minimum loss."""
        return self.matches[0]


def rank(matches: Sequence[Match], gates: Gates | None = None) -> Ranking:
    """Sort by loss and apply the gates (paper IV-C: margin, absolute fit, evidence). Probabilities are not set.

    Raises:
        ParamError: No match at all.
    """
    gates = gates or Gates()
    if not matches:
        raise ParamError("matches", len(matches), "at least one")
    order = tuple(sorted(matches, key=lambda m: (m.loss, m.index)))
    best = order[0]
    reasons: list[str] = []
    if not math.isfinite(best.loss):
        return Ranking(order, 0.0, False, ("no evidence: no closure on any candidate was felt by a pad",), gates=gates)
    margin = (order[1].loss - best.loss) if len(order) > 1 else math.inf
    if margin < gates.margin:
        reasons.append(
            f"margin {margin:.3f} between candidates {best.index} and {order[1].index} is below {gates.margin:g}"
        )
    if best.loss > gates.loss:
        reasons.append(f"loss {best.loss:.3f} of candidate {best.index} is above {gates.loss:g}: none fits the target")
    if best.evidence < gates.evidence:
        reasons.append(
            f"evidence {best.evidence:.2f} of candidate {best.index} is below {gates.evidence:g} two-sided layers"
        )
    return Ranking(order, margin, not reasons, tuple(reasons), gates=gates)
