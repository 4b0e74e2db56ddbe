"""Motion of the object during a closure (slide, turn, compliance), from aperture, jaw force, wrist and depth maps.

Slide: the jaw that touches first pushes the object along y_P, and the object's surface moves with its pad. So the slide
is the pad's travel from the first wrist force to the end, corrected for the indentation of the gel. Turn: if the pads
touch at positions a lever b apart along x_P, closing by d after both contacts turns the object by d / b. This is an
upper bound, exact for flat sides; a wedge that slips out gives the same signal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from glotouch_bt.perception.touch.squeeze.patches import contact_threshold_m, mean_depth_m
from glotouch_bt.perception.touch.values import PAD_NOISE_M
from glotouch_bt.robot import Array, Observation, TactileFrame

PUSH_N = 0.3
"""Minimum lateral wrist force of a push: six standard deviations of a period's mean in the harsh conditions."""
BOTH_N = 1.5
"""Minimum of twice the jaw force minus the lateral wrist force when both jaws touch."""
BASELINE_PERIODS = 6
"""Number of first periods that give the wrist's baseline."""
MIN_LEVER_M = 0.003
"""Minimum lever between the two contacts; below it the pads are opposite each other."""
FRICTION_RADIUS = 0.65
"""Effective friction radius over half the diagonal of the outline: 0.54 for a 7 x 4 cm box of uniform pressure, 1 for
support at the corners."""
MAX_TURN_RAD = float(np.deg2rad(20.0))
"""Maximum estimated turn."""
DEEP_TAXELS = 8
"""Number of taxels that must reach a depth for it to count as the indentation."""
MIN_CONTACT_TAXELS = 6
"""Minimum number of taxels of a contact."""
MOVED_SLIDE_M = 0.0025
"""Slide above which the object counts as moved: the standard deviation of a sequence's pose in `recognition`."""
MOVED_TURN_RAD = float(np.deg2rad(3.0))
"""Turn above which the object counts as moved: the standard deviation of a sequence's pose in `recognition`."""
MOVED_COMPLIANCE_M = 0.003
"""Compliance above which the object counts as moved."""
Y_S: Array = np.array([0.0, 1.0, 0.0])
"""Direction of y_P for a sensor whose axes are parallel to P's."""


@dataclass(frozen=True)
class ObjectMotion:
    """Motion of the object during one closure.

    Attributes:
        slide_m: Displacement along +y_P at the first contact; 0 if both sides were touched at once.
        turn_rad: Turn about +z_B, at most `MAX_TURN_RAD` in magnitude; 0 without a lever.
        compliance_m: Closing of the jaws after both contacts, without the indentation of the gels.
        detected: A contact was detected.
    """

    slide_m: float
    turn_rad: float
    compliance_m: float
    detected: bool

    @property
    def share(self) -> float:
        """The motion over that from which on the object counts as moved."""
        return max(
            abs(self.slide_m) / MOVED_SLIDE_M,
            abs(self.turn_rad) / MOVED_TURN_RAD,
            self.compliance_m / MOVED_COMPLIANCE_M,
        )

    @property
    def moved(self) -> bool:
        """True if the closure moved the object."""
        return self.share > 1.0


def estimate_object_motion(
    blocks: Sequence[Observation],
    pad_width_m: float,
    middle_x_m: float = 0.0,
    half_diagonal_m: float = 0.03,
    noise_m: tuple[float, float] = (PAD_NOISE_M, PAD_NOISE_M),
    y_P_S: Array = Y_S,
) -> ObjectMotion:
    """Estimate the object's motion during a whole closure.

    Args:
        blocks: Observations from open jaws to the plateau, with depth maps from the first contact on if available.
        pad_width_m: Width of the gel window along x_P.
        middle_x_m: Centre of the object's outline along x_P, from the pads.
        half_diagonal_m: Half diagonal of the outline.
        noise_m: As in `Layer`.
        y_P_S: (3,) direction of y_P along the axes of the force sensor.
    """
    if len(blocks) <= BASELINE_PERIODS:
        return ObjectMotion(0.0, 0.0, 0.0, False)
    rotation = blocks[0].pose_B_P.rotation
    stamp = np.array([b.gripper.stamp_s for b in blocks])
    aperture = np.array([b.gripper.aperture_m for b in blocks])
    jaw = np.array([b.gripper.force_N for b in blocks])
    now = np.array([b.now_s for b in blocks])
    side_N = np.array([(b.wrench_S[:, :3] @ y_P_S).mean() for b in blocks])
    side_N -= side_N[:BASELINE_PERIODS].mean()
    hand = np.array([b.position_B_P[-1] for b in blocks]) @ rotation[:, 1]
    frames = [b.tactile for b in blocks if b.tactile is not None]
    dents = np.array([_dents(f, noise_m) for f in frames]).reshape(-1, 2)
    last = dents[-1] if len(dents) else np.zeros(2)

    slide = compliance = 0.0
    pushed = np.flatnonzero(np.abs(side_N) > PUSH_N)
    if len(pushed):
        k = int(pushed[0])
        side = float(np.sign(side_N[k : k + 3].sum()))
        closed = float(np.interp(now[k], stamp, aperture) - aperture[-1])
        slide = float(hand[-1] - hand[k]) - side * (0.5 * closed - float(last[0 if side > 0 else 1]))
    both = np.flatnonzero(2 * jaw - np.abs(side_N) > BOTH_N)
    both = both[both >= BASELINE_PERIODS]
    if len(both):
        compliance = max(float(np.interp(stamp[both[0]], stamp, aperture) - aperture[-1] - last.sum()), 0.0)
    apart = np.array([np.interp(f.stamp_s, stamp, aperture) for f in frames])
    turn = _turn(frames, dents, apart, pad_width_m, noise_m)
    turn -= slide * middle_x_m / ((FRICTION_RADIUS * half_diagonal_m) ** 2 + middle_x_m**2)
    turn = min(max(turn, -MAX_TURN_RAD), MAX_TURN_RAD)
    return ObjectMotion(slide, float(turn * rotation[2, 2]), compliance, bool(len(pushed) or len(both)))


def _turn(
    frames: Sequence[TactileFrame], dents: Array, aperture: Array, width_m: float, noise_m: tuple[float, float]
) -> float:
    """Return the turn about +z_P: approach of the touched surfaces over the lever between the contacts."""
    left = np.array([_middle_m(f.left_m, width_m, noise_m[0]) for f in frames])
    right = np.array([_middle_m(f.right_m, width_m, noise_m[1]) for f in frames])
    lever = right - left
    seen = np.flatnonzero(np.isfinite(lever))
    if len(seen) < 2:
        return 0.0
    between = (aperture + dents.sum(axis=1))[seen]
    arm = 0.5 * (lever[seen][1:] + lever[seen][:-1])
    use = np.abs(arm) > MIN_LEVER_M
    return float(np.sum(-np.diff(between)[use] / arm[use]))


def _dents(frame: TactileFrame, noise_m: tuple[float, float]) -> tuple[float, float]:
    """Return the indentation of each gel: the depth reached by DEEP_TAXELS taxels; 0 without contact."""
    depths = []
    for depth, noise in zip((frame.left_m, frame.right_m), noise_m, strict=True):
        known = depth[np.isfinite(depth)]
        deep = float(np.partition(known, -DEEP_TAXELS)[-DEEP_TAXELS]) if len(known) >= DEEP_TAXELS else 0.0
        depths.append(deep if deep > contact_threshold_m(noise, mean_depth_m(depth)) else 0.0)
    return depths[0], depths[1]


def _middle_m(depth: Array, width_m: float, noise_m: float) -> float:
    """Return the depth-weighted centre of a contact along x_P; NaN without contact."""
    threshold_m = contact_threshold_m(noise_m, mean_depth_m(depth))
    touched = np.where(np.nan_to_num(depth) > threshold_m, np.nan_to_num(depth), 0.0)
    if np.count_nonzero(touched) < MIN_CONTACT_TAXELS:
        return float("nan")
    across = (np.arange(depth.shape[1]) + 0.5) / depth.shape[1] - 0.5
    weight = touched.sum(axis=0)
    return float(width_m * (weight @ across) / weight.sum())
