"""Clearance of arm, hand and held probe from the nominal world.

Broad phase: axis-aligned boxes of all parts at all postures against all obstacles, in one numpy batch. Narrow phase:
exact distances from python-fcl for the remaining pairs. Frame B; obstacles are given in K.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from glotouch_bt.lazy import lazy_module
from glotouch_bt.motion.kinematics import Kinematics
from glotouch_bt.motion.shapes import (
    OWN_OBSTACLES,
    WALLS,
    MovingPart,
    Obstacle,
    arm_parts,
    prism,
    stowed_probe,
    tool_parts,
    world_obstacles,
)
from glotouch_bt.robot import Array, ParamError, UnknownName, World

if TYPE_CHECKING:
    import fcl
else:
    fcl = lazy_module("fcl")

_LEAVING_M = 2e-4
"""Tolerance for a part that starts below the margin: it may not come nearer than its start by more than this."""


@dataclass(frozen=True)
class ClearanceViolation:
    """A posture with too little clearance of one part from one obstacle.

    Attributes:
        index: Index of the posture in the batch.
        part: Moving part, e.g. "left finger".
        obstacle: Obstacle it comes too near to.
        distance_m: Signed distance; negative is penetration.
        margin_m: Required clearance.
    """

    index: int
    part: str
    obstacle: str
    distance_m: float
    margin_m: float

    @property
    def for_space(self) -> bool:
        """True if only space is lacking: the obstacle is a wall of the container or was added, as objects in it are."""
        return self.obstacle in WALLS or self.obstacle not in OWN_OBSTACLES

    def __str__(self) -> str:
        thing = f"{self.obstacle} of the container" if self.obstacle in (*WALLS, "floor") else self.obstacle
        if self.distance_m <= 0:
            return f"{self.part} would hit {thing} (penetration {-self.distance_m * 1e3:.1f} mm)"
        return f"{self.part} would pass {thing} at {self.distance_m * 1e3:.1f} mm (margin {self.margin_m * 1e3:.1f} mm)"


class Scene:
    """Obstacles, moving parts and the pairs of them that may touch.

    Parts: "<link name>" of each moving link, "gripper body", "left finger", "right finger", and while the probe is
    held "tip", "shaft", "handle". Groups: "fingers", "tool" (tip, shaft, handle), "hand" (all but the arm's links),
    "arm". Obstacles: "floor", "wall +x", "wall -x", "wall +y", "wall -y" (of the container, in K), "table" (under it),
    "holder", "probe" (its handle in the holder) and the names given to `add_obstacle`.

    Self-collision is not checked: above a container in front of it the arm cannot fold that far.

    Args:
        kinematics: The arm.
        world: Nominal container, probe and holder.
    """

    margin_m = 0.002
    """Required clearance of every pair that may not touch."""

    def __init__(self, kinematics: Kinematics, world: World) -> None:
        self._kinematics = kinematics
        self._world = world
        self._request = fcl.DistanceRequest(enable_nearest_points=False, enable_signed_distance=True)
        self._arm_parts = arm_parts(kinematics.description)
        self._hand_pose = kinematics.description.pose_last_E @ kinematics.description.gripper.pose_E_P
        self._tool_parts = tool_parts(kinematics.description, world.probe)
        self._holding = False
        self._allowed: set[tuple[str, str]] = set()
        self._added: dict[str, dict[str, Any]] = {}
        self._obstacles: dict[str, Obstacle] = {}
        for obstacle in world_obstacles(world):
            self._obstacles[obstacle.name] = obstacle
        self._probe = stowed_probe(world)
        self._obstacles[self._probe.name] = self._probe

    # -- contents ----------------------------------------------------------------------------------------------------

    @property
    def obstacles(self) -> tuple[str, ...]:
        """Names of all obstacles."""
        return tuple(self._obstacles)

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of all moving parts, including the probe's, held or not."""
        return tuple(p.name for p in (*self._arm_parts, *self._tool_parts))

    @property
    def holding_tool(self) -> bool:
        """True while the probe moves with the hand."""
        return self._holding

    def hold_tool(self, held: bool) -> None:
        """Move the probe into the jaws (its parts move with the hand) or into its holder (an obstacle)."""
        self._holding = held
        if held:
            self._obstacles.pop(self._probe.name, None)
        else:
            self._obstacles[self._probe.name] = self._probe

    def add_obstacle(
        self, name: str, outline_K_m: npt.ArrayLike, *, height_m: float, base_K_m: float = 0.0
    ) -> None:  # fmt: skip
        """Add or replace an upright prism over the convex hull of an outline in the container.

        Args:
            name: Any name but a built-in obstacle's.
            outline_K_m: (n, 2) points on its outline in K, in any order.
            height_m: Its top above its base.
            base_K_m: Height of its base above the container floor.

        Raises:
            ParamError: A built-in name, an outline without an area, or a height that is not positive and finite.
        """
        if name in OWN_OBSTACLES:
            raise ParamError("obstacle", name, "not the name of a built-in obstacle")
        outline = np.array(outline_K_m, dtype=np.float64)
        if not (0.0 < height_m < np.inf):
            raise ParamError(f"obstacle {name}", height_m, "a positive height")
        pose_B_K = self._world.container.pose_B_K
        self._obstacles[name] = prism(name, pose_B_K, outline, base_K_m, height_m)
        self._added[name] = {"outline_K_m": outline, "height_m": height_m, "base_K_m": base_K_m}

    def remove_obstacle(self, name: str) -> None:
        """Remove an added obstacle and its allowed contacts.

        Raises:
            UnknownName: No such added obstacle.
        """
        added = [n for n in self._obstacles if n not in OWN_OBSTACLES]
        if name not in added:
            raise UnknownName("obstacle", name, added)
        del self._obstacles[name], self._added[name]
        self._allowed = {pair for pair in self._allowed if pair[1] != name}

    def clear_obstacles(self) -> None:
        """Remove every added obstacle."""
        for name in [n for n in self._obstacles if n not in OWN_OBSTACLES]:
            self.remove_obstacle(name)

    def state(self) -> dict[str, Any]:
        """Return the added obstacles, the allowed contacts and whether the probe is held, for `restore`."""
        added = tuple((name, dict(given)) for name, given in self._added.items())
        return {"holding": self._holding, "added": added, "allowed": frozenset(self._allowed)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore a `state`."""
        self.clear_obstacles()
        for name, given in state["added"]:
            self.add_obstacle(name, **given)
        self.hold_tool(bool(state["holding"]))
        self._allowed = set(state["allowed"])

    def allow(self, part: str, obstacle: str) -> None:
        """Allow a part, or a group of parts, to touch an obstacle.

        Raises:
            UnknownName: No such part, group or obstacle.
        """
        self._allowed |= self._pairs(part, obstacle)

    def disallow(self, part: str, obstacle: str) -> None:
        """Undo `allow`."""
        self._allowed -= self._pairs(part, obstacle)

    def _pairs(self, part: str, obstacle: str) -> set[tuple[str, str]]:
        tool = [p.name for p in self._tool_parts]
        fingers = ["left finger", "right finger"]
        hand = ["gripper body", *fingers, *tool]
        groups = {
            "fingers": fingers,
            "tool": tool,
            "hand": hand,
            "arm": [n for n in self.parts if n not in hand],
        }
        if part not in groups and part not in self.parts:
            raise UnknownName("part", part, (*self.parts, *groups))
        known = {*self._obstacles, "probe"}
        if obstacle not in known:
            raise UnknownName("obstacle", obstacle, known)
        return {(name, obstacle) for name in groups.get(part, [part])}

    # -- queries -----------------------------------------------------------------------------------------------------

    def violations(self, q: Array, aperture_m: float, margin_m: float | None = None) -> list[ClearanceViolation]:
        """Return every pair with too little clearance at `q` (dof,) rad, with the jaws at `aperture_m`."""
        margin_m = self.margin_m if margin_m is None else margin_m
        return list(self._violations(np.asarray(q, dtype=np.float64)[None], aperture_m, margin_m))

    def first_violation(self, q: Array, aperture_m: float) -> ClearanceViolation | None:
        """Return the first clearance violation along postures (n, dof) rad, or None.

        A pair below the margin at the first posture may stay or part, but not come nearer. So a part can retract from a
        contact.
        """
        return next(self._violations(q, aperture_m, self.margin_m), None)

    def _violations(self, q: Array, aperture_m: float, margin_m: float) -> Iterator[ClearanceViolation]:
        """Yield the violations of `first_violation`, all of them in the order of the postures."""
        parts = [*self._arm_parts, *(self._tool_parts if self._holding else ())]
        obstacles = list(self._obstacles.values())
        rotations, centres = self._placed(parts, q, aperture_m)
        half = np.abs(rotations) @ np.stack([p.half_m for p in parts])[None, :, :, None]
        gap = np.abs(centres[:, :, None] - np.stack([o.centre_m for o in obstacles]))
        gap -= half[:, :, None, :, 0] + np.stack([o.half_m for o in obstacles])
        near = (gap < margin_m).all(axis=3)
        near &= ~np.array([[(p.name, o.name) in self._allowed for o in obstacles] for p in parts], dtype=bool)
        at_start: dict[tuple[int, int], float] = {}
        for n, i, k in np.argwhere(near).tolist():
            body = parts[i].body
            body.setTransform(fcl.Transform(rotations[n, i], centres[n, i]))
            distance = fcl.distance(body, obstacles[k].body, self._request, fcl.DistanceResult())
            if distance >= margin_m:
                continue
            if len(q) > 1:
                if n == 0:
                    at_start[i, k] = distance
                    continue
                if distance >= at_start.get((i, k), np.inf) - _LEAVING_M:
                    continue
            yield ClearanceViolation(n, parts[i].name, obstacles[k].name, float(distance), margin_m)

    def _placed(self, parts: list[MovingPart], q: Array, aperture_m: float) -> tuple[Array, Array]:
        links = [self._kinematics.link_placements(row) for row in q]
        index = [p.link for p in parts]
        link_R = np.stack([r for r, _ in links])[:, index]
        link_p = np.stack([p for _, p in links])[:, index]
        origin = np.stack([p.origin_m for p in parts])
        opening = self._hand_pose.rotation[:, 1] * (0.5 * aperture_m)
        for i, part in enumerate(parts):
            if part.name == "left finger":
                origin[i] += opening
            elif part.name == "right finger":
                origin[i] -= opening
        return link_R @ np.stack([p.rotation for p in parts]), link_p + (link_R @ origin[None, :, :, None])[..., 0]
