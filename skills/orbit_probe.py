"""Trace a touched object: go round it in short steps, probe it from each, fit its contour, touch its top."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from glotouch_bt.motion import Motion
from glotouch_bt.robot import Array, MotionRefused
from glotouch_bt.search import SearchMap
from glotouch_bt.touch import Candidate, Contact, Contour, GuardParams, contour_quality, envelope, fit_contour
from skills.base import In, Out, Skill, SkillFailed, SkillParams, SkillRun, param
from skills.held_tool import HeldTool
from skills.probing import Probed, Prober

RIM_PLACES, RIM_INSET_M = 3, 0.002
"""Where a hollow object's top is felt: so far inside of so many of the contacts."""


class OrbitProbeParams(SkillParams):
    """Parameters of `orbit_probe`.

    Step and clearance keep the ball within 30 mm of the object it goes round, so that a neighbour at the world's
    least gap is not met on the way.
    """

    step_m: float = param("Step along the object between two probes", unit="m", default=0.018, ge=0.005, le=0.05)
    clearance_m: float = param("Ball surface to object while stepping", unit="m", default=0.008, ge=0.003, le=0.03)
    reach_m: float = param("How much deeper than the last contact a probe looks", unit="m", default=0.012, ge=0.003,
                           le=0.05)  # fmt: skip
    orbit_speed_m_s: float = param("Stepping speed", unit="m/s", default=0.05, gt=0.0, le=0.08)
    probe_speed_m_s: float = param("Probing speed", unit="m/s", default=0.03, gt=0.0, le=0.06)
    top_speed_m_s: float = param("Speed down onto the top", unit="m/s", default=0.015, gt=0.0, le=0.06)
    travel_speed_m_s: float = param("Speed above the objects", unit="m/s", default=0.10, gt=0.0, le=0.15)
    max_contacts: int = param("Most contacts per object", default=32, ge=3, le=60)
    headroom_m: float = param("Ball's height above the floor when crossing an object", unit="m", default=0.13,
                              ge=0.02, le=0.2)  # fmt: skip
    exclusion_m: float = param("Margin round a traced object that the search keeps out of", unit="m", default=0.010,
                               ge=0.0, le=0.05)  # fmt: skip


@dataclass
class _Trace:
    """Contacts in the order of the way round (counter-clockwise from above), and where the ball went."""

    contacts: list[Contact]
    paths: list[Array] = field(default_factory=list)

    @property
    def tips(self) -> Array:
        return np.array([c.tip_K_m[:2] for c in self.contacts])

    @property
    def turned_rad(self) -> float:
        """How far the contacts go round their own middle."""
        if len(self.contacts) < 3:
            return 0.0
        offset = self.tips - self.tips.mean(axis=0)
        bearing = np.unwrap(np.arctan2(offset[:, 1], offset[:, 0]))
        return float(bearing[-1] - bearing[0])


def _unit(v: Array) -> Array:
    return v / max(float(np.linalg.norm(v)), 1e-9)


def _left(v: Array) -> Array:
    return np.array([-v[1], v[0]])


class OrbitProbe(Skill):
    """From one contact to a candidate: centre, outline, height.

    The ball follows the object counter-clockwise: back off along the outward normal, step along the tangent, probe
    inwards. A probe that meets nothing has passed a corner; the next one comes from round it.

    SUCCESS: a new candidate was added to `candidates`, and its envelope to the map's exclusions.
    FAILURE `known_object`: the contact belongs to an object traced before; its place is dropped from the search.
    FAILURE `not_traced`: the way round was not closed and too few contacts were made to fit an outline.
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
        trace = _Trace([first])
        try:
            yield from self._go_round(prober, trace)
        except MotionRefused as refusal:  # what was felt so far may do
            self.event("note", text=f"the way round ended early: {refusal}")
        path = np.concatenate(trace.paths) if trace.paths else first.tip_K_m[None, :]
        belief = belief.with_path(path[:, :2])
        self.event("sweep", path_K_m=path)
        if len(trace.contacts) < 5 or trace.turned_rad < np.pi:
            self.map = belief.with_dropped(first.point_K_m)
            raise SkillFailed(
                "not_traced",
                f"{len(trace.contacts)} contacts over {np.rad2deg(trace.turned_rad):.0f} degrees; no outline fits",
                advice="lower step_m, or raise the sensing height if the object is flat",
                contacts=len(trace.contacts),
            )
        contour = fit_contour(trace.tips, self.tool.tip_radius_m)
        height = yield from self._top(prober, trace, contour)
        candidate = Candidate(
            index=len(known),
            contour=contour,
            height_m=height,
            quality=contour_quality(trace.tips, contour),
            contacts=tuple(trace.contacts),
        )
        self.event("candidate", candidate=candidate)
        belief = belief.with_exclusion(envelope(candidate), self.params.exclusion_m)
        self.map, self.candidates = belief, (*known, candidate)
        self.found, self.complete = len(known) + 1, belief.complete

    def _go_round(self, prober: Prober, trace: _Trace) -> Motion[None]:
        """Follow the outline from the first contact until it closes, or the ball is stuck; fills `trace`."""
        p = self.params
        first = trace.contacts[0]
        normal = _unit(_unit(first.reaction_K[:2]) - first.approach_K[:2])
        yield from self._back_off(prober, trace, normal)
        corners, step = 0, p.step_m
        while len(trace.contacts) < p.max_contacts and corners < 4 and step > 0.004:
            tangent = _left(normal)
            try:
                stepped = yield from self._go(prober, trace, step * tangent, p.orbit_speed_m_s, any_direction=True)
                if stepped.contact is None:
                    inwards = -(p.clearance_m + p.reach_m) * normal
                    probed = yield from self._go(prober, trace, inwards, p.probe_speed_m_s)
                else:
                    probed = stepped
            except MotionRefused as refusal:
                self.event("note", text=f"a step of {step * 1e3:.0f} mm is halved: {refusal}")
                step *= 0.5
                continue
            step = p.step_m
            if probed.contact is None:  # past a corner: come from round it
                corners += 1
                normal = tangent
                probed = yield from self._go(prober, trace, -(p.step_m + p.reach_m) * normal, p.probe_speed_m_s)
                if probed.contact is None:
                    continue
            corners = 0
            normal = self._normal(trace, probed.contact, ahead=probed is stepped)
            trace.contacts.append(probed.contact)
            self.event("contact", contact=probed.contact)
            if trace.turned_rad > 2 * np.pi - 0.35:
                break
            yield from self._back_off(prober, trace, normal)
        yield from self._back_off(prober, trace, normal)

    def _normal(self, trace: _Trace, contact: Contact, *, ahead: bool) -> Array:
        """Outward normal at a new contact: across the chord from the last one, and against the approach."""
        against = -contact.approach_K[:2]
        reaction = _unit(contact.reaction_K[:2])
        if ahead:
            return _unit(reaction + against)
        chord = contact.tip_K_m[:2] - trace.contacts[-1].tip_K_m[:2]
        if np.linalg.norm(chord) < 0.4 * self.params.step_m:
            return _unit(reaction + against)
        across = -_left(_unit(chord))
        return _unit(across + against + 0.5 * reaction)

    def _go(
        self, prober: Prober, trace: _Trace, step_K: Array, speed_m_s: float, *, any_direction: bool = False
    ) -> Motion[Probed]:
        goal = prober.tip_K_m + np.array([*step_K, 0.0])
        probed = yield from prober.move(goal, speed_m_s, any_direction=any_direction)
        trace.paths.append(probed.path_K_m)
        return probed

    def _back_off(self, prober: Prober, trace: _Trace, normal: Array) -> Motion[None]:
        """Away from the last contact until the ball is `clearance_m` off it along the normal."""
        off = float((prober.tip_K_m[:2] - trace.contacts[-1].tip_K_m[:2]) @ normal)
        distance = self.params.clearance_m - off
        if distance > 1e-3:
            yield from prober.retreat(np.array([*normal, 0.0]), distance, self.params.orbit_speed_m_s)

    def _top(self, prober: Prober, trace: _Trace, contour: Contour) -> Motion[float]:
        """Height of the top above the floor: over the middle, or if that is hollow, the highest of places on the rim.

        Hollow means lower than the sides were touched at, so that something must be higher.
        """
        height = yield from self._touch_from_above(prober, contour.centre_K_m)
        touched_m = float(np.median([c.tip_K_m[2] for c in trace.contacts])) - self.tool.floor_z_K_m
        if height > touched_m:
            return height
        every = max(len(trace.contacts) // RIM_PLACES, 1)
        for contact in trace.contacts[::every][:RIM_PLACES]:
            inwards = _unit(contour.centre_K_m - contact.point_K_m)
            at_rim = yield from self._touch_from_above(prober, contact.point_K_m + RIM_INSET_M * inwards)
            height = max(height, at_rim)
        return height

    def _touch_from_above(self, prober: Prober, place_K_m: Array) -> Motion[float]:
        """Lower the ball onto a place (2,); height of what it meets above the floor."""
        p, tool = self.params, self.tool
        top = tool.floor_z_K_m + p.headroom_m
        yield from prober.hop(np.array([*place_K_m, 0.0]), top, p.travel_speed_m_s)
        lowest = np.array([*place_K_m, tool.floor_z_K_m + tool.tip_radius_m + 0.004])
        probed = yield from prober.move(lowest, p.top_speed_m_s)
        tip_z = float(prober.tip_K_m[2]) if probed.contact is None else float(probed.contact.tip_K_m[2])
        if probed.contact is not None:
            self.event("contact", contact=probed.contact)
        yield from prober.hop(np.array([*place_K_m, 0.0]), top, p.travel_speed_m_s)
        return tip_z - tool.tip_radius_m - tool.floor_z_K_m
