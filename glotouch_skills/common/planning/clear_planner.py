"""Clear the space beside an object: which neighbour to take out, how to grasp it, and where to set it down.

Planar, in K. A place is free if the neighbour's footprint keeps a gap from all other objects and from the walls, and if
the open fingers that release it there are clear, too.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from glotouch_bt.perception.touch import Candidate
from glotouch_bt.robot import Array, Gripper
from glotouch_skills.common.hand import CLEARANCE_M
from glotouch_skills.common.planning.finger_space import (
    SIDE_GAP_M,
    Neighbour,
    cramped_stances,
    finger_clearance_m,
    finger_space_m,
    gap_m,
)
from glotouch_skills.common.planning.grasp_plan import GraspPlan
from glotouch_skills.common.planning.outline_grasp import outline_grasp
from glotouch_skills.common.planning.push_plan import MIN_GAIN_M, NEEDED_M, REACH_M
from glotouch_skills.common.planning.squeeze_plan import Stance

GRID_M = 0.008
"""Spacing of the places to try. Source: ours; a place is at most 6 mm farther than the nearest free one."""
TURNS_RAD = tuple(math.radians(turn) for turn in (0.0, 90.0, -90.0, 45.0, -45.0))
"""Turns of the object to try; all are considered before the nearest place is chosen."""
GAPS_M = (0.028, 0.020, 0.012)
"""Gaps to keep from other objects and walls, widest first. The widest is a finger (14 mm), its gap to the object
(10 mm) and its clearance (4 mm): the jaws fit all round. The least covers the errors of two outlines and of the
carried object."""
MAX_PLACES = 8
"""Largest number of places that are returned."""
PLACES_APART_M = 0.020
"""Distance between returned places, so that an arm that does not reach one may reach the next."""
RELEASE_MARGIN_M = 0.002
"""Clearance of the open fingers at the place, beyond `CLEARANCE_M`: error of the carried object."""
PLACES_AT_ONCE = 250
"""Number of places that are rated in one numpy operation, which takes some milliseconds."""
ROUNDING_M = 1e-9
"""Far above the rounding of coordinates, far below any gap that counts. Source: ours."""


@dataclass(frozen=True, eq=False)
class FreePlace:
    """Place to set an object down: a turn about its outline's centre, then a displacement.

    Attributes:
        candidate: Index of the object.
        centre_K_m: (2,) centre of its outline where it stands.
        shift_K_m: (2,) displacement of that centre.
        turn_rad: Turn about the vertical.
        gap_m: Least gap that it keeps from other objects and walls.
    """

    candidate: int
    centre_K_m: Array
    shift_K_m: Array
    turn_rad: float
    gap_m: float

    def moved(self, position_K_m: Array) -> Array:
        """Return where a place (2,) on the object is afterwards."""
        c, s = math.cos(self.turn_rad), math.sin(self.turn_rad)
        turned = np.array([[c, -s], [s, c]]) @ (np.asarray(position_K_m)[:2] - self.centre_K_m)
        return np.asarray(self.centre_K_m + self.shift_K_m + turned)


@dataclass(frozen=True, eq=False)
class Clearing:
    """One object to take out.

    Attributes:
        grasp: How to grasp it.
        places: Where it may be set down, nearest first.
        space_m: Clearance of the open fingers over the cramped object afterwards.
    """

    grasp: GraspPlan
    places: tuple[FreePlace, ...]
    space_m: float = math.nan


@dataclass(frozen=True, eq=False)
class ClearPlanner:
    """Plans which object to take out among known objects.

    Attributes:
        candidates: All known objects.
        half_extent_m: (2,) half of the container's interior.
        gripper: The robot's gripper.
        obstacles: Other things that stand in the box.
    """

    candidates: Sequence[Candidate]
    half_extent_m: Array
    gripper: Gripper
    obstacles: Sequence[Neighbour] = ()

    def for_space(self, target: Candidate) -> Iterator[Clearing | None]:
        """Yield the best plan so far that makes space for the fingers over an object; the last one is the answer.

        The space is made at a stance where they do not fit now. Of the neighbours without which the fingers have
        `NEEDED_M`, or the most, the one that is carried least; or the object itself, if that is better. None if nothing
        gains `MIN_GAIN_M`, can be grasped, and has a free place. It yields often, because the computation takes longer
        than a control period.
        """
        outlines = {c.index: Neighbour.of(c) for c in self.candidates}
        around = [n for i, n in outlines.items() if i != target.index]
        cramped = cramped_stances(target, [*around, *self.obstacles], self.half_extent_m, self.gripper)
        if not cramped.any():
            yield None
            return
        now = self._space(target, around, cramped)
        best: tuple[float, Clearing] | None = None
        for moving in self.candidates:
            if moving.index != target.index:
                if gap_m(outlines[moving.index], outlines[target.index]) > REACH_M:
                    continue
                without = self._space(target, [n for n in around if n.index != moving.index], cramped)
                yield best[1] if best else None
                if without < max(now + MIN_GAIN_M, 0.0):
                    continue
            found: Clearing | None = None
            for planned in self.take_out(moving, leave=False):
                found = planned
                yield best[1] if best else None
            if found is None:
                continue
            found = replace(found, space_m=self._space_after(target, moving, found.places[0], around, cramped))
            if found.space_m < max(now + MIN_GAIN_M, 0.0):
                continue
            cost = float(np.linalg.norm(found.places[0].shift_K_m)) + 100.0 * max(NEEDED_M - found.space_m, 0.0)
            if best is None or cost < best[0]:
                best = (cost, found)
        yield best[1] if best else None

    def take_out(self, moving: Candidate, leave: bool = True) -> Iterator[Clearing | None]:
        """Yield None while it computes, then the plan to take an object out; None again if there is none.

        Args:
            moving: The object.
            leave: It has to leave its place entirely.
        """
        others = [Neighbour.of(c) for c in self.candidates if c.index != moving.index]
        grasp = outline_grasp(moving, others, self.half_extent_m, self.gripper)
        yield None
        if grasp is None:
            return
        for places in self.free_places(moving, grasp, leave):
            if places:
                yield Clearing(grasp, places)
                return
            yield None

    def free_places(
        self, moving: Candidate, grasp: GraspPlan, leave: bool = True
    ) -> Iterator[tuple[FreePlace, ...]]:  # fmt: skip
        """Yield nothing (an empty tuple) while it computes, then the places for a grasped object, nearest first.

        Args:
            moving: The object, where it was taken.
            grasp: How it is held.
            leave: It has to leave its place entirely.
        """
        others = [Neighbour.of(c) for c in self.candidates if c.index != moving.index]
        at = Stance(grasp.position_K_m[:2], grasp.yaw_rad, grasp.opening_m, grasp.aperture_m)
        for gap in GAPS_M:
            places: list[FreePlace] = []
            for found in self._places(moving, at, gap, others, leave):
                if isinstance(found, FreePlace):
                    places.append(found)
                yield ()
                if len(places) == MAX_PLACES:
                    break
            if places:
                yield tuple(places)
                return

    def _space(self, target: Candidate, neighbours: Sequence[Neighbour], at: Array) -> float:
        return finger_space_m(target, [*neighbours, *self.obstacles], self.half_extent_m, self.gripper, at)

    def _space_after(
        self, target: Candidate, moving: Candidate, place: FreePlace, around: list[Neighbour], at: Array
    ) -> float:  # fmt: skip
        """Return the clearance of the open fingers over an object after another one, or itself, was set down."""
        if moving.index == target.index:  # the fingers may be on any side, so all of its gap counts
            return place.gap_m - SIDE_GAP_M - 2.0 * float(self.gripper.finger.half_m[1])
        there = placed(Neighbour.of(moving), place)
        return self._space(target, [*(n for n in around if n.index != moving.index), there], at)

    def _places(
        self, moving: Candidate, at: Stance, gap: float, others: list[Neighbour], leave: bool
    ) -> Iterator[FreePlace | None]:  # fmt: skip
        """Yield free places, nearest first and `PLACES_APART_M` apart, and None now and then."""
        own, centre = Neighbour.of(moving), moving.contour.centre_K_m
        standing = [*others, *self.obstacles]
        steps = [np.arange(-h + GRID_M, h, GRID_M) for h in self.half_extent_m]
        centres = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 2)
        rated: list[tuple[float, float, Array]] = []
        for turn in TURNS_RAD:
            turned = placed(own, FreePlace(moving.index, centre, np.zeros(2), turn, gap))
            for k in range(0, len(centres), PLACES_AT_ONCE):
                some = centres[k : k + PLACES_AT_ONCE] - centre
                some = some[keeps_gap(turned, some, gap, standing, self.half_extent_m)]
                if leave:
                    some = some[keeps_gap(turned, some, 0.0, [own], self.half_extent_m)]
                rated += [(float(np.linalg.norm(shift)), turn, shift) for shift in some]
                yield None
        chosen: list[FreePlace] = []
        for _, turn, shift in sorted(rated, key=lambda r: (r[0], abs(r[1]))):
            place = FreePlace(moving.index, centre, shift, turn, gap)
            if any(np.linalg.norm(shift - p.shift_K_m) < PLACES_APART_M for p in chosen):
                continue
            hand = replace(at, position_K_m=place.moved(at.position_K_m), yaw_K_rad=at.yaw_K_rad + turn)
            space = finger_clearance_m(hand, standing, self.half_extent_m, self.gripper)
            if space >= CLEARANCE_M + RELEASE_MARGIN_M:
                chosen.append(place)
                yield place
            else:
                yield None


def placed(one: Neighbour, place: FreePlace) -> Neighbour:
    """Return the footprint of an object at a place."""
    return Neighbour.within(one.index, np.array([place.moved(p) for p in one.corners_K_m]))


def keeps_gap(
    one: Neighbour, shifts_K_m: Array, gap_m: float, others: Sequence[Neighbour], half_extent_m: Array
) -> Array:  # fmt: skip
    """Return after which displacements (n,), bool, a footprint keeps a gap from all other objects and from the walls.

    A displacement that a wall or one object rules out is not compared with the rest.

    Args:
        one: The footprint.
        shifts_K_m: (n, 2).
        gap_m: The gap.
        others: What stands there.
        half_extent_m: (2,) half of the container's interior.
    """
    low, high = one.points_K_m.min(axis=0) + shifts_K_m, one.points_K_m.max(axis=0) + shifts_K_m
    free = (half_extent_m - np.maximum(high, -low)).min(axis=1) >= gap_m
    for other in others:
        apart = np.maximum(other.points_K_m.min(axis=0) - high, low - other.points_K_m.max(axis=0)).max(axis=1)
        close = apart < gap_m + ROUNDING_M  # what is farther along one axis is farther
        for standing, moved, way in ((other, one, shifts_K_m), (one, other, -shifts_K_m)):
            some = free & close
            if some.any():
                points = (moved.points_K_m[None] + way[some, None]).reshape(-1, 2)
                free[some] = standing.distance_m(points).reshape(some.sum(), -1).min(axis=1) >= gap_m
    return np.asarray(free)
