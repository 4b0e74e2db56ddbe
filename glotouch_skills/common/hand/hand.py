"""Moves of the open hand among objects: check its clearance, and descend until the fingers touch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from glotouch_bt.motion import Arm, Motion, SpeedSteps
from glotouch_bt.perception.touch import ContactGuard, GuardParams, fit_baseline
from glotouch_bt.robot import MotionRefused, Pose
from glotouch_bt.skill import Context
from glotouch_skills.common.hand.fingertips import fingertip_places, fingertips_K_m

CLEARANCE_M = 0.004
"""Distance kept from neighbours: they may have been pushed a few millimetres since they were traced."""
BUMP_N = 2.5
"""Force that counts as a touch of the fingertips: above the hand's inertial force, far below what harms."""
BUMP_CUTOFF_HZ = 100.0
"""Cutoff of the force filter. The threshold is far above the noise, so a faster filter can stop the hand sooner."""
BASELINE_S = 0.1
"""Time for which the force at rest is measured first."""
GLIDE_ACCELERATION_M_S2 = 0.6
"""Acceleration limit of a guarded descent."""
GLIDE_JERK_M_S3 = 20.0
"""Jerk limit of a guarded descent."""


class NoSpace(MotionRefused):
    """The open hand does not fit at a pose, and only because of candidates and walls: they can be moved apart."""


def require_clear(arm: Arm, pose_B_P: Pose, aperture_m: float, margin_m: float | None = None) -> None:
    """Check that the open hand is clear of everything at a pose, before any motion towards it.

    Raises:
        NoSpace: It would come too near to candidates or walls, and to nothing else; the first pair is named.
        MotionRefused: Out of reach, or it would come too near to something else; the first pair is named. Or a
            fingertip came down on something there before.
    """
    q = arm.kinematics.ik(pose_B_P, arm.q)
    violations = arm.scene.violations(q, aperture_m, margin_m)
    if violations:
        refusal = NoSpace if all(v.for_space for v in violations) else MotionRefused
        raise refusal("pose", str(violations[0]))
    tips_m = fingertips_K_m(arm, pose_B_P)
    for places in fingertip_places(arm, pose_B_P, aperture_m):
        if (met_m := arm.felt.met_below(places, tips_m)) is not None:
            raise MotionRefused("pose", f"a fingertip came down on something there, {met_m * 1e3:.0f} mm up")


def glide(
    context: Context, pose_B_P: Pose, speed_m_s: float, speed_steps: SpeedSteps = (), bump_N: float = BUMP_N
) -> Motion[bool]:
    """Move straight to a pose among objects and stop if the fingers touch one; return True if the pose was reached.

    The orientation must be the present one. The hand stops within 1 to 2 mm of the touch. `speed_steps` as in
    `Arm.follow`. `bump_N` is the force that counts as a touch.

    Raises:
        MotionRefused: Before moving.
    """
    arm = context.arm
    step = pose_B_P.position_m - arm.pose_B_P.position_m
    length = float(np.linalg.norm(step))
    if length < 1e-4:
        return True
    blocks = yield from arm.hold(BASELINE_S)
    gripper = arm.description.gripper
    guard = ContactGuard(
        fit_baseline(np.concatenate([b.wrench_S for b in blocks])),
        step / length,
        np.array([0.0, 0.0, gripper.fingertip_below_P_m]),
        gripper.pose_E_P,
        replace(GuardParams(), directional_N=bump_N, total_N=bump_N, sustained_N=bump_N, cutoff_Hz=BUMP_CUTOFF_HZ),
    )
    result = yield from arm.line(
        pose_B_P,
        speed_m_s,
        acceleration_m_s2=GLIDE_ACCELERATION_M_S2,
        jerk_m_s3=GLIDE_JERK_M_S3,
        speed_steps=speed_steps,
        guard=guard,
    )
    return result.stop is None
