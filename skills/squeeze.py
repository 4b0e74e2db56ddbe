"""Squeeze a candidate between the tactile jaws at several heights, in three sequences."""

from __future__ import annotations

import numpy as np

from glotouch_bt.motion import Motion
from glotouch_bt.robot import Array, Command, Gripper, GripperTarget, MotionRefused, Observation, Pose
from glotouch_bt.touch import Candidate, Layer, TouchSequence, TouchSet, make_layer
from skills.allowance import keeping_clear_of
from skills.base import In, Out, Skill, SkillFailed, SkillParams, SkillRun, param
from skills.closing import close_gently, let_go
from skills.hand import glide, hand_pose_B
from skills.squeeze_plan import Stance, plan_stances

HAND_CLEARANCE_M = 0.005
"""Fingertips stay this far above the floor, and the hand's body this far above a candidate's top."""

LEAST_GAP_M = 0.003
"""Two closures nearer to each other than this are one."""


class SqueezeParams(SkillParams):
    """Parameters of `squeeze`."""

    force_N: float = param("Closing force of one jaw", unit="N", default=10.0, gt=0.0, le=10.0)
    closing_speed_m_s: float = param("Closing speed", unit="m/s", default=0.03, gt=0.0, le=0.2)
    layers: int = param("Closures per sequence", default=4, ge=1, le=10)
    layer_gap_m: float = param("Least distance between two layers", unit="m", default=0.012, ge=0.002, le=0.05)
    side_gap_m: float = param("Open jaw to the contour, each side", unit="m", default=0.010, ge=0.004, le=0.03)
    travel_speed_m_s: float = param("Speed of the empty hand", unit="m/s", default=0.25, gt=0.0, le=0.25)
    descent_speed_m_s: float = param("Speed down beside the object", unit="m/s", default=0.015, gt=0.0, le=0.04)
    headroom_m: float = param("Fingertips above the floor on the way", unit="m", default=0.13, ge=0.05, le=0.25)
    settle_s: float = param("How long the plateau is watched", unit="s", default=0.15, ge=0.05, le=1.0)
    top_overlap_m: float = param(
        "Pad centre of the highest layer below the top", unit="m", default=0.008, ge=0.0, le=0.03
    )


class Squeeze(Skill):
    """Force-limited closures on one candidate.

    A round candidate is squeezed at three yaws, 60 degrees apart; a box-like one on three parallel tracks across
    its short side. Layers go from low to high: the first closure centres the object where it cannot topple.

    SUCCESS: at least one stable layer; `touchset` holds all of them.
    FAILURE `nothing_felt`: no closure reached a plateau on anything.
    FAILURE `no_squeeze`: the object does not fit between the open jaws, or its neighbours leave the fingers no room.
    """

    Params = SqueezeParams
    params: SqueezeParams
    candidate = In(Candidate, "what to squeeze")
    known = In(tuple, "all candidates, to keep clear of", key="candidates", required=False)
    touchset = Out(TouchSet, "what was felt")

    def run(self) -> SkillRun:
        """See the class."""
        candidate = self.candidate
        arm = self.context.arm
        others = tuple(c for c in (self.known or ()) if c.index != candidate.index)
        sequences: list[TouchSequence] = []
        refusals: list[str]
        with keeping_clear_of(arm, others):
            heights = self._heights(candidate)
            container = self.context.world.container
            stances, refusals = yield from plan_stances(
                candidate, arm, container, float(heights[0]), (self.params.side_gap_m, 0.5 * self.params.side_gap_m)
            )
            for at in stances:
                try:
                    sequences.append((yield from self._sequence(candidate, at, heights)))
                except MotionRefused as refusal:
                    refusals.append(str(refusal))
        touchset = TouchSet(candidate, tuple(sequences))
        stable = sum(layer.stable for layer in touchset.layers)
        self.event("touchset", touchset=touchset, refusals=refusals)
        if not sequences:
            raise SkillFailed(
                "no_squeeze", f"no squeeze of candidate {candidate.index} is possible: {'; '.join(refusals[:3])}"
            )
        if stable == 0:
            raise SkillFailed(
                "nothing_felt",
                f"no closure on candidate {candidate.index} reached a plateau",
                advice="the object may have moved away; trace it again",
                closures=len(touchset.layers),
            )
        self.touchset = touchset

    def _heights(self, candidate: Candidate) -> Array:
        """Pad-centre heights above the floor, lowest first.

        A low object is squeezed up to where only the lower half of the pads still feels it: one layer a sequence would
        leave no spare.
        """
        p, gripper = self.params, self.context.arm.description.gripper
        lowest = gripper.fingertip_below_P_m + HAND_CLEARANCE_M
        body_limit = candidate.height_m + HAND_CLEARANCE_M - (gripper.pose_E_P.position_m[2] - body_bottom_m(gripper))
        lowest = max(lowest, body_limit)
        highest = max(candidate.height_m - p.top_overlap_m, min(lowest + p.layer_gap_m, candidate.height_m), lowest)
        least = 1 if highest - lowest < LEAST_GAP_M else min(2, p.layers)
        count = int(np.clip(np.floor((highest - lowest) / p.layer_gap_m) + 1, least, p.layers))
        return np.linspace(lowest, highest, count)

    def _sequence(self, candidate: Candidate, at: Stance, heights: Array) -> Motion[TouchSequence]:
        """Open over the candidate, close at each height from below, rise."""
        p, arm, position = self.params, self.context.arm, at.position_K_m
        container = self.context.world.container
        tips = arm.description.gripper.fingertip_below_P_m
        yaw_K = hand_pose_B(arm, container, np.zeros(3), at.yaw_K_rad).yaw_rad - container.pose_B_K.yaw_rad
        above = self._pose(position, p.headroom_m + tips, yaw_K)
        yield from arm.jaws(at.opening_m, speed_m_s=0.2)
        travel_z = max(float(arm.pose_B_P.position_m[2]), float(above.position_m[2]))
        yield from arm.transit(above, height_B_m=travel_z, speed_m_s=p.travel_speed_m_s)
        near = min(candidate.height_m + 0.02, p.headroom_m) + tips
        yield from glide(self.context, self._pose(position, near, yaw_K), 3 * p.descent_speed_m_s)
        layers: list[Layer] = []
        reached = yield from glide(self.context, self._pose(position, float(heights[0]), yaw_K), p.descent_speed_m_s)
        if not reached:
            height = self._pads_height()
            yield from arm.line(above, p.travel_speed_m_s, check=False)
            raise MotionRefused("squeeze", f"the fingers met something {height * 1e3:.0f} mm above the floor")
        for height in heights:
            if not (yield from glide(self.context, self._pose(position, float(height), yaw_K), p.descent_speed_m_s)):
                break  # caught under something that sticks out; the layers below are good
            try:
                layers.append((yield from self._close(float(height), position, yaw_K)))
            except MotionRefused as refusal:  # what slopes or stands free here does so higher up, too
                self.event("note", text=f"a closure {height * 1e3:.0f} mm above the floor was given up: {refusal}")
                break
            yield from let_go(arm, at.opening_m)
        yield from arm.line(above, p.travel_speed_m_s, check=False)
        return TouchSequence(np.asarray(position), yaw_K, tuple(layers))

    def _pads_height(self) -> float:
        """Pads' mid-point above the container floor, as commanded."""
        pose_K_B = self.context.world.container.pose_B_K.inverse()
        return float(pose_K_B.apply(self.context.arm.pose_B_P.position_m)[2])

    def _close(self, height: float, position: Array, yaw_K: float) -> Motion[Layer]:
        p, arm = self.params, self.context.arm
        yield from close_gently(arm, p.closing_speed_m_s, p.force_N)
        command = Command(gripper=GripperTarget(0.0, p.closing_speed_m_s, p.force_N), tactile=True)
        blocks: list[Observation] = []
        for _ in range(round(p.settle_s / arm.period_s)):
            blocks.append((yield command))  # noqa: PERF401 (a comprehension cannot yield)
        pose_K_B = self.context.world.container.pose_B_K.inverse()
        measured = pose_K_B.apply(blocks[-1].pose_B_P.position_m)
        return make_layer(
            blocks,
            height_m=height,
            position_K_m=measured[:2],
            yaw_rad=yaw_K,
            force_N=p.force_N,
            pad_shape=arm.description.gripper.pad_shape,
        )

    def _pose(self, position_K: Array, height: float, yaw_K: float) -> Pose:
        return hand_pose_B(self.context.arm, self.context.world.container, np.array([*position_K, height]), yaw_K)


def body_bottom_m(gripper: Gripper) -> float:
    """How far the gripper's body reaches below the flange."""
    return max(b.centre_m[2] + b.half_m[2] for b in gripper.body)
