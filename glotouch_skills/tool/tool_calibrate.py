"""Measure the ball's place in the hand, the probe's compliance and the wrist sensor's latency at two walls."""

from __future__ import annotations

import dataclasses
import math
from typing import ClassVar

import numpy as np

from glotouch_bt.motion import FREE_M_S, Motion
from glotouch_bt.perception.touch import GuardParams
from glotouch_bt.perception.touch.calibration import (
    Press,
    TipCalibration,
    WallTouch,
    solve_compliance,
    solve_tip,
    wrench_delay,
)
from glotouch_bt.robot import Array, MotionRefused, Observation, Pose
from glotouch_bt.skill import MOTION_REFUSED, Failure, In, Out, Skill, SkillParams, SkillRun, param
from glotouch_bt.skill.probing import HeldTool, Prober
from glotouch_skills.common.hand import may_touch
from glotouch_skills.common.probe import corner_of, corner_place, corner_walls

NEAR_M = 0.012
"""Within this planar distance of its corner, the ball moves straight there, otherwise over the walls."""
LOW_M = 0.020
"""Height of the ball's centre above the floor where it starts to rise."""
TOUCH_SD_M = 3e-5
"""Standard deviation of one touch: the onset is known to 1 to 2 ms, and the handle yields a little."""
MAX_RESIDUAL_M = 4e-4
"""Touches that disagree by more were not of these walls, or the probe slipped between them."""
RISE_ACCELERATION_M_S2 = 1.0
"""Acceleration of the rise that excites the wrist sensor: the robot-wide limit."""
RISE_JERK_M_S3 = 20.0
"""Jerk of that rise: the robot-wide limit."""
PRESS_M = 0.004
"""Longest press. Source: ours; 1.3 N at 3 mm/N, the softest probe of `realistic`."""
PRESS_M_S = 0.005
"""Speed of a press. Source: ours; a stiff probe's force rises by 25 N/s, so that it overshoots by less than 1 N."""
STAND_S = 0.1
"""Rest before and after a press; its second half is averaged. Source: ours."""
MAX_COMPLIANCE_M_N = 0.01
"""Largest compliance of a probe that is held. Source: ours, three times the softest of `realistic`."""
RATE_HZ = 1000.0
"""Interpolate the samples to this rate, since some may be missing."""


def in_words(tool: HeldTool) -> str:
    """Return the measured values of the probe in words."""
    x, y = 1e3 * tool.tip_P_m[:2]
    text = f"ball of the probe at ({x:.2f}, {y:.2f}) mm from the axis of the hand"
    if tool.compliance_P_m_N is not None:
        text += ", compliance {:.2f}, {:.2f} mm/N along x_P, y_P".format(*(1e3 * tool.compliance_P_m_N))
    return f"{text}, wrist force {1e3 * tool.latency_s:.1f} ms late"


class ToolCalibrateParams(SkillParams):
    """Parameters of `tool_calibrate`.

    The defaults allow the ball to be centimetres from its nominal place, and keep the shaft of a tilted probe off the
    wall's upper edge.
    """

    gap_m: float = param("Ball centre to each wall of the corner where it turns", unit="m", default=0.018, ge=0.012,
                         le=0.05)  # fmt: skip
    below_edge_m: float = param(
        "Depth of the ball's centre below the walls' upper edge", unit="m", default=0.020, ge=0.010, le=0.06
    )
    turn_deg: float = param("Turn of the hand to either side", unit="deg", default=90.0, ge=20.0, le=90.0)
    speed_m_s: float = param("Speed towards the walls", unit="m/s", default=0.015, gt=0.0, le=0.03)
    travel_speed_m_s: float = param("Speed above the walls, and of a turn 0.1 m from its axis", unit="m/s",
                                    default=0.25, gt=0.0, le=0.25)  # fmt: skip
    press_N: float = param(
        "Increase of the force in the presses that measure the compliance; 0: it is not measured", unit="N",
        default=3.0, ge=0.0, le=6.0,
    )  # fmt: skip
    search_m: float = param("Search for the walls this far past their nominal place", unit="m", default=0.010, ge=0.001,
                            le=0.02)  # fmt: skip


class ToolCalibrate(Skill):
    """Touch the two walls of the tool's corner with the hand straight and turned to either side.

    Touches of the same wall at different yaws give the ball's offset from its nominal place in the hand; the errors of
    the walls cancel. The rise to the touching height accelerates the hand: the delay of the wrist's force behind the
    acceleration is the sensor's latency. With the jaws' axis along one wall, each wall is pressed harder: the hand's
    advance over the increase of the force is the probe's compliance in that direction, if the wall is rigid. The
    wrist's gain is not observable from a press; it cancels in the deflection, compliance times measured force.

    SUCCESS: `tool` has the ball's place in the hand, its standard deviation, the compliance, and the sensor's latency.
    """

    PAUSE = "retreat"
    Params = ToolCalibrateParams
    params: ToolCalibrateParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"probe"})}
    USES: ClassVar = frozenset({"arm"})

    NO_WALL = Failure(
        "no_wall",
        "the ball met nothing where a wall should be",
        advice="check the container's pose and that the probe is held by its handle",
    )
    SLIPPED = Failure(
        "slipped",
        "no single place of the ball in the hand explains the touches, or the ball gives way to a press",
        advice="raise grip_N of tool_pickup, or lower speed_m_s",
    )
    FAILURES: ClassVar = (
        *Prober.FAILURES,
        MOTION_REFUSED.with_meaning("the corner cannot be reached, or the hand cannot be turned there"),
    )

    before = In(HeldTool, "the probe in the jaws", key="tool")
    tool = Out(HeldTool, "the probe, measured", result=in_words)

    def run(self) -> SkillRun:
        """See the class."""
        world, given = self.context.world, self.before
        height = given.floor_z_K_m + world.container.interior_m[2] - self.params.below_edge_m
        corner = corner_of(world, given)
        place = np.array([*corner_place(world, corner, self.params.gap_m), height])
        yield from self._enter(given, place)
        latency, latency_sd = yield from self._rise(given, place)
        listening = dataclasses.replace(given, latency_s=latency)
        touches: list[WallTouch] = []
        presses: list[Press] = []
        turned, turn = 0, np.deg2rad(self.params.turn_deg)
        straight = given.yaw_B_rad - math.remainder(given.yaw_B_rad - world.container.pose_B_K.yaw_rad, 0.5 * math.pi)
        with may_touch(self.context.arm, "tool", *corner_walls(corner)):
            for yaw in (straight, given.yaw_B_rad + turn, given.yaw_B_rad - turn):
                try:
                    yield from self._turn(listening, place, yaw)
                except MotionRefused as refusal:
                    self.event("note", text=f"the hand is not turned there: {refusal}")
                    continue
                turned += 1
                turned_tool = dataclasses.replace(listening, yaw_B_rad=yaw)
                touches += yield from self._touch_walls(turned_tool, place, presses if yaw == straight else None)
            yield from self._turn(listening, place, given.yaw_B_rad)
        if turned < 2:
            raise MotionRefused("calibration", "the hand cannot be turned at that corner")
        found = solve_tip(touches, given.tip_radius_m, touch_sd_m=TOUCH_SD_M, late_sd_s=latency_sd)
        self.tool = self._measured(listening, found, presses)
        walls = corner_walls(corner)
        self.report(
            "Calibration of the probe",
            f"{len(touches)} touches of two walls; one place of the ball in the hand explains them to within the "
            "residuals.",
            ("touch", "wall", "residual, mm"),
            [(i + 1, walls[t.wall], f"{1e3 * found.residuals_m[i]:.3f}") for i, t in enumerate(touches)],
        )

    def _enter(self, tool: HeldTool, place: Array) -> Motion[None]:
        """Move to just above the floor of the corner, from anywhere."""
        world, p = self.context.world, self.params
        prober = Prober(self.context, tool, GuardParams(latency_s=tool.latency_s))
        if np.linalg.norm(prober.tip_K_m[:2] - place[:2]) > NEAR_M:
            high = max(world.container.interior_m[2] + 0.06, float(prober.tip_K_m[2]))
            yield from prober.hop(place, high, p.travel_speed_m_s)
        low = np.array([*place[:2], tool.floor_z_K_m + LOW_M])
        yield from self.context.arm.line(tool.pose_B_P(world, low), min(p.travel_speed_m_s, FREE_M_S))

    def _rise(self, tool: HeldTool, place: Array) -> Motion[tuple[float, float]]:
        """Rise to the touching height; return the sensor's latency and its standard deviation, s. A pause waits."""
        arm = self.context.arm
        blocks: list[Observation] = []
        with arm.pause_signal.finishing():
            blocks += yield from arm.hold(0.1)
            yield from arm.line(
                tool.pose_B_P(self.context.world, place),
                min(self.params.travel_speed_m_s, FREE_M_S),
                acceleration_m_s2=RISE_ACCELERATION_M_S2,
                jerk_m_s3=RISE_JERK_M_S3,
                guard=blocks.append,
            )
            blocks += yield from arm.hold(0.15)
        up_S = arm.description.gripper.pose_E_P.rotation @ arm.pose_B_P.rotation[2]
        stamps = np.concatenate([b.stamp_s for b in blocks])
        even = np.arange(stamps[0], stamps[-1], 1.0 / RATE_HZ)
        height = np.interp(even, stamps, np.concatenate([b.position_B_P[:, 2] for b in blocks]))
        force = np.interp(even, stamps, np.concatenate([b.wrench_S for b in blocks])[:, :3] @ up_S)
        return wrench_delay(height, force, RATE_HZ)

    def _turn(self, tool: HeldTool, place: Array, yaw_B_rad: float) -> Motion[None]:
        """Turn about the vertical through the ball, via the grasp's yaw to keep the last joint off its stops."""
        for yaw in (tool.yaw_B_rad, yaw_B_rad):
            goal = tool.pose_B_P(self.context.world, place, yaw)
            if abs(math.remainder(self.context.arm.pose_B_P.yaw_rad - yaw, 2 * math.pi)) > 1e-3:
                yield from self.context.arm.line(goal, self.params.travel_speed_m_s)

    def _touch_walls(self, tool: HeldTool, place: Array, presses: list[Press] | None) -> Motion[list[WallTouch]]:
        """Touch each wall once, from `place` and back; append a press of each to `presses`."""
        p, arm = self.params, self.context.arm
        prober = Prober(self.context, tool, GuardParams(latency_s=tool.latency_s))
        sides = corner_of(self.context.world, tool)
        found = []
        for wall, name in enumerate(corner_walls(sides)):
            out = np.zeros(3)
            out[wall] = sides[wall]
            probed = yield from prober.move(place + (p.gap_m - tool.tip_radius_m + p.search_m) * out, p.speed_m_s)
            if probed.contact is None:
                raise self.NO_WALL(f"the ball met nothing up to {p.search_m * 1e3:.0f} mm past the {name}")
            self.event("contact", contact=probed.contact)
            approach_B = self.context.world.container.pose_B_K.rotation @ out
            found.append(
                WallTouch(
                    wall=wall,
                    approach=out[:2],
                    tip_m=probed.contact.tip_K_m[:2],
                    approach_P=(arm.pose_B_P.rotation.T @ approach_B)[:2],
                    speed_m_s=p.speed_m_s,
                )
            )
            if presses is not None and p.press_N > 0.0:
                presses.append((yield from self._press(prober, out, found[-1])))
            back = float((prober.tip_K_m - place) @ out)
            yield from prober.retreat(-out, back, min(p.travel_speed_m_s, FREE_M_S))
        return found

    def _press(self, prober: Prober, out: Array, touch: WallTouch) -> Motion[Press]:
        """Press the wall harder, from rest to rest, without a pause between."""
        p = self.params
        with self.context.arm.pause_signal.finishing():
            before = yield from prober.stand(STAND_S)
            max_N = p.press_N - float(before.force_K_N @ out)
            yield from prober.press(out, PRESS_M, min(p.speed_m_s, PRESS_M_S), max_N)
            after = yield from prober.stand(STAND_S)
        advance_m = float((after.hand_K_m - before.hand_K_m) @ out)
        force_N = float((before.force_K_N - after.force_K_N) @ out)
        if not advance_m <= MAX_COMPLIANCE_M_N * force_N:
            raise self.SLIPPED(
                f"a press of {advance_m * 1e3:.1f} mm raised the force by {force_N:.2f} N only: the ball gave way",
                advance_m=advance_m,
                force_N=force_N,
            )
        return Press(touch.approach_P, advance_m, force_N)

    def _measured(self, tool: HeldTool, found: TipCalibration, presses: list[Press]) -> HeldTool:
        """Return the tool with the measured values, if the touches agree."""
        worst = float(np.abs(found.residuals_m).max())
        if worst > MAX_RESIDUAL_M:
            raise self.SLIPPED(f"touches of the walls disagree by {worst * 1e3:.2f} mm", residual_m=worst)
        latency = max(tool.latency_s + found.late_s, 0.0)
        measured = dataclasses.replace(
            tool,
            tip_P_m=tool.tip_P_m + np.array([*found.tip_error_P_m, 0.0]),
            latency_s=latency,
            tip_sd_m=found.tip_sd_m,
            corner_K_m=corner_of(self.context.world, tool) * found.walls_m,
            compliance_P_m_N=solve_compliance(presses) if presses else None,
        )
        arm = self.context.arm
        if arm.scene.holding_tool:
            taken = Pose.pointing_down(np.zeros(3), tool.yaw_B_rad)
            arm.tool_seat.measured(taken.apply(measured.tip_P_m)[:2])
        self.event(
            "calibration",
            tip_P_m=measured.tip_P_m,
            tip_sd_m=found.tip_sd_m,
            latency_s=latency,
            latency_sd_s=found.late_sd_s,
            corner_K_m=measured.corner_K_m,
            residuals_m=found.residuals_m,
            compliance_P_m_N=measured.compliance_P_m_N,
            pressed_N=[press.force_N for press in presses],
        )
        return measured
