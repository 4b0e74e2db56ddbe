"""Take the probe out of its holder and touch the floor with it, in a corner where nothing stands."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

import numpy as np

from glotouch_bt.motion import Motion, SpeedSteps, yaw_near_home
from glotouch_bt.perception.touch.calibration import JawZero, measured_zero
from glotouch_bt.robot import MotionRefused, Pose, SetPayload, Tare
from glotouch_bt.skill import MOTION_REFUSED, UNCHANGED, Failure, Out, Skill, SkillParams, SkillRun, param
from glotouch_bt.skill.probing import HeldTool
from glotouch_skills.common.hand import (
    DOWN_B,
    GRAVITY_M_S2,
    REQUEST_FAILED,
    STAND_S,
    UP_B,
    WRIST_STATES,
    Strayed,
    describe_stop,
    finish,
    may_touch,
    straight_guard,
    weigh_N,
)
from glotouch_skills.common.probe import (
    FEEL_FLOOR_FAILURES,
    FLOOR_SEARCH_M,
    HELD_TOLERANCE_M,
    corner_walls,
    corners,
    feel_floor,
)

MAX_APPROACH_FORCE_N = 8.0
"""Change of force that stops the open hand above the handle; without an obstacle it stays below 2 N."""
MAX_PULL_FORCE_N = 25.0
"""Change of force that stops the extraction. A ball that snags on its slot needs up to 23 N and comes out (harsh,
simulated)."""
OUT_M = 0.01
"""Height of the ball above the holder from which it rises fast. Source: ours."""
DOWN_M_S = 0.03
"""Speed down over the handle. Source: at 0.05 m/s, fingers that met something stopped the robot (`bench retrieve
--conditions realistic`, train of seed 41001, 71d5f16)."""
MAX_PULL_M_S = 0.05
"""Largest speed of the extraction. At this speed, a probe stuck with 3 N/mm is pulled by 2.5 N more until the arm
stops, which stays below the hard limit."""
SLOT_M_S = 0.02
"""Speed at which the ball enters the holder from below. A ball beside the middle of the slot snags on its edge and
slips in; if it is faster, the robot's own stop takes that for a collision (`bench search --conditions harsh`, seed
53657, e539f6ee)."""
SLOT_M = 0.018
"""Distance below the holder's lower edge from which the ball rises slowly. Source: ours; its radius, the height of the
rails, which the holder's description leaves out, and a margin."""
MAX_YIELDS = 4
"""Maximum number of rises. Between two of them the hand gives way to the slot. Source: ours."""
GIVE_WAY_M_S = 0.01
"""Speed of giving way. Source: ours."""
HORIZONTAL_B = np.array([1.0, 1.0, 0.0])
"""Selects the horizontal components in B."""
MIN_OPEN_M = 0.01
"""The jaws are opened at least this much wider than the handle before they go down over it. Source: ours."""

CLUTTER_M = 0.010
"""Maximum height of the floor above its nominal place; anything higher is an object. Source: ours; objects are at least
15 mm high."""


class ToolPickupParams(SkillParams):
    """Parameters of `tool_pickup`."""

    grip_N: float = param("Jaw force on the handle", unit="N", default=60.0, gt=0.0, le=60.0)
    speed_m_s: float = param("Speed with the probe in the hand", unit="m/s", default=0.25, gt=0.0, le=0.25)
    free_speed_m_s: float = param("Speed of the empty hand", unit="m/s", default=0.25, gt=0.0, le=0.25)
    floor_touch: bool = param("Touch the floor in a free corner to measure its height", default=True)
    corner_gap_m: float = param(
        "Distance of the ball's centre from each wall of that corner", unit="m", default=0.018, ge=0.008, le=0.05
    )


class ToolPickup(Skill):
    """Grasp the probe in its holder, pull it out, set the payload, tare, and touch the floor.

    If the probe is already in the jaws (after a preemption), continue from there without releasing it.

    SUCCESS: the probe is held and the floor's height is known.
    """

    PAUSE = "retreat"
    Params = ToolPickupParams
    params: ToolPickupParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"empty", "fingers", "untared", "probe"}), "wrist": WRIST_STATES}
    POSTCONDITIONS: ClassVar = {"hand": "probe", "wrist": "tared"}
    FAILURE_STATES: ClassVar = {
        "hand": frozenset({UNCHANGED, "empty", "probe"}),
        "wrist": frozenset({UNCHANGED, "tared", "stale"}),
    }
    RESTORED_BY: ClassVar = {"hand": "tool_return"}
    USES: ClassVar = frozenset({"arm"})

    NO_PROBE = Failure(
        "no_probe",
        "the jaws closed on nothing, or on something of another width than the handle",
        advice="check that the probe stands in its holder and that the holder's pose is right",
    )
    PROBE_NOT_LIFTED = Failure(
        "probe_not_lifted",
        "the hand came up without the probe's weight; jaws as far apart as the handle is wide stay closed, "
        "and the probe counts as held",
        advice="raise grip_N, or check the handle",
    )
    NO_FLOOR = Failure(
        "no_floor",
        "the ball met nothing where the container's floor should be, or something stands in every corner; the probe "
        "is held",
        advice="check the container's pose, that the probe is held by its handle, and that one corner is free",
    )
    HARD_CONTACT = Failure(
        "hard_contact",
        "the force on the hand passed a limit on the way to the handle, out of the holder, or to the floor",
        advice="check the holder's pose, and that nothing blocks the probe",
    )
    FAILURES: ClassVar = (
        REQUEST_FAILED,
        *FEEL_FLOOR_FAILURES,
        MOTION_REFUSED.with_meaning("the holder cannot be reached, or the jaws do not open"),
    )

    tool = Out(HeldTool, "the probe in the jaws")
    jaw_zero = Out(JawZero, "offset of the reported aperture, from the handle's width")

    def run(self) -> SkillRun:
        """See the class."""
        arm, world, p = self.context.arm, self.context.world, self.params
        probe = world.probe
        weight_N = probe.mass_kg * GRAVITY_M_S2
        if arm.scene.holding_tool and self._handle_wide(arm.aperture_m):
            aperture, yaw = arm.aperture_m, arm.pose_B_P.yaw_rad
            yield from self._rise()
        else:
            arm.scene.hold_tool(False)
            yaw = yaw_near_home(arm, world.holder.pose_B_grasp.yaw_rad)
            aperture = yield from self._grip(yaw)
            yield from self._rise()
            weight_N = yield from weigh_N(arm)
        if weight_N < 0.5 * probe.mass_kg * GRAVITY_M_S2:
            apart = arm.aperture_m
            arm.scene.hold_tool(self._handle_wide(apart))  # keep a possible probe: the wrist may be wrong
            raise self.PROBE_NOT_LIFTED(
                f"the hand carries {weight_N:.2f} N; the probe weighs {probe.mass_kg * GRAVITY_M_S2:.2f} N; the jaws "
                f"are {apart * 1e3:.1f} mm apart, the handle is {probe.handle_m[1] * 1e3:.1f}",
                weight_N=weight_N,
            )
        payload = SetPayload(probe.mass_kg, np.array([0.0, 0.0, probe.com_below_grasp_m]))
        yield from finish(self.context.requests.start(payload), "payload")
        seen = yield from arm.hold(0.2, tactile=True)
        self.jaw_zero = measured_zero(seen, probe.handle_m[1], arm.description.gripper.pad_shape)
        yield from finish(self.context.requests.start(Tare()), "tare")
        tool = HeldTool(
            tip_P_m=np.array([0.0, 0.0, probe.grasp_to_tip_m]),
            tip_radius_m=probe.tip_radius_m,
            aperture_m=aperture,
            yaw_B_rad=yaw,
        )
        if p.floor_touch:
            tool = yield from self._on_floor(tool)
        self.event(
            "tool", held=True, grasp_to_tip_m=probe.grasp_to_tip_m, floor_z_K_m=tool.floor_z_K_m, weight_N=weight_N,
            jaw_zero=self.jaw_zero,
        )  # fmt: skip
        self.tool = tool

    def _on_floor(self, tool: HeldTool) -> Motion[HeldTool]:
        """Touch the floor in the first corner where nothing stands; return the tool with that corner and height."""
        world, p = self.context.world, self.params
        heights_m: list[float] = []
        for corner in corners(world):
            there = dataclasses.replace(tool, corner=corner)
            floor_z = yield from feel_floor(self.context, there, p.corner_gap_m, p.speed_m_s, slowly=True)
            if floor_z is None:
                raise self.NO_FLOOR(
                    f"the ball met no floor {FLOOR_SEARCH_M * 1e3:.0f} mm below where the registration puts it"
                )
            if floor_z <= CLUTTER_M:
                return dataclasses.replace(there, floor_z_K_m=floor_z)
            self.event(
                "note",
                text=f"something {floor_z * 1e3:.0f} mm high stands by {' and '.join(corner_walls(corner))}",
            )
            heights_m.append(floor_z)
        raise self.NO_FLOOR(
            "something stands in every corner: the ball met it "
            + ", ".join(f"{1e3 * z:.0f}" for z in heights_m)
            + " mm above the floor",
            advice="clear one corner for the probe; if nothing stands there, check the container's pose",
            above_m=max(heights_m),
        )

    def _handle_wide(self, aperture_m: float) -> bool:
        """Return True if the aperture is the handle's width."""
        return abs(aperture_m - self.context.world.probe.handle_m[1]) <= HELD_TOLERANCE_M

    def _grip(self, yaw_B_rad: float) -> Motion[float]:
        """Descend over the stowed probe with open jaws, close on its handle, and return the aperture."""
        arm, world, p = self.context.arm, self.context.world, self.params
        grasp = Pose.pointing_down(world.holder.pose_B_grasp.position_m, yaw_B_rad)
        above = dataclasses.replace(grasp, position_m=grasp.position_m + np.array([0.0, 0.0, 0.06]))
        handle = world.probe.handle_m[1]
        opening = min(handle + 0.03, arm.description.gripper.stroke_m)
        yield from arm.jaws(max(opening, arm.aperture_m), speed_m_s=0.15)  # not narrower: an object may be between them
        yield from arm.transit(
            above, height_B_m=max(above.position_m[2], arm.pose_B_P.position_m[2]), speed_m_s=p.free_speed_m_s
        )
        yield from finish(self.context.requests.start(Tare()), "tare")
        state = yield from arm.jaws(opening, speed_m_s=0.15)  # again: closed fingertips would land on the handle
        if state.aperture_m < handle + MIN_OPEN_M:
            raise MotionRefused("jaws", f"they stay {state.aperture_m * 1e3:.1f} mm apart; the way down needs more")
        with may_touch(arm, "hand", "probe", "holder"):
            guard = yield from straight_guard(arm, DOWN_B, MAX_APPROACH_FORCE_N)
            moved = yield from arm.line(grasp, DOWN_M_S, guard=guard)
            if (why := describe_stop(moved)) is not None:
                yield from arm.line(above, 0.05)
                raise self.HARD_CONTACT(
                    f"the open hand met something on its way down over the handle: {why}",
                    advice="check the holder's pose",
                    travelled_m=moved.travelled_m,
                )
            state = yield from arm.jaws(0.0, speed_m_s=0.04, force_N=p.grip_N)
            if not self._handle_wide(state.aperture_m):
                yield from arm.jaws(opening, speed_m_s=0.1)
                yield from arm.line(above, 0.05)
                raise self.NO_PROBE(
                    f"the jaws closed to {state.aperture_m * 1e3:.1f} mm, the handle is {handle * 1e3:.1f}",
                    aperture_m=state.aperture_m,
                )
        arm.scene.hold_tool(True)
        arm.felt.forget()
        return state.aperture_m

    def _rise(self) -> Motion[None]:
        """Rise until the ball is well above the holder.

        A ball beside the middle of the slot pushes the hand aside. The hand then gives way and rises on.

        Raises:
            SkillFailed: `hard_contact`.
            GuardTripped: The arm does not follow its setpoints.
        """
        arm, world = self.context.arm, self.context.world
        for _ in range(MAX_YIELDS):
            out = float(world.holder.pose_B_grasp.position_m[2] - arm.pose_B_P.position_m[2]) + world.probe.length_m
            up = out + 0.06
            if up <= 1e-4:
                return
            guard = yield from straight_guard(arm, UP_B, MAX_PULL_FORCE_N)
            speed_steps = self._speed_steps(out, out - 2.0 * world.holder.half_m[2])
            moved = yield from arm.shift(
                up * UP_B, self.params.speed_m_s, check=False, speed_steps=speed_steps, guard=guard
            )
            why = describe_stop(moved)
            if why is None:
                return
            if not isinstance(moved.stop, Strayed):
                break
            seen = (yield from arm.hold(STAND_S))[-1]
            aside = (seen.position_B_P[-1] - arm.pose_B_P.position_m) * HORIZONTAL_B
            yield from arm.shift(aside, GIVE_WAY_M_S, check=False)
        raise self.HARD_CONTACT(f"the probe does not come out of its holder: {why}", travelled_m=moved.travelled_m)

    def _speed_steps(self, out_m: float, slot_m: float) -> SpeedSteps:
        """Return the speeds of rising by `slot_m` until the ball enters its slot, and by `out_m` until it is out."""
        speed = self.params.speed_m_s
        pull = min(speed, MAX_PULL_M_S)
        changes = ((0.0, pull), (slot_m - SLOT_M, min(pull, SLOT_M_S)), (slot_m, pull), (out_m + OUT_M, speed))
        return tuple((max(at, 0.0), pace) for at, pace in changes)
