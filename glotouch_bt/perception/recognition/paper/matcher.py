"""L_match = L_width + lambda_D L_depth + L_cm (eq. matching_loss), and the ranking by it.

`paper_matcher(PaperParams())` is a Matcher: (model, touchsets) -> Ranking.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from glotouch_bt.perception.recognition.decision import Gates, Match, Ranking, rank
from glotouch_bt.perception.recognition.model import TargetModel
from glotouch_bt.perception.recognition.paper.branches import fit_widths
from glotouch_bt.perception.recognition.paper.observation import PaperObservation, read_observation
from glotouch_bt.perception.recognition.paper.params import PaperParams
from glotouch_bt.perception.recognition.paper.pose import pose_of_fit
from glotouch_bt.perception.recognition.placement import contour_pose
from glotouch_bt.perception.touch import TouchSet
from glotouch_bt.robot import ParamError

PAPER_GATES = Gates(margin=0.1, loss=1.0, evidence=2.5)
"""Default gates. The paper gives no values; its correct pairs have losses up to 0.90 and its minimum mean margin is
0.15, rounded to 1.0 and 0.1. The evidence is that of `Gates`."""


def paper_match(model: TargetModel, touchset: TouchSet, params: PaperParams | None = None) -> Match:
    """Compute the match of one pair. A TouchSet without contact has infinite loss and evidence 0."""
    p = params or PaperParams()
    index = touchset.candidate.index
    seen = read_observation(touchset, model.pad, p)
    if not seen.sequences:
        return Match(index, math.inf, {}, None, contour_pose(touchset), 0.0)
    widths = fit_widths(model, seen, p)
    terms = {"width": widths.loss}
    if p.depth > 0:
        weight = p.depth / (1 + p.depth_anisotropy * model.anisotropy)
        terms["depth"] = weight * depth_loss(seen, model.rho, model.normal_dispersion, p)
    if p.mode > 0:
        terms["mode"] = mode_loss(seen.p_coupled, model.anisotropy, p)
    loss = float(sum(terms.values()))
    if not math.isfinite(loss):  # no hypothesis has support in any layer
        return Match(index, math.inf, terms, None, contour_pose(touchset), seen.evidence)
    centre = np.asarray(touchset.candidate.contour.centre_K_m, dtype=np.float64)
    fit, pose = pose_of_fit(model, seen, widths, centre, p)
    return Match(index, loss, terms, fit, pose, seen.evidence)


def depth_loss(seen: PaperObservation, rho_model: float, dispersion: float, p: PaperParams) -> float:
    """Compute eq. (depth_loss) without lambda_D; 0 if no patch is valid.

    Args:
        seen: Nonplanarity rho_k and valid fraction q_{D,k} of all sequences.
        rho_model: rho_M.
        dispersion: d_M.
        p: sigma_D and epsilon.
    """
    rho = seen.rho[np.isfinite(seen.rho)]
    if len(rho) == 0:
        return 0.0
    information = dispersion / (dispersion + p.depth_eps)
    residual = float(np.median(np.log1p(((rho - rho_model) / p.depth_sd) ** 2)))
    return residual * float(np.mean(seen.q_depth * information))


def mode_loss(p_coupled: float, anisotropy: float, p: PaperParams) -> float:
    """Compute eq. (collection_mode)."""
    return p.mode * anisotropy**2 * (1 - p_coupled)


def paper_rank(
    model: TargetModel, touchsets: Sequence[TouchSet], params: PaperParams | None = None, gates: Gates = PAPER_GATES
) -> Ranking:
    """Rank all candidates and decide by margin, absolute fit and evidence.

    Probabilities are the uncalibrated softmax of -loss, and p_absent is 0: the paper defines neither.

    Raises:
        ParamError: No TouchSet at all, or two of the same candidate.
    """
    indices = [t.candidate.index for t in touchsets]
    if len(set(indices)) < len(indices):
        raise ParamError("touchsets", indices, "one of each candidate")
    ranking = rank([paper_match(model, t, params) for t in touchsets], gates)
    losses = np.array([m.loss for m in ranking.matches])
    weight = np.ones(len(losses))
    if np.isfinite(losses[0]):
        weight = np.exp(losses[0] - losses)  # 0 for an infinite loss
    shares = weight / weight.sum()
    matches = tuple(replace(m, probability=float(x)) for m, x in zip(ranking.matches, shares, strict=True))
    return replace(ranking, matches=matches, p_absent=0.0)


def paper_matcher(params: PaperParams | None = None, gates: Gates = PAPER_GATES) -> partial[Ranking]:
    """Return a Matcher with these parameters."""
    return partial(paper_rank, params=params, gates=gates)
