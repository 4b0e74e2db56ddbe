"""Sweep the container with the probe until something is touched."""

from __future__ import annotations

import numpy as np

from glotouch_bt.motion import Motion
from glotouch_bt.robot import Array, MotionRefused
from glotouch_bt.search import NearestFrontier, SearchMap
from glotouch_bt.touch import Contact, GuardParams
from skills.base import In, Out, Skill, SkillFailed, SkillParams, SkillRun, param
from skills.held_tool import HeldTool
from skills.probing import Prober


class GuardedSweepParams(SkillParams):
    """Parameters of `guarded_sweep`."""

    expected_objects: int = param("How many objects the container holds", default=5, ge=1, le=20)
    height_m: float = param("Ball centre above the floor while sweeping", unit="m", default=0.018, ge=0.009, le=0.06)
    speed_m_s: float = param("Sweeping speed", unit="m/s", default=0.04, gt=0.0, le=0.08)
    travel_speed_m_s: float = param("Speed above the objects", unit="m/s", default=0.10, gt=0.0, le=0.15)
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
        contact = yield from self._enter(prober, belief)
        while contact is None:
            here = prober.tip_K_m[:2]
            route = policy.next_path(belief, here)
            if route is None:
                self.map = belief
                raise SkillFailed(
                    "search_exhausted",
                    f"nothing unexplored is left; {belief.found} of {p.expected_objects} objects were found",
                    advice="lower coverage_radius_m to search more finely",
                    found=belief.found,
                )
            for waypoint in route:
                goal = np.array([*waypoint, self._height(tool)])
                try:
                    probed = yield from prober.move(goal, p.speed_m_s)
                except MotionRefused as refusal:
                    self.event("note", text=f"frontier dropped: {refusal}")
                    belief = belief.with_dropped(np.asarray(route[-1]))
                    break
                belief = belief.with_path(probed.path_K_m[:, :2])
                self.event("sweep", path_K_m=probed.path_K_m)
                contact = probed.contact
                if contact is not None:
                    break
        self.event("contact", contact=contact)
        yield from prober.retreat(-contact.approach_K, p.retreat_m, p.speed_m_s)
        self.map = belief
        self.contact = contact

    def _blank_map(self) -> SearchMap:
        half = 0.5 * np.array(self.context.world.container.interior_m[:2]) - self.params.wall_gap_m
        return SearchMap.blank(half, expected=self.params.expected_objects)

    def _height(self, tool: HeldTool) -> float:
        return tool.floor_z_K_m + self.params.height_m

    def _enter(self, prober: Prober, belief: SearchMap) -> Motion[Contact | None]:
        """Bring the ball to the sweeping height, going down only where it has been, or else under guard."""
        p = self.params
        tip = prober.tip_K_m
        sweep_z = self._height(self.tool)
        if abs(tip[2] - sweep_z) < 0.004:
            return None
        spot = self._free_spot(belief, tip[:2])
        above = max(float(tip[2]), self.context.world.container.interior_m[2] + 0.05)
        if tip[2] > sweep_z + 0.03 or np.linalg.norm(spot - tip[:2]) > 0.002:
            yield from prober.hop(np.array([*spot, 0.0]), above, p.travel_speed_m_s)
        probed = yield from prober.move(np.array([*spot, sweep_z]), 1.5 * p.speed_m_s)
        self.event("sweep", path_K_m=probed.path_K_m)
        return probed.contact

    def _free_spot(self, belief: SearchMap, tip_xy: Array) -> Array:
        """Where the ball has been before, nearest to `tip_xy` and outside every traced object; else where it is now."""
        half = np.asarray(belief.half_extent_m)
        inside = np.clip(tip_xy, -half, half)
        if len(belief.path_K_m) == 0:
            return inside
        free = belief.path_K_m[~belief.inside_exclusion(belief.path_K_m)]
        if len(free) == 0:
            return inside
        return np.asarray(free[np.argmin(np.linalg.norm(free - inside, axis=1))])
