"""Values of touch: contacts, contours, candidates, layers. Frozen, in the container frame K.

K: origin at the centre of the container's floor, z up. Planar quantities are (x, y) in K; yaw is about +z, from x_K.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from glotouch_bt.robot import Array

ContourKind = Literal["round", "box"]
ContourFamily = Literal["circle", "rectangle", "free"]

ZERO_SD_M = 0.3e-3
"""Standard deviation of an uncalibrated jaw zero. Source: 0.23 mm in conditions/nominal.yaml, 0.58 mm in harsh.yaml."""

PAD_NOISE_M = 2e-5
"""Standard deviation of an untouched pad's taxel. Source: conditions/nominal.yaml."""


@dataclass(frozen=True)
class Contact:
    """One contact of the probe's tip.

    Attributes:
        stamp_s: Robot clock at the onset.
        tip_K_m: (3,) centre of the ball at the onset.
        approach_K: (3,) unit direction of the tip's motion.
        reaction_K: (3,) unit direction of the force on the tip.
        point_K_m: (2,) contact point: the support-plane intercept (paper III-B).
        force_N: Norm of the filtered contact force when the guard tripped.
        pushed_K_m: (2,) estimated displacement of the object from the onset to rest (`estimate_push`).
    """

    stamp_s: float
    tip_K_m: Array
    approach_K: Array
    reaction_K: Array
    point_K_m: Array
    force_N: float
    pushed_K_m: Array = field(default_factory=lambda: np.zeros(2))


@dataclass(frozen=True)
class Contour:
    """A planar outline fitted to contacts.

    Attributes:
        kind: Squeeze plan: "round" (from three directions) or "box" (in three parallel tracks).
        centre_K_m: (2,); of a free outline, the area centroid of its convex hull.
        size_m: (long, short); for a circle the diameter twice, for a free outline the minimum-area rectangle.
        yaw_rad: Direction of the long side in K, in [-pi/2, pi/2); 0 for a circle.
        rms_m: Root mean square of the residuals.
        residuals_m: (k,) signed distance of each contact from the outline, outside positive.
        family: Fitted shape family; derived from `kind` by default.
        covariance: Of the family's parameters, SI: circle (x, y, radius), rectangle (x, y, yaw, half long side, half
            short side), free (x, y) of the centre; shape (0, 0) if unknown.
        boundary_K_m: (n, 2) corners of a free outline, counter-clockwise, not closed; (0, 2) for the other families.
    """

    kind: ContourKind
    centre_K_m: Array
    size_m: tuple[float, float]
    yaw_rad: float
    rms_m: float
    residuals_m: Array
    family: ContourFamily | None = None
    covariance: Array = field(default_factory=lambda: np.zeros((0, 0)))
    boundary_K_m: Array = field(default_factory=lambda: np.zeros((0, 2)))

    def __post_init__(self) -> None:
        if self.family is None:
            object.__setattr__(self, "family", "circle" if self.kind == "round" else "rectangle")

    @property
    def radius_m(self) -> float:
        """Radius of the enclosing circle about the centre."""
        if self.family == "free":
            return float(np.max(np.linalg.norm(self.boundary_K_m - self.centre_K_m, axis=1)))
        if self.family == "circle":
            return 0.5 * self.size_m[0]
        return 0.5 * float(np.hypot(*self.size_m))

    def outline_K_m(self, n: int = 48) -> Array:
        """Return the outline as a closed polyline (m, 2); a circle has `n` sides."""
        if self.family == "free":
            return np.concatenate([self.boundary_K_m, self.boundary_K_m[:1]])
        if self.family == "circle":
            a = np.linspace(0.0, 2 * np.pi, n + 1)
            local = 0.5 * self.size_m[0] * np.stack([np.cos(a), np.sin(a)], axis=1)
        else:
            l, s = 0.5 * self.size_m[0], 0.5 * self.size_m[1]
            local = np.array([[l, s], [-l, s], [-l, -s], [l, -s], [l, s]])
        c, s_ = np.cos(self.yaw_rad), np.sin(self.yaw_rad)
        return np.asarray(local @ np.array([[c, s_], [-s_, c]]) + self.centre_K_m)


@dataclass(frozen=True)
class Candidate:
    """An object found by the probe (the paper's C_i).

    Attributes:
        index: Order of discovery, from 0.
        contour: Its outline at the sensing height.
        height_m: Top above the container floor; a lower bound until the top was touched.
        quality: 0..1, certainty of the centre: 1/2 at a standard deviation of 5 mm (`search.candidates.quality`).
        contacts: Contacts with the object.
        top_touched: The top was touched.
    """

    index: int
    contour: Contour
    height_m: float
    quality: float
    contacts: tuple[Contact, ...]
    top_touched: bool = True

    def span_m(self, yaw_rad: float) -> tuple[float, float]:
        """Return (minimum, maximum) coordinate of contact points and outline along the direction `yaw_rad` in K."""
        along = self.extent_K_m @ np.array([np.cos(yaw_rad), np.sin(yaw_rad)])
        return float(along.min()), float(along.max())

    def strip_span_m(self, yaw_rad: float, at_K_m: Array, half_m: float) -> tuple[float, float]:
        """Return the same of a free outline, within `half_m` of the line through a point (2,); the point if empty."""
        u = np.array([np.cos(yaw_rad), np.sin(yaw_rad)])
        points = self.extent_K_m
        inside = points[np.abs((points - at_K_m) @ [-u[1], u[0]]) <= half_m]
        along = (inside if len(inside) else np.asarray(at_K_m)[None]) @ u
        return float(along.min()), float(along.max())

    @property
    def extent_K_m(self) -> Array:
        """(n, 2) contact points and outline vertices, in K. Protruding parts are only in the contacts."""
        points = np.array([c.point_K_m for c in self.contacts]).reshape(-1, 2)
        return np.concatenate([points, self.contour.outline_K_m(180)])


@dataclass(frozen=True)
class Layer:
    """One force-limited closure of the jaws.

    Attributes:
        height_m: Pads' mid-point above the container floor.
        aperture_m: Aperture on the plateau.
        position_K_m: (2,) pads' mid-point during the plateau.
        yaw_rad: Direction of the pads' width axis x_P in K; the jaws close perpendicular to it.
        left_m, right_m: (rows, cols) temporal median of the depth maps; layout as in `robot.TactileFrame`.
        force_N: Jaw force on the plateau.
        stable: The aperture reached a plateau and the arm stood still; only stable layers carry evidence.
        why_not: Failed condition of an unstable layer.
        slide_m, turn_rad, compliance_m: Estimated motion of the object (`ObjectMotion`): displacement along +y_P, turn
            about +z_K, closing after both pads touched; NaN if not estimated.
        zero_sd_m: Standard deviation of the aperture error common to all layers.
        noise_m: RMS of the (left, right) map before the closure, when the pads were untouched.
        relief: (2, 2, 7, 5) RMS slope of the fine relief in both pads' images (`relief_of_images`); None without
            images.
    """

    height_m: float
    aperture_m: float
    position_K_m: Array
    yaw_rad: float
    left_m: Array
    right_m: Array
    force_N: float
    stable: bool
    why_not: str = ""
    slide_m: float = math.nan
    turn_rad: float = math.nan
    compliance_m: float = math.nan
    zero_sd_m: float = ZERO_SD_M
    noise_m: tuple[float, float] = (PAD_NOISE_M, PAD_NOISE_M)
    relief: Array | None = None


@dataclass(frozen=True)
class TouchSequence:
    """The layers of one closure sequence, taken at one reference pose, lowest first.

    Attributes:
        position_K_m: (2,) reference open pose of P.
        yaw_rad: Reference yaw of x_P in K.
        layers: Closures at increasing heights.
    """

    position_K_m: Array
    yaw_rad: float
    layers: tuple[Layer, ...]


@dataclass(frozen=True)
class TouchSet:
    """All squeezes of one candidate.

    Attributes:
        candidate: The squeezed object.
        sequences: Usually three: three yaws if round, three parallel tracks if box-like.
    """

    candidate: Candidate
    sequences: tuple[TouchSequence, ...]

    @property
    def layers(self) -> tuple[Layer, ...]:
        """All layers of all sequences."""
        return tuple(layer for s in self.sequences for layer in s.layers)
