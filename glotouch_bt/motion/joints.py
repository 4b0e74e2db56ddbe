"""Joint-space moves for long free-space travel, where the path of P does not matter."""

from __future__ import annotations

import numpy as np

from glotouch_bt.motion.kinematics import Kinematics
from glotouch_bt.motion.timing import JointProfile, ProfileLimits, Progress, joint_move
from glotouch_bt.robot import Array, Limits, MotionRefused

SPEED_RISE_S = 0.4
"""Time to full joint speed. Own choice; the description has no acceleration limits."""
ACCELERATION_RISE_S = 0.1
"""Time to full joint acceleration. Own choice; the description has no jerk limits."""
_SPEED_SAMPLES = 40
"""Number of postures at which the tool speed is checked."""


def plan_joints(
    kinematics: Kinematics, start: Array, end: Array, speed: float, limits: Limits, period_s: float
) -> tuple[JointProfile, Array]:
    """Plan from rest to rest on a straight line in joint space.

    Args:
        kinematics: The arm.
        start, end: (dof,) rad.
        speed: 0..1, fraction of the joint speed limits; lowered so that P stays within the tool speed limit.
        limits: Source of the tool speed limit.
        period_s: Control period.

    Returns:
        The profile, and the postures (k, dof) at which to check clearance: from start to end, at most 2 degrees apart.

    Raises:
        MotionRefused: The end is outside a joint's range, or speed outside 0..1.
    """
    if not 0.0 < speed <= 1.0:
        raise MotionRefused("joint move", f"speed {speed:g} is not within 0..1")
    if start.shape != end.shape or not np.isfinite(end).all():
        raise MotionRefused("joint move", f"its end must be {len(start)} finite numbers")
    for joint, value in zip(kinematics.description.joints, end, strict=True):
        if not joint.lower_rad <= value <= joint.upper_rad:
            raise MotionRefused(
                "joint move",
                f"{joint.name} at {value:.3f} rad is outside its range {joint.lower_rad:.3f}..{joint.upper_rad:.3f}",
            )
    largest = float(np.abs(end - start).max())
    checks = np.linspace(start, end, max(2, int(np.ceil(largest / np.radians(2.0))) + 1))
    if largest < 1e-9:
        there = Progress(np.ones(1), np.zeros(1), np.zeros(1))
        return JointProfile.along(start, end - start, there, ProfileLimits(1.0, 1.0, 1.0)), checks
    velocity = speed * kinematics.velocity
    profile = _profile(start, end, velocity, 1.0, period_s)
    picks = np.unique(np.linspace(0, len(profile.q) - 1, _SPEED_SAMPLES).astype(int))
    fastest = max(float(np.linalg.norm((kinematics.jacobian(profile.q[k]) @ profile.dq[k])[:3])) for k in picks)
    if fastest > limits.tcp_speed_m_s:
        # Time scaling: stretching time by 1/r scales speed by r, acceleration by r^2 and jerk by r^3 on the same path.
        profile = _profile(start, end, velocity, 0.98 * limits.tcp_speed_m_s / fastest, period_s)
    return profile, checks


def _profile(start: Array, end: Array, velocity: Array, slower: float, period_s: float) -> JointProfile:
    acceleration = velocity / SPEED_RISE_S
    jerk = acceleration / ACCELERATION_RISE_S
    return joint_move(start, end, velocity * slower, acceleration * slower**2, jerk * slower**3, period_s)
