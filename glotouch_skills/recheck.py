"""Check the world before an interrupted mission resumes: is it still as the mission knows it?"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from glotouch_bt.motion import Motion, finger_outline_half_m
from glotouch_bt.perception.touch import Candidate, GuardParams, signed_distance
from glotouch_bt.robot import Array, MotionRefused
from glotouch_bt.skill import MOTION_REFUSED, Failure, In, Skill, SkillParams, SkillRun, come_to_rest, param
from glotouch_bt.skill.probing import HeldTool, Prober
from glotouch_skills.common.hand import MIN_GRIP_N, REQUEST_FAILED, rise_clear, set_payload_and_tare
from glotouch_skills.common.probe import FEEL_FLOOR_FAILURES, HELD_TOLERANCE_M, feel_floor

DIRECTIONS = 24
"""Number of approach directions to consider."""
BEFORE_M = 0.012
"""Start the approach of a candidate this far outside its outline."""
BEYOND_M = 0.008
"""End it this far inside."""
CLEAR_M = 0.006
"""Clearance of the tool from everything else where it is lowered."""


class RecheckParams(SkillParams):
    """Parameters of `recheck`."""

    speed_m_s: float = param("Speed above everything", unit="m/s", default=0.10, gt=0.0, le=0.15)
    touch_m_s: float = param("Speed towards a candidate", unit="m/s", default=0.03, gt=0.0, le=0.08)
    height_m: float = param("Touching height above the floor", unit="m", default=0.018, ge=0.009, le=0.06)
    moved_m: float = param("Largest displacement of a candidate", unit="m", default=0.006, gt=0.0, le=0.02)
    slip_m: float = param("Largest change of the floor's height", unit="m", default=0.002, gt=0.0, le=0.005)
    headroom_m: float = param("Height of the tool above the floor on the way", unit="m", default=0.15, ge=0.05, le=0.2)
    may_be_gone: bool = param("The probe may have been put back meanwhile", default=False)
    touch: bool = param("Touch one of the candidates", default=True)
    corner_gap_m: float = param(
        "Distance of the ball's centre from each wall where the floor is touched", unit="m", default=0.014, ge=0.008
    )


class Recheck(Skill):
    """Come to rest, rise, set the payload, tare, and check the world by touch.

    With the probe in the hand, the aperture and the floor's height must be as before. If candidates are known, the one
    with the most free space is touched from its side. An object in the hand is not moved; only its loss is detected.

    SUCCESS: everything that could be checked is as before.
    """

    Params = RecheckParams
    params: RecheckParams

    USES: ClassVar = frozenset({"arm"})

    TOOL_LOST = Failure(
        "tool_lost",
        "the probe is not in the jaws any more, or meets no floor",
        advice="put the probe into its holder, then resume --from tool_pickup",
    )
    TOOL_SLIPPED = Failure(
        "tool_slipped",
        "the floor is felt elsewhere with the probe",
        advice="put the probe into its holder, then resume --from tool_pickup",
    )
    OBJECT_LOST = Failure(
        "object_lost",
        "the jaws held an object and hold nothing now",
        advice="start again where the object is sought or squeezed: resume --from NODE",
    )
    CANDIDATE_MOVED = Failure(
        "candidate_moved",
        "nothing, or something else, was met where a candidate was traced",
        advice="what was found is not to be trusted any more: resume --from guarded_sweep, or run it again",
    )
    FAILURES: ClassVar = (*FEEL_FLOOR_FAILURES, REQUEST_FAILED, MOTION_REFUSED.with_meaning("the hand cannot rise"))

    tool = In(HeldTool, "the probe as it was taken", required=False)
    candidates = In(tuple, "what was traced", element=Candidate, required=False)
    grip_m = In(float, "aperture with an object in the jaws", required=False)

    def run(self) -> SkillRun:
        """See the class."""
        arm, context = self.context.arm, self.context
        held_m: float | None = self.grip_m
        yield from come_to_rest(context)
        if self.params.may_be_gone and self.tool is not None and not self._as_wide_as(self.tool):
            arm.scene.hold_tool(False)
        found: dict[str, object] = {"probe": arm.scene.holding_tool}
        if arm.scene.holding_tool and self.tool is not None:
            self._require_tool(self.tool)
            yield from self._ready(held=True)
            found["floor_z_K_m"] = yield from self._floor(self.tool)
            found["candidate"] = yield from self._touch_one(self.tool, self.tool.tip_radius_m, self.tool.tip_radius_m)
        elif held_m is not None and context.observation.gripper.force_N > MIN_GRIP_N:
            found["object"] = True
        elif held_m is not None:
            raise self.OBJECT_LOST(
                f"the jaws held something {held_m * 1e3:.1f} mm wide and hold nothing now",
                aperture_m=context.observation.gripper.aperture_m,
            )
        else:
            yield from self._ready(held=False)
            found["candidate"] = yield from self._touch_with_fingers()
        self.event("recheck", **found)

    def _as_wide_as(self, tool: HeldTool) -> bool:
        return abs(self.context.arm.aperture_m - tool.aperture_m) <= HELD_TOLERANCE_M

    def _require_tool(self, tool: HeldTool) -> None:
        apart = self.context.arm.aperture_m
        if not self._as_wide_as(tool):
            raise self.TOOL_LOST(
                f"the jaws are {apart * 1e3:.1f} mm apart, with the probe they were {tool.aperture_m * 1e3:.1f}",
                aperture_m=apart,
            )

    def _ready(self, *, held: bool) -> SkillRun:
        """Rise, set the payload and tare: a restarted controller knows neither payload nor tare."""
        probe = self.context.world.probe
        yield from rise_clear(self.context.arm, self.params.speed_m_s)
        mass, below = (probe.mass_kg, probe.com_below_grasp_m) if held else (0.0, 0.0)
        yield from set_payload_and_tare(self.context, mass, below)

    def _floor(self, tool: HeldTool) -> Motion[float]:
        p = self.params
        floor_m = yield from feel_floor(self.context, tool, p.corner_gap_m, p.speed_m_s)
        if floor_m is None:
            raise self.TOOL_LOST("nothing was met where the floor is")
        off = floor_m - tool.floor_z_K_m
        if abs(off) > p.slip_m:
            raise self.TOOL_SLIPPED(
                f"the floor was felt {off * 1e3:.1f} mm from where it was: the probe slipped, or the box was moved",
                off_m=off,
            )
        yield from rise_clear(self.context.arm, p.speed_m_s)
        return floor_m

    def _touch_with_fingers(self) -> Motion[int | None]:
        """Touch a candidate with the closed fingers, as with the probe."""
        if not (self.candidates and self.params.touch):
            return None
        arm = self.context.arm
        state = yield from arm.jaws(0.0)
        fingers = HeldTool.fingers(arm.description.gripper, state.aperture_m, arm.pose_B_P.yaw_rad)
        half = finger_outline_half_m(arm.description.gripper, state.aperture_m)
        return (yield from self._touch_one(fingers, float(np.min(half)), float(np.hypot(*half))))

    def _touch_one(self, tool: HeldTool, min_m: float, max_m: float) -> Motion[int | None]:
        """Touch a candidate from its side; return its index, or None if none is known or reachable.

        Args:
            tool: What touches.
            min_m: Least distance from the tool's middle to its boundary.
            max_m: Largest distance.
        """
        p = self.params
        for candidate, start, goal in self._ways(min_m, max_m):
            prober = Prober(self.context, tool, GuardParams())
            try:
                yield from prober.hop(np.array([*start, 0.0]), tool.floor_z_K_m + p.headroom_m, p.speed_m_s)
                z = tool.floor_z_K_m + p.height_m
                lowered = yield from prober.move(np.array([*start, z]), p.touch_m_s)
                met = lowered.contact
                if met is None:
                    met = (yield from prober.move(np.array([*goal, z]), p.touch_m_s, any_direction=True)).contact
            except MotionRefused as refusal:
                self.event("note", text=f"candidate {candidate.index} was not touched: {refusal}")
                yield from rise_clear(self.context.arm, p.speed_m_s)
                continue
            yield from rise_clear(self.context.arm, p.speed_m_s)
            self._judge(candidate, None if met is None else met.point_K_m)
            return candidate.index
        return None

    def _judge(self, candidate: Candidate, point_K_m: Array | None) -> None:
        off: float | None = None
        if point_K_m is not None:
            off = float(signed_distance(candidate.contour, point_K_m[None])[0])
            if abs(off) <= self.params.moved_m:
                return
        how = "nothing was met there" if off is None else f"something was met {off * 1e3:.1f} mm from its outline"
        raise self.CANDIDATE_MOVED(
            f"candidate {candidate.index} is not where it was traced: {how}", candidate=candidate.index
        )

    def _ways(self, min_m: float, max_m: float) -> list[tuple[Candidate, Array, Array]]:
        """Return (candidate, start, goal), the most free space first; places (2,) in K."""
        p = self.params
        known: tuple[Candidate, ...] = (self.candidates or ()) if p.touch else ()
        half = 0.5 * np.array(self.context.world.container.interior_m[:2]) - max_m - CLEAR_M
        ways: list[tuple[float, int, Candidate, Array, Array]] = []
        for candidate in known:
            others = [c.contour for c in known if c is not candidate]
            for i in range(DIRECTIONS):
                angle = 2.0 * np.pi * i / DIRECTIONS
                out = np.array([np.cos(angle), np.sin(angle)])
                edge = candidate.contour.centre_K_m + out * _reach_m(candidate, out)
                start = edge + out * (max_m + BEFORE_M)
                if (np.abs(start) > half).any():
                    continue
                free = min((float(signed_distance(c, start[None])[0]) for c in others), default=np.inf)
                free = min(free - max_m, float((half - np.abs(start)).min()) + CLEAR_M)
                if free >= CLEAR_M:
                    goal = edge + out * (min_m - BEYOND_M)
                    ways.append((-free, len(ways), candidate, start, goal))
        return [(c, start, goal) for _, _, c, start, goal in sorted(ways, key=lambda w: w[:2])][: 2 * len(known)]


def _reach_m(candidate: Candidate, out: Array) -> float:
    """Return the distance from the centre to the outline in direction `out` (2,), by bisection on the signed
    distance."""
    contour = candidate.contour
    near, far = 0.0, contour.radius_m + 0.02
    for _ in range(30):
        middle = 0.5 * (near + far)
        inside = float(signed_distance(contour, (contour.centre_K_m + middle * out)[None])[0]) < 0.0
        near, far = (middle, far) if inside else (near, middle)
    return near
