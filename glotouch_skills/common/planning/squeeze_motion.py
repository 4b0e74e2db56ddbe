"""Moves of a squeeze: descend over a candidate with open jaws, close once, rise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from glotouch_bt.motion import Motion, hand_pose_B
from glotouch_bt.perception.touch import (
    Candidate,
    Layer,
    ObjectMotion,
    estimate_object_motion,
    make_layer,
    pad_noise_m,
    relief_of_closure,
)
from glotouch_bt.perception.touch.calibration import JawZero
from glotouch_bt.robot import Array, Command, Gripper, GripperTarget, MotionRefused, Observation, Pose, TactileFrame
from glotouch_bt.skill import Context, SkillParams, param
from glotouch_skills.common.hand import close_compliantly, descend, fingertips_K_m, glide, release, rise_from_met
from glotouch_skills.common.planning.squeeze_plan import Stance

HAND_CLEARANCE_M = 0.005
"""Least distance of the fingertips from the floor, and of the hand's body from a candidate's top."""
MIN_GAP_M = 0.003
"""Least height between two different closures."""
FAST_RISE_RATIO = 5.0
"""Speed of moving up beside the object over the slow speed: the open fingers have just come down that way. Source:
ours; 50 mm/s by default."""
LEDGE_CLEARANCE_M = 0.003
"""Clearance of the fingertips above a ledge that they met, so that they do not drag the object. Source: ours."""
MAX_LEDGE_RATIO = 0.6
"""Maximum height of the pads above a ledge, as a fraction of the object's height: jaws that close higher topple it.
Source: ours."""
LOW_M = 0.03
"""Pads at most this high above the floor may close above a ledge of any object: it does not topple. Source: ours."""
IMAGE_AFTER = 3
"""Gel images are requested when the settling time over this has passed, so that they are taken on the plateau and
arrive before its end. Source: ours."""
UNTOUCHED_M = 0.002
"""The jaws touch nothing until they have closed by this. Source: ours, half of the smallest gap beside an object."""
OPENING_M_S = 0.2
"""Speed at which the empty jaws open."""


class ClosureParams(SkillParams):
    """Parameters of all squeezing skills.

    The descent is slow because of the worst case: both fingertips flat on a rigid foot. At 15 mm/s, the force reached
    26 N before the first sample could show it and 34 N 10 ms later (simulated; proportional to the speed). The hard
    limit is 30 N.
    """

    force_N: float = param("Closing force of one jaw", unit="N", default=10.0, gt=0.0, le=10.0)
    closing_speed_m_s: float = param("Closing speed", unit="m/s", default=0.03, gt=0.0, le=0.2)
    layers: int = param("Closures per sequence", default=4, ge=1, le=10)
    layer_gap_m: float = param("Least distance between two layers", unit="m", default=0.012, ge=0.002, le=0.05)
    side_gap_m: float = param(
        "Gap between open jaw and contour on each side", unit="m", default=0.010, ge=0.004, le=0.03
    )
    travel_speed_m_s: float = param("Speed of the empty hand", unit="m/s", default=0.25, gt=0.0, le=0.25)
    descent_speed_m_s: float = param(
        "Speed of the descent beside the object", unit="m/s", default=0.010, gt=0.0, le=0.04
    )
    headroom_m: float = param(
        "Height of the fingertips above the floor on the way", unit="m", default=0.14, ge=0.05, le=0.25
    )
    settle_s: float = param("Duration of measuring the plateau", unit="s", default=0.15, ge=0.05, le=1.0)
    top_overlap_m: float = param(
        "Highest layer: distance of the pad centre below the top", unit="m", default=0.008, ge=0.0, le=0.03
    )
    gel_images: bool = param(
        "Take images of the gels in every closure, too: they tell apart objects that differ in fine relief",
        needs="camera",
        default=False,
    )


def lowest_pads_m(height_m: float, gripper: Gripper) -> float:
    """Return the least height of the pads' mid-point: fingertips clear of the floor, body clear of the object's top."""
    body_above_P = gripper.pose_E_P.position_m[2] - max(b.centre_m[2] + b.half_m[2] for b in gripper.body)
    return float(max(gripper.fingertip_below_P_m, height_m - body_above_P) + HAND_CLEARANCE_M)


def layer_heights(candidate: Candidate, gripper: Gripper, p: ClosureParams) -> Array:
    """Return the pad-centre heights above the floor, lowest first.

    A low object is squeezed up to where only the lower half of the pads touches it, since a single layer a sequence
    would leave no spare.
    """
    lowest = lowest_pads_m(candidate.height_m, gripper)
    highest = max(candidate.height_m - p.top_overlap_m, min(lowest + p.layer_gap_m, candidate.height_m), lowest)
    least = 1 if highest - lowest < MIN_GAP_M else min(2, p.layers)
    count = int(np.clip(np.floor((highest - lowest) / p.layer_gap_m) + 1, least, p.layers))
    return np.linspace(lowest, highest, count)


class Squeezing:
    """The hand over one candidate.

    Args:
        context: The skill's context.
        candidate: Object to squeeze.
        at: Stance of the open hand.
        params: Parameters of the closures.
        zero: Offset of the reported aperture, subtracted from every aperture.

    Attributes:
        yaw_K_rad: Direction of x_P that the hand takes: that of `at`, or its half turn.
    """

    def __init__(
        self, context: Context, candidate: Candidate, at: Stance, params: ClosureParams, zero: JawZero | None = None
    ) -> None:
        self.candidate, self.at = candidate, at
        self._zero = zero or JawZero()
        self._context, self._p = context, params
        arm, container = context.arm, context.world.container
        self.yaw_K_rad = hand_pose_B(arm, container, np.zeros(3), at.yaw_K_rad).yaw_rad - container.pose_B_K.yaw_rad

    def go_down(self, height_m: float) -> Motion[None]:
        """Move over the candidate with open jaws and descend to `height_m`.

        Fingers that come down on a low ledge of the object stop above it: its sides are felt there.

        Raises:
            MotionRefused: There is no way, or the fingers touched something high; the hand is high again.
        """
        arm, p = self._context.arm, self._p
        tips = arm.description.gripper.fingertip_below_P_m
        above = self._pose(p.headroom_m + tips)
        yield from arm.jaws(self.at.opening_m, speed_m_s=OPENING_M_S)
        travel_z = max(float(arm.pose_B_P.position_m[2]), float(above.position_m[2]))
        yield from arm.transit(above, height_B_m=travel_z, speed_m_s=p.travel_speed_m_s)
        goal = self._pose(height_m)
        top_m, slow_m_s = self.candidate.height_m, p.descent_speed_m_s
        if not (yield from descend(self._context, goal, self.at.opening_m, top_m, slow_m_s)):
            above_m = pads_height_m(self._context) + LEDGE_CLEARANCE_M
            highest_m = max(MAX_LEDGE_RATIO * top_m, min(LOW_M, top_m - p.top_overlap_m))
            if above_m <= highest_m:
                yield from arm.line(self._pose(above_m), p.descent_speed_m_s, check=False)
                return
            tips_mm = 1e3 * fingertips_K_m(arm, arm.pose_B_P)
            yield from rise_from_met(arm, self.rise())
            raise MotionRefused("squeeze", f"a fingertip came down on something {tips_mm:.0f} mm above the floor")

    def move_to(self, height_m: float) -> Motion[bool]:
        """Move up or down beside the object with open jaws; return False if the fingers touched something."""
        ratio = FAST_RISE_RATIO if height_m > pads_height_m(self._context) else 1.0
        return (yield from glide(self._context, self._pose(height_m), ratio * self._p.descent_speed_m_s))

    def close(self) -> Motion[tuple[Layer, ObjectMotion]]:
        """Close once where the hand is, and open again; a pause waits until then.

        Raises:
            MotionRefused: The force on the hand was too large; the jaws are open.
        """
        with self._context.arm.pause_signal.finishing():
            return (yield from self._close())

    def _close(self) -> Motion[tuple[Layer, ObjectMotion]]:
        p, arm = self._p, self._context.arm
        gripper, felt = arm.description.gripper, arm.felt.state()
        closing: list[Observation] = []
        if p.gel_images:
            closing.append((yield Command(tactile=True, images=True)))  # of the untouched gels
        yield from close_compliantly(arm, p.closing_speed_m_s, p.force_N, tactile=True, on_observation=closing.append)
        command = Command(gripper=GripperTarget(0.0, p.closing_speed_m_s, p.force_N), tactile=True)
        blocks: list[Observation] = []
        periods = round(p.settle_s / arm.period_s)
        for k in range(periods):
            asked = p.gel_images and k == periods // IMAGE_AFTER
            blocks.append((yield replace(command, images=True) if asked else command))
        contour = self.candidate.contour
        x_P = np.array([np.cos(self.yaw_K_rad), np.sin(self.yaw_K_rad)])
        middle = float(x_P @ (contour.centre_K_m - self.at.position_K_m))
        half_diagonal = 0.5 * float(np.hypot(*contour.size_m)) if contour.family != "circle" else contour.radius_m
        noise_m = pad_noise_m(_untouched(closing))
        object_motion = estimate_object_motion(
            [*closing, *blocks], gripper.pad_window_m[0], middle, half_diagonal, noise_m, arm.rotation_P_S[1]
        )
        measured = self._context.world.container.pose_B_K.inverse().apply(blocks[-1].pose_B_P.position_m)
        layer = make_layer(
            blocks,
            height_m=float(measured[2]),
            position_K_m=measured[:2],
            yaw_rad=self.yaw_K_rad,
            force_N=p.force_N,
            pad_shape=gripper.pad_shape,
            object_motion=object_motion,
            noise_m=noise_m,
            relief=relief_of_closure(closing, blocks, gripper),
        )
        if layer.stable and object_motion.detected:  # what was felt beside it holds until such motions add up
            arm.felt.restore(felt)
            arm.felt.moved_a_little(self.at.position_K_m, object_motion.share)
        yield from release(arm, self.at.opening_m)
        true_m = layer.aperture_m - self._zero.error_m
        return replace(layer, aperture_m=true_m, zero_sd_m=self._zero.sd_m), object_motion

    def rise(self) -> Motion[None]:
        """Rise to travelling height."""
        arm = self._context.arm
        above = self._pose(self._p.headroom_m + arm.description.gripper.fingertip_below_P_m)
        yield from arm.line(above, self._p.travel_speed_m_s, check=False)

    def _pose(self, height_m: float) -> Pose:
        position = np.array([*self.at.position_K_m, height_m])
        return hand_pose_B(self._context.arm, self._context.world.container, position, self.yaw_K_rad)


def _untouched(closing: list[Observation]) -> list[TactileFrame]:
    """Return the frames that were taken while the jaws had hardly moved."""
    opening_m = closing[0].gripper.aperture_m
    moved_s = next((b.now_s for b in closing if b.gripper.aperture_m < opening_m - UNTOUCHED_M), closing[-1].now_s)
    return [b.tactile for b in closing if b.tactile is not None and b.tactile.stamp_s <= moved_s]


def disturbance(candidate: Candidate, layer: Layer, object_motion: ObjectMotion) -> dict[str, object] | None:
    """Data of an `object_moved` event, or None: no closure drags, turns or topples an object silently."""
    lost = object_motion.detected and not layer.stable
    if not (object_motion.moved or lost):
        return None
    return {
        "candidate": candidate.index,
        "height_m": layer.height_m,
        "slide_m": layer.slide_m,
        "turn_rad": layer.turn_rad,
        "compliance_m": layer.compliance_m,
        "lost": layer.why_not if lost else "",
    }


def pads_height_m(context: Context) -> float:
    """Return the commanded height of the pads' mid-point above the container floor."""
    return float(context.world.container.pose_B_K.inverse().apply(context.arm.pose_B_P.position_m)[2])
