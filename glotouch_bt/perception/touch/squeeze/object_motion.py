"""How what is squeezed gave way while the jaws closed: slid, turned, slipped. From the robot's own senses only.

One jaw that touches first pushes the object along y_P. Its surface is then where that pad is: half the aperture from
the hand's middle, less what the gel gives. So the way from the first push on the wrist to the end is the object's slide
along y_P. Jaws that go on closing after both touch move the object otherwise: if the pads touch it at different places
along x_P, a lever b apart, closing by d turns it by d / b (a wedge that is squeezed out looks the same: an upper
bound, right for flat sides).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from glotouch_bt.perception.touch.squeeze.patches import THRESHOLD_M
from glotouch_bt.robot import Array, Observation, TactileFrame

PUSH_N = 0.3
"""Sideways force on the wrist that is a push: six standard deviations of a period's mean in the harsh conditions."""
BOTH_N = 1.5
"""Twice the jaw force less the push on the hand: more of it and the other jaw touches, too."""
BASELINE_PERIODS = 6
MIN_LEVER_M = 0.003
"""Closer than this the pads are opposite to each other: no lever."""
FRICTION_RADIUS = 0.65
"""c over half the diagonal of the outline: 0.54 for a 7 x 4 cm box of even pressure, 1 if it stands on its corners."""
TURN_LIMIT_RAD = float(np.deg2rad(20.0))
DEEP_TAXELS, MIN_TAXELS = 8, 6
SLIDE_M, TURN_RAD, GAVE_M = 0.0025, float(np.deg2rad(3.0)), 0.003
"""From here on a closure has moved its object: the spread of a sequence's own pose in `recognition` is of this size."""


@dataclass(frozen=True)
class Yielding:
    """What one closure did to its object.

    Attributes:
        slide_m: Displacement along +y_P of the side that was touched first, at the pad; 0 if both were touched at once.
        turn_rad: Turn about +z_B, at most `TURN_LIMIT_RAD` either way; 0 if nothing had a lever.
        compliance_m: How far the jaws closed after both touched, the gels' own give taken off.
        felt: Something was pushed or pressed at all.
    """

    slide_m: float
    turn_rad: float
    compliance_m: float
    felt: bool

    @property
    def moved(self) -> bool:
        """It is not where it was."""
        return abs(self.slide_m) > SLIDE_M or abs(self.turn_rad) > TURN_RAD or self.compliance_m > GAVE_M


def watch_yielding(
    blocks: Sequence[Observation], pad_width_m: float, middle_x_m: float = 0.0, half_diagonal_m: float = 0.03
) -> Yielding:
    """Judge a whole closure.

    Args:
        blocks: From open jaws to the plateau; depth maps from the first touch on, if there are any.
        pad_width_m: Of the gel window, along x_P.
        middle_x_m: Where the object's middle was traced, along x_P from the pads.
        half_diagonal_m: Of its outline.
    """
    if len(blocks) <= BASELINE_PERIODS:
        return Yielding(0.0, 0.0, 0.0, False)
    rotation = blocks[0].pose_B_P.rotation
    stamp = np.array([b.gripper.stamp_s for b in blocks])
    aperture = np.array([b.gripper.aperture_m for b in blocks])
    jaw = np.array([b.gripper.force_N for b in blocks])
    now = np.array([b.now_s for b in blocks])
    side_N = np.array([b.wrench_S[:, 1].mean() for b in blocks])
    side_N -= side_N[:BASELINE_PERIODS].mean()
    hand = np.array([b.position_B_P[-1] for b in blocks]) @ rotation[:, 1]
    frames = [b.tactile for b in blocks if b.tactile is not None]
    dents = np.array([_dents(f) for f in frames]).reshape(-1, 2)
    last = dents[-1] if len(dents) else np.zeros(2)

    slide = gave = 0.0
    pushed = np.flatnonzero(np.abs(side_N) > PUSH_N)
    if len(pushed):
        k = int(pushed[0])
        side = float(np.sign(side_N[k : k + 3].sum()))
        closed = float(np.interp(now[k], stamp, aperture) - aperture[-1])
        slide = float(hand[-1] - hand[k]) - side * (0.5 * closed - float(last[0 if side > 0 else 1]))
    both = np.flatnonzero(2 * jaw - np.abs(side_N) > BOTH_N)
    both = both[both >= BASELINE_PERIODS]
    if len(both):
        gave = max(float(np.interp(stamp[both[0]], stamp, aperture) - aperture[-1] - last.sum()), 0.0)
    turn = _turn(frames, dents, np.array([np.interp(f.stamp_s, stamp, aperture) for f in frames]), pad_width_m)
    turn -= slide * middle_x_m / ((FRICTION_RADIUS * half_diagonal_m) ** 2 + middle_x_m**2)
    turn = min(max(turn, -TURN_LIMIT_RAD), TURN_LIMIT_RAD)
    return Yielding(slide, float(turn * rotation[2, 2]), gave, bool(len(pushed) or len(both)))


def _turn(frames: Sequence[TactileFrame], dents: Array, aperture: Array, width_m: float) -> float:
    """Turn about +z_P: what the touched surfaces came closer, over the lever between the two touches."""
    left, right = (np.array([_middle_m(m, width_m) for m in maps]) for maps in _sides(frames))
    lever = right - left
    seen = np.flatnonzero(np.isfinite(lever))
    if len(seen) < 2:
        return 0.0
    between = (aperture + dents.sum(axis=1))[seen]
    arm = 0.5 * (lever[seen][1:] + lever[seen][:-1])
    use = np.abs(arm) > MIN_LEVER_M
    return float(np.sum(-np.diff(between)[use] / arm[use]))


def _sides(frames: Sequence[TactileFrame]) -> tuple[list[Array], list[Array]]:
    return [f.left_m for f in frames], [f.right_m for f in frames]


def _dents(frame: TactileFrame) -> tuple[float, float]:
    """How deep the object is in each gel: the depth that eight taxels reach; 0 if it does not touch."""
    depths = []
    for depth in (frame.left_m, frame.right_m):
        known = depth[np.isfinite(depth)]
        deep = float(np.partition(known, -DEEP_TAXELS)[-DEEP_TAXELS]) if len(known) >= DEEP_TAXELS else 0.0
        depths.append(deep if deep > THRESHOLD_M else 0.0)
    return depths[0], depths[1]


def _middle_m(depth: Array, width_m: float) -> float:
    """Place along x_P of a contact's middle, weighted by depth; NaN without contact."""
    touched = np.where(np.nan_to_num(depth) > THRESHOLD_M, np.nan_to_num(depth), 0.0)
    if np.count_nonzero(touched) < MIN_TAXELS:
        return float("nan")
    across = (np.arange(depth.shape[1]) + 0.5) / depth.shape[1] - 0.5
    weight = touched.sum(axis=0)
    return float(width_m * (weight @ across) / weight.sum())
