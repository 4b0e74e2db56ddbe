"""Sweep the container with the probe until something is touched."""

from __future__ import annotations

import numpy as np

from glotouch_bt.motion import Motion
from glotouch_bt.robot import Array, MotionRefused
from glotouch_bt.search import NearestFrontier, SearchMap, SearchPolicy
from glotouch_bt.touch import Contact, GuardParams
from skills.base import In, Out, Skill, SkillFailed, SkillParams, SkillRun, param
from skills.held_tool import HeldTool
from skills.probing import Prober

AT_HEIGHT_M = 0.004
"""The ball counts as lowered within this of the sweeping height."""
MAX_HOPS = 12
"""Most changes of place by lifting the ball, per sweep."""
WAYS_IN_APART_M = 0.03


class GuardedSweepParams(SkillParams):
    """Parameters of `guarded_sweep`."""

    expected_objects: int = param("How many objects the container holds", default=5, ge=1, le=20)
    height_m: float = param("Ball centre above the floor while sweeping", unit="m", default=0.018, ge=0.009, le=0.06)
    speed_m_s: float = param("Sweeping speed", unit="m/s", default=0.04, gt=0.0, le=0.08)
    travel_speed_m_s: float = param("Speed above the objects", unit="m/s", default=0.10, gt=0.0, le=0.15)
    headroom_m: float = param(
        "Ball's height above the floor when crossing objects", unit="m", default=0.13, ge=0.02, le=0.2
    )
    wall_gap_m: float = param("Ball centre kept from the walls", unit="m", default=0.012, ge=0.008, le=0.05)
    coverage_radius_m: float = param(
        "A place farther than this from every swept path is unexplored", unit="m", default=0.024, ge=0.005, le=0.08
    )
    retreat_m: float = param("Way back from a contact", unit="m", default=0.006, ge=0.002, le=0.03)


class GuardedSweep(Skill):
    """Sweep from where the probe is to the nearest unexplored place, and on, until a contact stops it.

    SUCCESS: something was touched; `contact` says where, the probe has retreated from it.
    FAILURE `search_exhausted`: no unexplored place is left to reach.
    FAILURE `motion_refused`: the probe cannot be brought into the container.
    """

    Params = GuardedSweepParams
    params: GuardedSweepParams
    tool = In(HeldTool, "the held probe")
    previous = In(SearchMap, "what has been explored so far", key="map", required=False)
    map = Out(SearchMap, "what has been explored now")
    contact = Out(Contact, "the contact that ended the sweep")

    def run(self) -> SkillRun:
        """See the class."""
        p, tool = self.params, self.tool
        belief = self.previous or self._blank_map()
        prober = Prober(self.context, tool, GuardParams())
        policy = NearestFrontier(coverage_radius_m=p.coverage_radius_m)
        contact: Contact | None = None
        hops = 0
        while contact is None:
            tip = prober.tip_K_m
            lowered = abs(tip[2] - self._height(tool)) < AT_HEIGHT_M
            route = policy.next_path(belief, tip[:2]) if lowered else None
            if route is not None:
                contact, belief = yield from self._sweep(prober, belief, route)
                continue
            spot = self._way_in(policy, belief, tip[:2]) if hops < MAX_HOPS else None
            if spot is None:
                self.map = belief
                raise SkillFailed(
                    "search_exhausted",
                    f"nothing unexplored is left; {belief.found} of {p.expected_objects} objects were found",
                    advice="lower coverage_radius_m to search more finely",
                    found=belief.found,
                )
            hops += 1
            belief = yield from self._enter(prober, belief, spot)
        self.event("contact", contact=contact)
        yield from prober.retreat(-contact.approach_K, p.retreat_m, p.speed_m_s)
        self.map = belief
        self.contact = contact

    def _sweep(self, prober: Prober, belief: SearchMap, route: Array) -> Motion[tuple[Contact | None, SearchMap]]:
        """Along a route until something is touched; a leg that is refused drops the frontier."""
        for waypoint in route:
            goal = np.array([*waypoint, self._height(self.tool)])
            try:
                probed = yield from prober.move(goal, self.params.speed_m_s)
            except MotionRefused as refusal:
                self.event("note", text=f"frontier dropped: {refusal}")
                return None, belief.with_dropped(np.asarray(route[-1]))
            belief = belief.with_path(probed.path_K_m[:, :2])
            self.event("sweep", path_K_m=probed.path_K_m)
            if probed.contact is not None:
                return probed.contact, belief
        return None, belief

    def _blank_map(self) -> SearchMap:
        half = 0.5 * np.array(self.context.world.container.interior_m[:2]) - self.params.wall_gap_m
        return SearchMap.blank(half, expected=self.params.expected_objects)

    def _height(self, tool: HeldTool) -> float:
        return tool.floor_z_K_m + self.params.height_m

    def _way_in(self, policy: SearchPolicy, belief: SearchMap, tip_xy: Array) -> Array | None:
        """Where to lower the ball: the nearest place it has been from which something unexplored can be reached.

        Where it has been is free, unless an object was traced there since. Before the first sweep it is where it hangs.
        """
        half = np.asarray(belief.half_extent_m)
        inside = np.clip(tip_xy, -half, half)
        if len(belief.path_K_m) == 0:
            return None if len(belief.dropped) else inside
        free = belief.path_K_m[~belief.inside_exclusion(belief.path_K_m)]
        free = free[np.argsort(np.linalg.norm(free - inside, axis=1), kind="stable")]
        tried = np.zeros((0, 2))
        for spot in free:
            if len(tried) and np.linalg.norm(tried - spot, axis=1).min() < WAYS_IN_APART_M:
                continue
            if len(belief.dropped) and np.linalg.norm(belief.dropped - spot, axis=1).min() < AT_HEIGHT_M:
                continue
            if policy.next_path(belief, spot) is not None:
                return np.asarray(spot)
            tried = np.vstack([tried, spot])
        return None

    def _enter(self, prober: Prober, belief: SearchMap, spot: Array) -> Motion[SearchMap]:
        """Bring the ball over `spot` and down to the sweeping height under guard; a spot that is taken is dropped."""
        p = self.params
        tip = prober.tip_K_m
        if np.linalg.norm(spot - tip[:2]) > 0.002:
            above = max(float(tip[2]), self.tool.floor_z_K_m + p.headroom_m)
            yield from prober.hop(np.array([*spot, 0.0]), above, p.travel_speed_m_s)
        probed = yield from prober.move(np.array([*spot, self._height(self.tool)]), p.speed_m_s)
        if probed.contact is None:
            return belief.with_path(probed.path_K_m[-1:, :2])
        self.event("note", text="something stands where the ball had been before; that place is dropped")
        yield from prober.hop(np.array([*spot, 0.0]), self.tool.floor_z_K_m + p.headroom_m, p.travel_speed_m_s)
        return belief.with_dropped(spot)
