"""Plan the grasp of a recognised object: the best hold of its mesh at the fitted pose.

The widths measured by the closures decide whether that pose is credible. If not, the grasps repeat closures.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from glotouch_bt.perception.recognition import Match
from glotouch_bt.perception.touch import Candidate, Layer, TouchSet, evidence_weight, layer_patches
from glotouch_bt.robot import Array, Gripper, ParamError
from glotouch_bt.robot.scene import UPRIGHT, Mesh, Quat
from glotouch_skills.common.planning.grasp_holds import AREA_SCALE, LEVER_SCALE_M, Holds, holds_of
from glotouch_skills.common.planning.squeeze_motion import lowest_pads_m

if TYPE_CHECKING:
    from glotouch_bt.perception.recognition import FeltClosure, TargetModel, TouchedObject

STALENESS = 0.7
"""Factor on the worth of a closure for each later sequence: squeezing turns and shifts the object."""
ALTERNATIVES = 5
"""Largest number of alternative grasps."""
FITTED = 3
"""Largest number of grasps at the fitted pose, if it is credible."""
APART_RAD = math.radians(25.0)
"""Two grasps at the fitted pose differ in yaw by at least this, or in place by `APART_M`, so that one cause does not
spoil both."""
APART_M = 0.012
"""See `APART_RAD`."""
MIN_WORTH = 0.02
"""Least worth of a hold at the fitted pose (0..1)."""
MAX_MISFIT_M = 0.002
"""The pose is credible if, after removal of one offset, the widths of three quarters of the closures are within this of
the mesh. Larger than the scatter of widths in recognition, because the place of a closure is uncertain, too."""
MIN_OFFSET_M = -0.004
"""Least offset of measured widths from the mesh: both gels yield, and the jaws' zero is off (1 mm in
conditions/harsh.yaml)."""
MAX_OFFSET_M = 0.0015
"""Largest such offset."""
MIN_LAYERS = 3
"""Least number of widths for judging the pose."""
FORCE_N = 30.0
"""Jaw force of a grasp."""
MAX_PLACE_M = 2.0
"""Larger coordinates were meant in millimetres."""
MAX_WIDTH_M = 0.5
"""Larger apertures were meant in millimetres."""
MAX_ZERO_M = 0.005
"""Closed jaws may report an aperture down to minus this."""
MAX_YAW_RAD = 4.0 * math.pi
"""Larger yaws were meant in degrees."""


@dataclass(frozen=True)
class GraspPlan:
    """One grasp, and what to try if it cannot be made.

    Attributes:
        candidate: Index of the candidate.
        position_K_m: (3,) pads' mid-point in K (z above the floor).
        yaw_rad: Direction of x_P in K.
        aperture_m: Measured or expected aperture there; the jaws must stop near it.
        opening_m: Aperture during the descent, at most the stroke.
        alternatives: Other grasps of the same object, best first.
        source: `fitted` (from the mesh, or from a remembered closure) or `felt` (from a closure).
        quat: Rotation (w, x, y, z) of the mesh onto the side on which the object is taken to stand.
        closed_m: Aperture of the closed jaws before the lift, if the grasp was made.
    """

    candidate: int
    position_K_m: Array
    yaw_rad: float
    aperture_m: float
    opening_m: float
    alternatives: tuple[GraspPlan, ...] = ()
    source: str = "felt"
    quat: Quat = UPRIGHT
    closed_m: float | None = None

    def __post_init__(self) -> None:
        position_K_m = np.asarray(self.position_K_m)
        if position_K_m.shape != (3,) or not (np.abs(position_K_m) <= MAX_PLACE_M).all():
            raise ParamError("position_K_m", position_K_m.tolist(), f"[x, y, z] in metres, up to {MAX_PLACE_M:g} each")
        if not abs(self.yaw_rad) <= MAX_YAW_RAD:
            raise ParamError("yaw_rad", self.yaw_rad, f"radians, up to {MAX_YAW_RAD:.4g} either way")
        for name in ("aperture_m", "opening_m"):  # closed jaws may report a little less than zero
            if not -MAX_ZERO_M <= getattr(self, name) <= MAX_WIDTH_M:
                raise ParamError(name, getattr(self, name), f"in metres, {-MAX_ZERO_M:g} to {MAX_WIDTH_M:g}")


def plan_grasp(
    touchset: TouchSet,
    match: Match,
    solid: Mesh | TouchedObject,
    model: TargetModel,
    gripper: Gripper,
    side_gap_m: float = 0.010,
) -> GraspPlan:
    """Return the best grasp, with the next best as its alternatives.

    Args:
        touchset: Touches of the object.
        match: Its fit to the target.
        solid: The target, as it stands, or what was felt of it.
        model: Its tables.
        gripper: The robot's gripper.
        side_gap_m: Gap between open jaw and object on each side.
    """
    index = touchset.candidate.index
    if isinstance(solid, Mesh):
        com = np.asarray(solid.as_trimesh().center_mass)
    else:
        com = np.array([*model.centre_m, 0.5 * model.height_m])
    fitted: list[GraspPlan] = []
    if match.fit is not None and misfit_m(touchset, match, model) <= MAX_MISFIT_M:
        if isinstance(solid, Mesh):
            holds = _mesh_holds(holds_of(model, com, gripper, lowest_pads_m(model.height_m, gripper), FORCE_N))
        else:
            holds = _remembered_holds(model, solid)
        fitted = _fitted(index, match, model, holds, side_gap_m)
    felt = _felt(touchset, _placed(com, match), side_gap_m)
    plans = [
        replace(plan, opening_m=min(plan.opening_m, gripper.stroke_m), quat=match.quat)
        for plan in (*fitted, *felt)[: 1 + ALTERNATIVES]
    ]
    return replace(plans[0], alternatives=tuple(plans[1:]))


def misfit_m(touchset: TouchSet, match: Match, model: TargetModel) -> float:
    """Return the misfit of the measured widths to the mesh at the fitted pose, m; infinite if it cannot be judged."""
    theta = match.pose_K_O[2]
    middle = _placed(np.array([*model.centre_m, 0.0]), match)[:2]
    off = []
    for layer in touchset.layers:
        if evidence_weight(layer) < 1.0:
            continue
        along = float(np.array([np.cos(layer.yaw_rad), np.sin(layer.yaw_rad)]) @ (layer.position_K_m - middle))
        off.append(layer.aperture_m - model.width_at(along, layer.height_m, layer.yaw_rad - theta))
    off = [d for d in off if math.isfinite(d)]
    if len(off) < MIN_LAYERS:
        return math.inf
    offset = float(np.median(off))
    if not MIN_OFFSET_M <= offset <= MAX_OFFSET_M:
        return math.inf
    return float(np.quantile(np.abs(np.array(off) - offset), 0.75))


def _placed(point_O_m: Array, match: Match) -> Array:
    """Return a point (3,) of the mesh in K."""
    x, y, theta = match.pose_K_O
    c, s = math.cos(theta), math.sin(theta)
    return np.array([x + c * point_O_m[0] - s * point_O_m[1], y + s * point_O_m[0] + c * point_O_m[1], point_O_m[2]])


@dataclass(frozen=True)
class _Hold:
    """Places where the pads would hold the model, and their opening: angles and lengths as in `TargetModel`."""

    phi_rad: float
    along_m: float
    middle_m: float
    height_m: float
    aperture_m: float
    opening_m: float


def _mesh_holds(holds: Holds) -> Iterator[_Hold]:
    """Yield the holds of a mesh that are worth it, best first."""
    for flat in np.argsort(-holds.worth, axis=None, kind="stable")[:2000].tolist():
        i, j, k = np.unravel_index(flat, holds.worth.shape)
        if holds.worth[i, j, k] < MIN_WORTH:
            return
        yield _Hold(
            float(holds.phi_rad[i]), float(holds.l_m[j]), float(holds.middle_m[i, j, k]), float(holds.z_m[k]),
            float(holds.width_m[i, j, k]), float(holds.opening_m[i, j, k]),
        )  # fmt: skip


def _remembered_holds(model: TargetModel, felt: TouchedObject) -> Iterator[_Hold]:
    """Yield the remembered closures of both pads, best first."""

    def worth(c: FeltClosure) -> float:
        lever = math.hypot(c.along_m, 0.5 * (0.5 * model.height_m - c.height_m))
        return math.prod(a / (a + AREA_SCALE) for a in c.areas) / (1.0 + (lever / LEVER_SCALE_M) ** 2)

    for c in sorted((c for c in felt.closures if c.two_sided), key=worth, reverse=True):
        i = round(c.phi_rad / (2 * math.pi) * len(model.phi_rad)) % len(model.phi_rad)
        j, k = int(np.argmin(np.abs(model.l_m - c.along_m))), int(np.argmin(np.abs(model.z_m - c.height_m)))
        opening = max(float(model.width_m[i, j, k:].max()), c.width_m)
        yield _Hold(c.phi_rad, c.along_m, float(model.middle_m[i, j, k]), c.height_m, c.aperture_m, opening)


def _fitted(index: int, match: Match, model: TargetModel, holds: Iterable[_Hold], side_gap_m: float) -> list[GraspPlan]:
    """Return the first holds, at the fitted pose, that differ enough from each other."""
    middle = _placed(np.array([*model.centre_m, 0.0]), match)
    chosen: list[GraspPlan] = []
    for hold in holds:
        if len(chosen) == FITTED:
            break
        yaw = match.pose_K_O[2] + hold.phi_rad
        c, s = math.cos(yaw), math.sin(yaw)
        x, y = c * hold.along_m + s * hold.middle_m, s * hold.along_m - c * hold.middle_m
        place = middle + np.array([x, y, hold.height_m])
        if any(_near(place, yaw, other) for other in chosen):
            continue
        chosen.append(
            GraspPlan(
                candidate=index,
                position_K_m=place,
                yaw_rad=math.remainder(yaw, 2 * math.pi),
                aperture_m=hold.aperture_m,
                opening_m=hold.opening_m + 2 * side_gap_m,
                source="fitted",
            )
        )
    return chosen


def _near(place_K_m: Array, yaw_rad: float, other: GraspPlan) -> bool:
    turned = abs(math.remainder(yaw_rad - other.yaw_rad, math.pi))
    return turned < APART_RAD and float(np.linalg.norm(place_K_m - other.position_K_m)) < APART_M


def _felt(touchset: TouchSet, com_K: Array, side_gap_m: float) -> list[GraspPlan]:
    """Return the closures as grasps, best first: large two-sided contact, near the centre of mass, recent."""

    def worth(layer: Layer, later: int) -> float:
        areas = [p.area_fraction for p in layer_patches(layer)]
        hold = math.prod([a / (a + AREA_SCALE) for a in areas])
        across = np.array([np.cos(layer.yaw_rad), np.sin(layer.yaw_rad)])
        lever = math.hypot(across @ (com_K[:2] - layer.position_K_m), 0.5 * (com_K[2] - layer.height_m))
        return float(layer.stable) * hold * STALENESS**later / (1.0 + (lever / LEVER_SCALE_M) ** 2)

    count = len(touchset.sequences)
    rated = [(worth(layer, count - 1 - k), layer) for k, q in enumerate(touchset.sequences) for layer in q.layers]
    rated.sort(key=lambda r: -r[0])
    return [
        GraspPlan(
            candidate=touchset.candidate.index,
            position_K_m=np.array([*layer.position_K_m, layer.height_m]),
            yaw_rad=layer.yaw_rad,
            aperture_m=layer.aperture_m,
            opening_m=_extent(touchset.candidate, layer) + 2 * side_gap_m,
        )
        for _, layer in rated[: 1 + ALTERNATIVES]
    ]


def _extent(candidate: Candidate, layer: Layer) -> float:
    """Return the traced extent along the layer's closing direction, or the measured aperture if that is larger."""
    low, high = candidate.span_m(layer.yaw_rad + 0.5 * np.pi)
    return max(high - low, layer.aperture_m)
