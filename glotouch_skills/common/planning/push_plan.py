"""Pushes along the floor: which object to push, from where and how far, and where it stands afterwards.

Planar and quasi-static, in K. The fingers are a rectangle whose flat side pushes along its normal; open, they are a
fork with two such sides. The object slides with them, and its touched edge stays there (Mason, Mechanics of Robotic
Manipulation, 2001, section 7.2).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from glotouch_bt.motion import finger_outline_half_m
from glotouch_bt.perception.search import HALF_QUALITY_SD_M
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.robot import Array, Gripper
from glotouch_skills.common.hand import CLEARANCE_M
from glotouch_skills.common.planning.finger_space import (
    Neighbour,
    Rectangle,
    clearance_m,
    cramped_stances,
    finger_space_m,
    gap_m,
    sampled,
    wall_gap_m,
)

NEEDED_M = CLEARANCE_M + 0.002
"""Clearance of the open fingers that a push must reach: the margin of the fingers, and 2 mm for its own error."""
MIN_GAIN_M = 0.002
"""Least gain of clearance for which an object is pushed, if no push reaches `NEEDED_M`. Source: ours."""
STEPS_M = (0.010, 0.015, 0.020, 0.030, 0.040)
"""Distances to try, shortest first."""
DIRECTIONS = 16
"""Number of directions to try, besides the normals of the object's own sides."""
APPROACH_M = (0.012, 0.007)
"""Distances between fingers and object at the start to try: the wrist is measured without contact there."""
REACH_M = 0.06
"""Objects farther than this from the fingers' object are not pushed: the fingers are 14 mm thick, the gap 10 mm."""
PATCH_M = 0.0015
"""Edge points within this of the foremost touch the fingers, too."""
MAX_LEVER_M = 0.003
"""Largest distance of the push from the object's centre, beyond its touched edge: a longer lever turns the object."""
SLIM = 0.25
"""Least ratio of half the object's depth, along the push, to its height: a slimmer one may topple. The push acts at the
height where the object reaches farthest towards the flat fingers, h. It topples if friction times h is above half the
depth; with a friction of 0.6 (about the middle of conditions/nominal.yaml), the ratio allows h up to 0.42 of the
height."""
KEEP_M = 0.003
"""Gap that a pushed object keeps from the others. One that starts nearer only has to come no nearer."""
COMES_NEARER_M = 0.0005
"""See `KEEP_M`."""
MAY_TOUCH_M = 0.002
"""Objects that a pushed one passes at less than this may have been moved: the error of two outlines. Source: ours."""
GRAZE_COST_M = 0.010
"""Longer push that is preferred to one that passes another object at less than `MAY_TOUCH_M`."""
UNEVEN_M = 0.002
"""Largest distance, along the push, between the edges that the two fingers of the fork touch: the object turns until
both touch it. Source: ours."""
OVERLAP_M = 0.014
"""Least length by which an object reaches beyond the gap of the fork on each side. With 6 mm, a train that was pushed
at its rounded end turned and moved up to 7 mm across (`bench space`, realistic, seeds 57085 and 57089)."""
ALONG_SD_M = 0.001
"""Standard deviation of the displacement along the push. Of 46 pushes (`bench space`, realistic, seeds 57000-57011):
0.9 mm."""
PLACE_SD_M = 0.0015
"""Standard deviation of a traced centre along a push, in the same pushes: 1.5 mm."""
FOOT_SD_M = 0.002
"""Standard deviation of the edge that the low fingers meet against the traced one, which is higher, in the same
pushes."""
ACROSS_SD = 0.08
"""Standard deviation across the push, over its length: the object may turn and follow a rough side."""


@dataclass(frozen=True, eq=False)
class Push:
    """One push.

    Attributes:
        candidate: Index of the pushed object.
        yaw_K_rad: Direction of the push, and of x_P or its half turn.
        distance_m: Distance the object slides.
        start_K_m: (2,) place of P at the start.
        approach_m: Travel from there to the expected contact.
        opening_m: Opening of the jaws.
        space_m: Clearance of the open fingers over their object afterwards.
        near: Indices of objects that it passes at less than `MAY_TOUCH_M`.
    """

    candidate: int
    yaw_K_rad: float
    distance_m: float
    start_K_m: Array
    approach_m: float
    opening_m: float = 0.0
    space_m: float = math.nan
    near: tuple[int, ...] = ()

    @property
    def along_K(self) -> Array:
        """(2,) unit vector."""
        return np.array([math.cos(self.yaw_K_rad), math.sin(self.yaw_K_rad)])


def touched_edge_m(
    candidate: Candidate, yaw_K_rad: float, half_width_m: float, gap_m: float = 0.0
) -> tuple[float, float]:
    """Return the coordinate along a push of the edge that the fingers touch, and the push's lever about the centre.

    The fingers are centred on the object. The lever is the distance, across the push, from the object's centre to what
    they touch; zero if the centre lies within. With a gap, it is zero if both fingers touch the object at almost the
    same time, and infinite if one of them misses it.

    Args:
        candidate: The object.
        yaw_K_rad: Direction of the push.
        half_width_m: Half of the pushing side.
        gap_m: Gap in the middle of that side.
    """
    u = np.array([math.cos(yaw_K_rad), math.sin(yaw_K_rad)])
    centre = candidate.contour.centre_K_m
    points = np.concatenate([candidate.extent_K_m, sampled(candidate.contour.outline_K_m(90))])
    along, across = points @ u, (points - centre) @ np.array([-u[1], u[0]])
    before = np.abs(across) <= half_width_m
    if gap_m > 0.0:
        edges = [along[before & (side * across >= 0.5 * gap_m)].min(initial=math.inf) for side in (1.0, -1.0)]
        first, then = float(min(edges)), float(max(edges))
        if math.isinf(then):
            return first, math.inf
        return first, 0.0 if then - first <= UNEVEN_M else 0.5 * gap_m
    edge = float(along[before].min()) if before.any() else float(centre @ u)
    patch = across[before & (along <= edge + PATCH_M)]
    low, high = (float(patch.min()), float(patch.max())) if patch.size else (0.0, 0.0)
    return edge, max(low, -high, 0.0)


def displaced(candidate: Candidate, shift_K_m: Array, yaw_K_rad: float = 0.0, along_sd_m: float = 0.0,
              across_sd_m: float = 0.0) -> Candidate:  # fmt: skip
    """Return a candidate after a displacement, less certain by the deviations along and across a direction.

    Args:
        candidate: The object before.
        shift_K_m: (2,) displacement; the object is taken not to turn.
        yaw_K_rad: The direction.
        along_sd_m: Standard deviation of the displacement along it.
        across_sd_m: Standard deviation across it.
    """
    shift = np.asarray(shift_K_m, dtype=np.float64)
    contour = candidate.contour
    covariance, quality = contour.covariance, candidate.quality
    if covariance.size:
        covariance = covariance.copy()
        c, s = math.cos(yaw_K_rad), math.sin(yaw_K_rad)
        axes = np.array([[c, -s], [s, c]])
        covariance[:2, :2] += axes @ np.diag([along_sd_m**2, across_sd_m**2]) @ axes.T
    sd2 = along_sd_m**2 + across_sd_m**2
    quality = 1.0 / (1.0 / max(quality, 1e-9) + sd2 / HALF_QUALITY_SD_M**2)
    moved = replace(
        contour,
        centre_K_m=contour.centre_K_m + shift,
        boundary_K_m=contour.boundary_K_m + shift,
        covariance=covariance,
    )
    higher = np.array([*shift, 0.0])
    contacts = tuple(replace(c, tip_K_m=c.tip_K_m + higher, point_K_m=c.point_K_m + shift) for c in candidate.contacts)
    return replace(candidate, contour=moved, contacts=contacts, quality=quality)


def after_push(
    candidate: Candidate, push: Push, moved_m: float, early_m: float, across_sd_m: float | None = None
) -> Candidate:
    """Return the pushed object, from where it was met and where the fingers stopped.

    Its displacement is the distance between these two places. If it was met early or late, its traced centre was off,
    or the low fingers met a foot that is not part of the traced section. The centre is corrected by the share that the
    variances of both give to the first explanation (a Kalman update of one coordinate).

    Args:
        candidate: The object before.
        push: The push.
        moved_m: Distance between the two places.
        early_m: Distance by which it was met earlier than traced.
        across_sd_m: Standard deviation of its place across the push; None: `ACROSS_SD`.
    """
    covariance = candidate.contour.covariance
    known = float(push.along_K @ covariance[:2, :2] @ push.along_K) if covariance.size else 0.0
    variance = max(known, PLACE_SD_M**2)
    stood_m = -early_m * variance / (variance + FOOT_SD_M**2)
    shift = (stood_m + moved_m) * push.along_K
    across_sd_m = ACROSS_SD * moved_m if across_sd_m is None else across_sd_m
    return displaced(candidate, shift, push.yaw_K_rad, ALONG_SD_M, across_sd_m)


@dataclass(frozen=True, eq=False)
class PushPlanner:
    """Plans pushes among known objects.

    Attributes:
        candidates: All known objects.
        half_extent_m: (2,) half of the container's interior.
        gripper: The robot's gripper.
        opening_m: Opening of the jaws; above 0, the fingers are a fork.
    """

    candidates: Sequence[Candidate]
    half_extent_m: Array
    gripper: Gripper
    opening_m: float = 0.0

    @cached_property
    def hand_half_m(self) -> Array:
        """(2,) half sides of the outline of both fingers, along x_P and y_P."""
        return finger_outline_half_m(self.gripper, self.opening_m)

    def for_space(self, target: Candidate) -> Iterator[Push | None]:
        """Yield the best push so far that makes space for the fingers over an object; the last one is the answer.

        The space is made at a stance where they do not fit now. The shortest push that reaches `NEEDED_M`, of the
        object or of a neighbour; else the one with the largest gain; None if nothing gains `MIN_GAIN_M`. It yields once
        for each object, because the computation takes long.
        """
        outlines = {c.index: Neighbour.of(c) for c in self.candidates}
        around = [n for i, n in outlines.items() if i != target.index]
        cramped = cramped_stances(target, around, self.half_extent_m, self.gripper)
        if not cramped.any():
            yield None
            return
        now = finger_space_m(target, around, self.half_extent_m, self.gripper, cramped)
        best: tuple[float, Push] | None = None
        for moving in self.candidates:
            if moving.index != target.index and gap_m(outlines[moving.index], outlines[target.index]) > REACH_M:
                continue
            for yaw in directions(moving):
                for distance in STEPS_M:
                    push = self.along(moving, yaw, distance)
                    if isinstance(push, str):
                        break
                    push = replace(push, space_m=self._space_after(target, push, outlines, cramped))
                    if push.space_m < max(now + MIN_GAIN_M, 0.0) and push.space_m < NEEDED_M:
                        continue
                    cost = push_cost_m(push)
                    if best is None or cost < best[0]:
                        best = (cost, push)
                    if push.space_m >= NEEDED_M:
                        break
            yield best[1] if best else None

    def along(self, moving: Candidate, yaw_K_rad: float, distance_m: float) -> Push | str:
        """Return the push of an object in a direction, or why it cannot be made.

        Args:
            moving: The object.
            yaw_K_rad: Direction of the push.
            distance_m: Distance the object slides.
        """
        u = np.array([math.cos(yaw_K_rad), math.sin(yaw_K_rad)])
        half_width = float(self.hand_half_m[1])
        edge, lever = touched_edge_m(moving, yaw_K_rad, half_width, self.opening_m)
        if self.opening_m > 0.0 and not self._reaches_beyond(moving, yaw_K_rad):
            return "the object is too narrow for the open fingers"
        if lever > MAX_LEVER_M:
            return f"the fingers would touch the object {1e3 * lever:.0f} mm beside its centre and turn it"
        low, high = moving.span_m(yaw_K_rad)
        if 0.5 * (high - low) < SLIM * moving.height_m:
            return (
                f"the object is {1e3 * (high - low):.0f} mm deep and {1e3 * moving.height_m:.0f} mm high: it may topple"
            )
        others = [Neighbour.of(c) for c in self.candidates if c.index != moving.index]
        centre = moving.contour.centre_K_m
        at_edge = centre + (edge - float(centre @ u) - float(self.hand_half_m[0])) * u
        own = Neighbour.of(moving)
        refusal, start = "", None
        for approach in APPROACH_M:
            refusal = self._hand_fits(at_edge, u, yaw_K_rad, approach, distance_m, others, own)
            if not refusal:
                start = at_edge - approach * u
                break
        if start is None:
            return refusal
        near = []
        for step in np.linspace(0.0, distance_m, max(int(np.ceil(distance_m / 0.005)), 1) + 1)[1:]:
            moved = own.moved(step * u)
            wall = wall_gap_m(moved, self.half_extent_m)
            if wall < min(KEEP_M, wall_gap_m(own, self.half_extent_m) - COMES_NEARER_M):
                return "a wall is in the way of the object"
            for other in others:
                gap = gap_m(moved, other)
                if gap < min(KEEP_M, gap_m(own, other) - COMES_NEARER_M):
                    return f"candidate {other.index} is in the way of the object"
                if gap < MAY_TOUCH_M and other.index not in near:
                    near.append(other.index)
        return Push(moving.index, yaw_K_rad, distance_m, start, approach, self.opening_m, near=tuple(near))

    def _reaches_beyond(self, moving: Candidate, yaw_K_rad: float) -> bool:
        """Return True if an object reaches beyond the gap of the fork on both sides."""
        low, high = moving.span_m(yaw_K_rad + 0.5 * math.pi)
        centre = float(moving.contour.centre_K_m @ np.array([-math.sin(yaw_K_rad), math.cos(yaw_K_rad)]))
        return min(high - centre, centre - low) >= 0.5 * self.opening_m + OVERLAP_M

    def _hand_fits(
        self, at_edge: Array, u: Array, yaw: float, approach_m: float, distance_m: float, others: list[Neighbour],
        own: Neighbour,
    ) -> str:  # fmt: skip
        """Return why the fingers do not fit behind the object and on the way, or an empty text."""
        start = Rectangle(at_edge - approach_m * u, yaw, self.hand_half_m)
        least = clearance_m(start, [*others, own], self.half_extent_m)
        if least < CLEARANCE_M:
            return f"the fingers do not fit behind the object: {1e3 * least:.0f} mm, {1e3 * CLEARANCE_M:.0f} are needed"
        half = self.hand_half_m + np.array([0.5 * (approach_m + distance_m), 0.0])
        swept = Rectangle(at_edge + 0.5 * (distance_m - approach_m) * u, yaw, half)
        if clearance_m(swept, others, self.half_extent_m) < CLEARANCE_M:
            return "the fingers would meet something on the way"
        return ""

    def _space_after(self, target: Candidate, push: Push, outlines: dict[int, Neighbour], at: Array) -> float:
        shift = push.distance_m * push.along_K
        if push.candidate == target.index:
            target = displaced(target, shift)
        around = [n.moved(shift) if i == push.candidate else n for i, n in outlines.items() if i != target.index]
        return finger_space_m(target, around, self.half_extent_m, self.gripper, at)


def directions(candidate: Candidate) -> list[float]:
    """Return the directions, rad in K, in which an object may be pushed: normals of its sides, then all round."""
    if candidate.contour.family == "circle":
        sides = []
    else:
        corners = candidate.contour.outline_K_m()
        edges = np.diff(corners, axis=0)
        long = np.linalg.norm(edges, axis=1) >= 0.010  # shorter sides do not guide the object
        sides = [math.atan2(-e[0], e[1]) + math.pi for e in edges[long]]
    return [*sides, *(2 * math.pi * k / DIRECTIONS for k in range(DIRECTIONS))]


def push_cost_m(push: Push) -> float:
    """Return what a push costs, as a length; a push that does not reach `NEEDED_M` costs more than any that does."""
    short = max(NEEDED_M - push.space_m, 0.0)
    return push.distance_m + GRAZE_COST_M * len(push.near) + (1.0 + 100.0 * short if short else 0.0)
