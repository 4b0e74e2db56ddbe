"""The open hand: which yaw it takes, whether it has room, and how it goes down beside things it cannot see."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from glotouch_bt.motion import Arm, Motion
from glotouch_bt.perception.touch import ContactGuard, GuardParams, fit_baseline
from glotouch_bt.robot import MotionRefused, Pose
from glotouch_bt.skill import Context

CLEARANCE_M = 0.004
"""Room kept from neighbours: they may have been pushed a few millimetres since they were traced."""
BUMP_N = 2.5
"""Force on the fingertips that means they stand on something: above the hand's inertia, far below what harms."""
BUMP_CUTOFF_HZ = 100.0
"""A bump is far above the noise: a faster filter stops the hand sooner."""
BASELINE_S = 0.1
CAREFUL_ACCELERATION_M_S2, CAREFUL_JERK_M_S3 = 0.6, 20.0


def require_clear(arm: Arm, pose_B_P: Pose, aperture_m: float, margin_m: float | None = None) -> None:
    """Make sure that the open hand has room at a pose before anything moves towards it.

    Raises:
        MotionRefused: Out of reach, or some part would hit something; the pair is named.
    """
    q = arm.kinematics.ik(pose_B_P, arm.q)
    blocked = arm.scene.describe_violation(q, aperture_m, margin_m)
    if blocked is not None:
        raise MotionRefused("pose", blocked)


def glide(context: Context, pose_B_P: Pose, speed_m_s: float) -> Motion[bool]:
    """Straight to a pose among objects, stopping if the fingers meet one. True if the pose was reached.

    Orientation must be that of the present pose. Stops within a millimetre or two of the touch.

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
        replace(GuardParams(), directional_N=BUMP_N, total_N=BUMP_N, cutoff_Hz=BUMP_CUTOFF_HZ),
    )
    result = yield from arm.line(
        pose_B_P,
        speed_m_s,
        acceleration_m_s2=CAREFUL_ACCELERATION_M_S2,
        jerk_m_s3=CAREFUL_JERK_M_S3,
        guard=guard,
    )
    return result.stop is None
