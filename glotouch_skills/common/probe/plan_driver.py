"""Execute an exploration plan (`perception.search`) with the arm: each move is a guarded move of the ball."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar, TypeVar

import numpy as np

from glotouch_bt.motion import Motion
from glotouch_bt.perception.search import Move, MoveOutcome, SearchPlan
from glotouch_bt.perception.touch import Contact, Contour, GuardParams
from glotouch_bt.robot import Array, MotionRefused
from glotouch_bt.skill import Context, Failure
from glotouch_bt.skill.probing import HeldTool, Prober
from glotouch_skills.common.hand import GRAVITY_M_S2, rise_clear, weigh_N

_Move = TypeVar("_Move")
_Outcome = TypeVar("_Outcome")
T = TypeVar("T")

AT_HEIGHT_M = 0.004
"""The ball is at sensing height within this tolerance."""
IN_COLUMN_M = 0.002
"""A descent within this distance of a place where the tool stood before is free: the difference of the radii of ball
and shaft. Source: ours."""
HELD_TOLERANCE_M = 0.004
"""The tool is held if the aperture is within this of the handle's width, or of the aperture at which the jaws closed on
it: twice the largest bias, and compliance."""
MAX_LOST_SHARE = 0.5
"""Weigh the probe in free air if more than this share of its weight disappears from one rest to the next."""
COLUMN_M_S = 0.04
"""Speed of a descent in such a place. The ball is wider than the shaft that passed: an overhang may reach in between.
At 0.10 m/s the robot stopped itself on one (`bench retrieve --seed 43400 --trials 10 --per-seed 2`, 49c1c63). Source:
ours; rigid things met at 0.05 m/s gave 31 N."""
MISFIT_M = 0.002
"""RMS of an outline's residuals beyond which the object has moved between the contacts. Source: ours, not
calibrated."""
DISPLACED_M = 0.010
"""Motion of an object during a trace beyond which it may have moved further unseen. Source: ours, not calibrated; a
trace follows at most 15 mm."""
MAX_BACK_M = 0.010
"""Maximum length of a retreat back the way the ball came. Source: ours."""
OFF_TOP_M = 0.006
"""Raise the ball by this much from what it landed on."""

TOOL_LOST = Failure(
    "tool_lost",
    "the jaws are not as far apart as when they took the tool, or the hand is lighter by the weight of the probe",
    advice="the tool lies in or beside the container; remove it by hand",
)


@dataclass(frozen=True, kw_only=True)
class ExploringSpeeds:
    """Speeds of each kind of move, m/s; heights of the ball's centre above the floor, m."""

    sweep_m_s: float = 0.04
    step_m_s: float = 0.05
    probe_m_s: float = 0.03
    travel_m_s: float = 0.25
    lower_m_s: float = 0.02
    height_m: float = 0.018
    headroom_m: float = 0.15


def drive(plan: Generator[_Move, _Outcome, T], make: Callable[[_Move], Motion[_Outcome]]) -> Motion[T]:
    """Execute a plan: make each of its moves and send it the outcome; return the plan's result."""
    try:
        move = next(plan)
        while True:
            move = plan.send((yield from make(move)))
    except StopIteration as end:
        result: T = end.value
        return result


class Explorer:
    """Execute plans of ball moves.

    Args:
        context: The skill's context.
        tool: The held probe.
        speeds: Speeds and heights.
        journal: Called with (kind, data) of every event: "contact", "sweep" (the path at sensing height), "note".
    """

    FAILURES: ClassVar = (*Prober.FAILURES, TOOL_LOST)

    def __init__(self, context: Context, tool: HeldTool, speeds: ExploringSpeeds, journal: Callable[..., None]) -> None:
        self._prober = Prober(context, tool, GuardParams())
        self._arm, self._tool, self._speeds, self._journal = context.arm, tool, speeds, journal
        probe = context.world.probe
        self._began_K_m = self._prober.tip_K_m
        self._weight_N = probe.mass_kg * GRAVITY_M_S2 if context.arm.scene.holding_tool else math.inf

    @property
    def lowered(self) -> bool:
        """The ball is at sensing height."""
        return abs(float(self._prober.tip_K_m[2]) - self._height_m) < AT_HEIGHT_M

    @property
    def tip_K_m(self) -> Array:
        """(2,) position of the ball in K."""
        return self._prober.tip_K_m[:2]

    def columns(self) -> Array:
        """Return the places (n, 2) above which the space is free, down to sensing height."""
        return self._arm.felt.columns(self._height_m + AT_HEIGHT_M)

    @property
    def _height_m(self) -> float:
        return self._tool.floor_z_K_m + self._speeds.height_m

    def run(self, plan: SearchPlan[T]) -> Motion[T]:
        """Execute a plan and return its result.

        Raises:
            SkillFailed: `tool_lost`, `hard_contact`.
        """
        return (yield from drive(plan, self._make))

    def distrust_free_space(self, contour: Contour, displaced_m: float) -> None:
        """Forget the free space that was felt around an object which has moved by an unknown distance.

        Args:
            contour: Its outline; contacts that no outline fits were made before and after a motion.
            displaced_m: Length of the motion that was seen during the trace.
        """
        if contour.rms_m > MISFIT_M or displaced_m > DISPLACED_M:
            self._arm.felt.forget_free_near(contour.centre_K_m)

    def _make(self, move: Move) -> Motion[MoveOutcome]:
        self._require_tool()
        yield from self._require_weight()
        try:
            if move.kind == "hop":
                contact, path = yield from self._hop(move.goal_K_m)
            elif move.kind == "retreat":
                contact, path = yield from self._retreat(move.goal_K_m)
            else:
                contact, path = yield from self._go(move)
        except MotionRefused as refusal:
            self._journal("note", text=f"{move.kind} refused: {refusal}")
            return MoveOutcome(self.tip_K_m, np.zeros((0, 2)), refused=str(refusal))
        if len(path):
            self._journal("sweep", path_K_m=path)
        if contact is not None:
            self._journal("contact", contact=contact)
        return MoveOutcome(self.tip_K_m, path[:, :2], contact)

    def _require_tool(self) -> None:
        """Check that the aperture is the one at which the tool was taken; without the tool nothing would be touched."""
        apart, taken = self._arm.aperture_m, self._tool.aperture_m
        if abs(apart - taken) > HELD_TOLERANCE_M:
            self._arm.felt.forget()
            raise TOOL_LOST(
                f"the jaws are {apart * 1e3:.1f} mm apart, with the tool in them they were {taken * 1e3:.1f}",
                aperture_m=apart,
            )

    def _require_weight(self) -> Motion[None]:
        """Check that the probe's weight does not disappear from one rest to the next, and stay missing in free air.

        Only consecutive rests are compared: over minutes, the tare drifts by more than that.
        """
        rests = self._prober.resting_up_N
        steps = [(b - a, a) for a, b in pairwise(rests)]
        del rests[:-1]
        step_N, before_N = max(steps, default=(0.0, 0.0))
        if not step_N > MAX_LOST_SHARE * self._weight_N:
            return
        tip = self._prober.tip_K_m
        yield from rise_clear(self._arm)
        missing_N = -(yield from weigh_N(self._arm)) - before_N
        if missing_N > MAX_LOST_SHARE * self._weight_N:
            self._arm.felt.forget()
            raise TOOL_LOST(
                f"the hand is lighter by {missing_N:.2f} N than a moment ago, the probe weighs {self._weight_N:.2f} N",
                advice="check the probe with tool_check",
                missing_N=missing_N,
                weight_N=self._weight_N,
            )
        self._journal("note", text=f"the wrist became lighter on a contact; in free air {missing_N:.2f} N are missing")
        yield from self._prober.move(tip, self._speeds.lower_m_s)

    def _go(self, move: Move) -> Motion[tuple[Contact | None, Array]]:
        s = self._speeds
        speed = {"sweep": s.sweep_m_s, "step": s.step_m_s, "probe": s.probe_m_s}[move.kind]
        goal = np.array([*move.goal_K_m, self._height_m])
        self._began_K_m = self._prober.tip_K_m
        probed = yield from self._prober.move(goal, speed, any_direction=move.kind == "step")
        return probed.contact, probed.path_K_m

    def _retreat(self, goal_K_m: Array) -> Motion[tuple[None, Array]]:
        """Retreat from a contact to `goal_K_m` (2,), or back the way the ball came if a wall is in that direction.

        The ball must not stay in contact: the next rest would measure the force of the contact as the wrench without
        one, and the guard would report a contact on the opposite side.
        """
        before = self._prober.tip_K_m
        try:
            yield from self._back_off(goal_K_m - before[:2])
        except MotionRefused:
            back = (self._began_K_m - before)[:2]
            yield from self._back_off(back * min(1.0, MAX_BACK_M / max(float(np.linalg.norm(back)), 1e-9)))
        return None, np.array([before, self._prober.tip_K_m])

    def _back_off(self, way_K_m: Array) -> Motion[None]:
        """Move the ball by `way_K_m` (2,) without a guard."""
        length = float(np.linalg.norm(way_K_m))
        if length > 1e-4:
            yield from self._prober.retreat(np.array([*(way_K_m / length), 0.0]), length, self._speeds.step_m_s)

    def _hop(self, goal_K_m: Array) -> Motion[tuple[Contact | None, Array]]:
        s, tip = self._speeds, self._prober.tip_K_m
        if np.linalg.norm(goal_K_m - tip[:2]) > 0.002:
            above = max(float(tip[2]), self._tool.floor_z_K_m + s.headroom_m)
            yield from self._prober.hop(np.array([*goal_K_m, 0.0]), above, s.travel_m_s)
        known = self.columns()
        free = bool((np.linalg.norm(known - goal_K_m, axis=1) < IN_COLUMN_M).any())
        probed = yield from self._prober.move(
            np.array([*goal_K_m, self._height_m]), COLUMN_M_S if free else s.lower_m_s
        )
        if probed.contact is not None:
            yield from self._prober.retreat(np.array([0.0, 0.0, 1.0]), OFF_TOP_M, s.step_m_s)
            return probed.contact, np.zeros((0, 3))
        return None, probed.path_K_m[-1:]
