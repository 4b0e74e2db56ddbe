"""Pose of an object after it was grasped, carried and released. Planar, in K."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from glotouch_bt.perception.search import HALF_QUALITY_SD_M
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.robot import Array
from glotouch_skills.common.planning import sampled

ACROSS_SD_M = 0.002
"""Standard deviation of the object's place across the jaws: at the pads' height its middle is not that of the
outline."""
ALONG_SD_M = 0.002
"""Standard deviation along the jaws' width: it slides as the jaws close, and moves as it is set down."""
TURN_SD_RAD = math.radians(4.0)
"""Standard deviation of its yaw: it aligns with the pads as they close."""


@dataclass(frozen=True, eq=False)
class Grip:
    """The hand seen from above.

    Attributes:
        position_K_m: (2,) pads' mid-point.
        yaw_K_rad: Direction of x_P.
    """

    position_K_m: Array
    yaw_K_rad: float


def centred_m(candidate: Candidate, grip: Grip, pad_half_m: float) -> Array:
    """Return the displacement (2,) by which closing jaws bring an outline's middle between the pads.

    Args:
        candidate: The object before.
        grip: The closed hand.
        pad_half_m: Half of the pads' width.
    """
    c, s = math.cos(grip.yaw_K_rad), math.sin(grip.yaw_K_rad)
    along, across = np.array([c, s]), np.array([-s, c])
    points = np.concatenate([candidate.extent_K_m, sampled(candidate.contour.outline_K_m(90))]) - grip.position_K_m
    between = points[np.abs(points @ along) <= pad_half_m] @ across
    if not between.size:
        return np.zeros(2)
    return np.asarray(-0.5 * (between.min() + between.max()) * across)


def after_carry(candidate: Candidate, taken: Grip, released: Grip, pad_half_m: float) -> Candidate:
    """Return the object where it was released: it was centred between the pads and moved with the hand.

    Its outline, contacts and height move along; its place becomes less certain.

    Args:
        candidate: The object before.
        taken: The hand when the jaws had closed.
        released: The hand when they opened.
        pad_half_m: Half of the pads' width.
    """
    centring = centred_m(candidate, taken, pad_half_m)
    turn = math.remainder(released.yaw_K_rad - taken.yaw_K_rad, 2 * math.pi)
    c, s = math.cos(turn), math.sin(turn)
    R = np.array([[c, -s], [s, c]])

    def moved(points: Array) -> Array:
        return np.asarray((points + centring - taken.position_K_m) @ R.T + released.position_K_m)

    def turned(vectors: Array) -> Array:
        return np.asarray([*(R @ vectors[:2]), *vectors[2:]])

    contacts = tuple(
        replace(
            k,
            tip_K_m=np.array([*moved(k.tip_K_m[:2]), k.tip_K_m[2]]),
            point_K_m=moved(k.point_K_m),
            approach_K=turned(k.approach_K),
            reaction_K=turned(k.reaction_K),
            pushed_K_m=turned(k.pushed_K_m),
        )
        for k in candidate.contacts
    )
    contour = candidate.contour
    yaw = contour.yaw_rad if contour.family == "circle" else _half_turn(contour.yaw_rad + turn)
    sd2 = ALONG_SD_M**2 + ACROSS_SD_M**2
    return replace(
        candidate,
        contour=replace(
            contour,
            centre_K_m=moved(contour.centre_K_m),
            boundary_K_m=moved(contour.boundary_K_m) if len(contour.boundary_K_m) else contour.boundary_K_m,
            yaw_rad=yaw,
            covariance=_covariance(contour.covariance, R, released.yaw_K_rad, contour.family == "rectangle"),
        ),
        contacts=contacts,
        quality=1.0 / (1.0 / max(candidate.quality, 1e-9) + sd2 / HALF_QUALITY_SD_M**2),
    )


def _half_turn(yaw_rad: float) -> float:
    """Return an angle modulo half a turn, in [-pi/2, pi/2)."""
    return (yaw_rad + 0.5 * math.pi) % math.pi - 0.5 * math.pi


def _covariance(before: Array, R: Array, yaw_rad: float, has_yaw: bool) -> Array:
    """Return the covariance of an outline's parameters after it was turned by R and released at a yaw of the hand."""
    if not before.size:
        return before
    full = np.eye(len(before))
    full[:2, :2] = R
    after = full @ before @ full.T
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    axes = np.array([[c, -s], [s, c]])
    after[:2, :2] += axes @ np.diag([ALONG_SD_M**2, ACROSS_SD_M**2]) @ axes.T
    if has_yaw:
        after[2, 2] += TURN_SD_RAD**2
    return np.asarray(after)
