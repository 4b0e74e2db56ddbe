"""Trace a touched object: orbit it, probe it radially, fit its contour, touch its top."""

from __future__ import annotations

import numpy as np

from glotouch_bt.motion import Motion
from glotouch_bt.robot import Array, MotionRefused
from glotouch_bt.search import SearchMap
from glotouch_bt.touch import (
    Candidate,
    Contact,
    Contour,
    GuardParams,
    contour_quality,
    fit_contour,
    largest_gap_direction,
    needs_more,
)
from skills.base import In, Out, Skill, SkillFailed, SkillParams, SkillRun, param
from skills.held_tool import HeldTool
from skills.probing import Prober


class OrbitProbeParams(SkillParams):
    """Parameters of `orbit_probe`."""

    height_m: float = param("Ball centre above the floor while tracing", unit="m", default=0.018, ge=0.009, le=0.06)
    nominal_radius_m: float = param("First guess of an object's radius", unit="m", default=0.028, ge=0.005, le=0.08)
    clearance_m: float = param("Ball surface to contour on the orbit", unit="m", default=0.009, ge=0.003, le=0.03)
    orbit_speed_m_s: float = param("Speed on the orbit", unit="m/s", default=0.05, gt=0.0, le=0.08)
    probe_speed_m_s: float = param("Radial probing speed", unit="m/s", default=0.03, gt=0.0, le=0.06)
    travel_speed_m_s: float = param("Speed above the objects", unit="m/s", default=0.10, gt=0.0, le=0.15)
    max_contacts: int = param("Most contacts per object", default=12, ge=3, le=40)
    max_step_deg: float = param("Longest single step on the orbit", unit="deg", default=45.0, gt=5.0, le=90.0)
    headroom_m: float = param(
        "Ball's height above the floor when crossing an object", unit="m", default=0.13, ge=0.02, le=0.2
    )
    exclusion_m: float = param(
        "Margin round a traced object that the search keeps out of", unit="m", default=0.010, ge=0.0, le=0.05
    )


class OrbitProbe(Skill):
    """From one contact to a candidate: centre, outline, height.

    SUCCESS: a new candidate was added to `candidates`, and its envelope to the map's exclusions.
    FAILURE `known_object`: the contact belongs to an object traced before; its place is dropped from the search.
    FAILURE `not_traced`: too few contacts could be made to fit an outline; the place is dropped from the search.
    """

    Params = OrbitProbeParams
    params: OrbitProbeParams
    tool = In(HeldTool, "the held probe")
    contact = In(Contact, "first contact with the object")
    previous_map = In(SearchMap, "the search map", key="map")
    previous = In(tuple, "candidates so far", key="candidates", required=False)
    map = Out(SearchMap, "the search map with the object excluded")
    candidates = Out(tuple, "candidates, the new one last")
    found = Out(int, "how many objects are traced")
    complete = Out(bool, "all expected objects are traced")

    def run(self) -> SkillRun:
        """See the class."""
        belief, first = self.previous_map, self.contact
        known: tuple[Candidate, ...] = self.previous or ()
        self.candidates, self.found, self.complete = known, len(known), belief.complete
        if bool(belief.inside_exclusion(first.tip_K_m[None, :2])[0]):
            self.map = belief.with_dropped(first.point_K_m)
            raise SkillFailed("known_object", "the contact lies on an object that is traced already")
        prober = Prober(self.context, self.tool, GuardParams())
        contacts, contour, path = yield from self._trace(prober, first)
        belief = belief.with_path(path[:, :2])
        self.event("sweep", path_K_m=path)
        if contour is None:
            self.map = belief.with_dropped(first.point_K_m)
            raise SkillFailed(
                "not_traced",
                f"only {len(contacts)} contacts round the first one; no outline fits",
                advice="widen clearance_m, or raise height_m if the object is flat",
                contacts=len(contacts),
            )
        height = yield from self._touch_top(prober, contour)
        candidate = Candidate(
            index=len(known),
            contour=contour,
            height_m=height,
            quality=contour_quality(np.array([c.tip_K_m[:2] for c in contacts]), contour),
            contacts=tuple(contacts),
        )
        self.event("candidate", candidate=candidate)
        belief = belief.with_exclusion(contour, self.params.exclusion_m)
        self.map, self.candidates = belief, (*known, candidate)
        self.found, self.complete = len(known) + 1, belief.complete

    def _trace(self, prober: Prober, first: Contact) -> Motion[tuple[list[Contact], Contour | None, Array]]:
        """Contacts all round, the fit to them, and where the ball went meanwhile."""
        p, tip_radius = self.params, self.tool.tip_radius_m
        contacts = [first]
        paths: list[Array] = [first.tip_K_m[None, :]]
        contour: Contour | None = None
        centre = first.tip_K_m[:2] + first.approach_K[:2] * (p.nominal_radius_m + tip_radius)
        radius = p.nominal_radius_m
        blocked: list[float] = []
        for _ in range(3 * p.max_contacts):
            tips = np.array([c.tip_K_m[:2] for c in contacts])
            if len(contacts) >= 3:
                contour = fit_contour(tips, tip_radius)
                centre, radius = contour.centre_K_m, contour.radius_m
            if len(contacts) >= p.max_contacts or (contour is not None and not needs_more(tips, contour)):
                break
            bearings = np.arctan2(*(tips - centre).T[::-1])
            goal = largest_gap_direction(np.concatenate([bearings, np.array(blocked)]))
            reached = yield from self._go_round(prober, centre, radius + tip_radius + p.clearance_m, goal, paths)
            if isinstance(reached, Contact):
                contacts.append(reached)
                yield from prober.retreat(self._outward(prober, centre), p.clearance_m, p.orbit_speed_m_s)
                continue
            if not reached:
                blocked.append(goal)
                if len(blocked) > 6:
                    break
                continue
            try:
                probed = yield from prober.move(np.array([*centre, prober.tip_K_m[2]]), p.probe_speed_m_s)
            except MotionRefused:
                blocked.append(goal)
                continue
            paths.append(probed.path_K_m)
            if probed.contact is None:
                blocked.append(goal)
                break
            contacts.append(probed.contact)
            self.event("contact", contact=probed.contact)
            yield from prober.retreat(-probed.contact.approach_K, p.clearance_m, p.orbit_speed_m_s)
        return contacts, contour, np.concatenate(paths)

    def _go_round(
        self, prober: Prober, centre: Array, orbit_m: float, bearing: float, paths: list[Array]
    ) -> Motion[bool | Contact]:
        """Along the orbit to `bearing` in bounded steps; a Contact if it met something, False if the way is refused."""
        p = self.params
        for _ in range(16):
            offset = prober.tip_K_m[:2] - centre
            distance = float(np.linalg.norm(offset))
            here = float(np.arctan2(offset[1], offset[0]))
            turn = (bearing - here + np.pi) % (2 * np.pi) - np.pi
            try:
                if abs(distance - orbit_m) > 0.001:
                    goal = centre + offset / max(distance, 1e-6) * orbit_m
                    probed = yield from prober.move(np.array([*goal, prober.tip_K_m[2]]), p.orbit_speed_m_s)
                elif abs(turn) > np.deg2rad(1.0):
                    step = float(np.clip(turn, -np.deg2rad(p.max_step_deg), np.deg2rad(p.max_step_deg)))
                    probed = yield from prober.orbit(centre, step, p.orbit_speed_m_s)
                else:
                    return True
            except MotionRefused as refusal:
                self.event("note", text=f"bearing {np.rad2deg(bearing):.0f} deg given up: {refusal}")
                return False
            paths.append(probed.path_K_m)
            if probed.contact is not None:
                self.event("contact", contact=probed.contact)
                return probed.contact
        return False

    def _outward(self, prober: Prober, centre: Array) -> Array:
        offset = prober.tip_K_m[:2] - centre
        return np.array([*(offset / max(float(np.linalg.norm(offset)), 1e-6)), 0.0])

    def _touch_top(self, prober: Prober, contour: Contour) -> Motion[float]:
        """Lower the ball onto the fitted centre; height of what it meets above the floor."""
        p, tool = self.params, self.tool
        top = tool.floor_z_K_m + p.headroom_m
        yield from prober.hop(np.array([*contour.centre_K_m, 0.0]), top, p.travel_speed_m_s)
        lowest = np.array([*contour.centre_K_m, tool.floor_z_K_m + tool.tip_radius_m + 0.004])
        probed = yield from prober.move(lowest, p.probe_speed_m_s)
        tip_z = float(prober.tip_K_m[2]) if probed.contact is None else float(probed.contact.tip_K_m[2])
        if probed.contact is not None:
            self.event("contact", contact=probed.contact)
        yield from prober.hop(np.array([*contour.centre_K_m, 0.0]), top, p.travel_speed_m_s)
        return tip_z - tool.tip_radius_m - tool.floor_z_K_m
