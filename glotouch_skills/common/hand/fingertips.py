"""Places under the fingertips, and which fingertip came down on something."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from glotouch_bt.motion import Arm, Motion
from glotouch_bt.robot import Array, Gripper, Observation, Pose

ALONG, ACROSS = 5, 3
"""Number of places under a fingertip along x_P and along y_P."""
FEEL_S = 0.05
"""Time for which the force on a standing hand is averaged."""
ONE_SIDED = 0.5
"""The force acts on one finger if it lies at least this far from the middle, as a fraction of the way to that finger.
Source: ours; a force on both fingers alike lies in the middle."""


def fingertip_places(arm: Arm, pose_B_P: Pose, opening_m: float) -> Array:
    """Return places (2, n, 2) in K under the right and the left fingertip (-y_P, +y_P), those of inner edges first."""
    pose_K_P = arm.world.container.pose_B_K.inverse() @ pose_B_P
    return _places(arm.description.gripper, pose_K_P, opening_m)


def inner_edges(gripper: Gripper, pose_K_P: Pose, opening_m: float) -> Array:
    """Return places (n, 2) in K under the inner edges of both fingertips."""
    return np.concatenate(_places(gripper, pose_K_P, opening_m)[:, :ALONG])


def _places(gripper: Gripper, pose_K_P: Pose, opening_m: float) -> Array:
    finger = gripper.finger
    x, y = (
        centre + half * np.linspace(-1.0, 1.0, count)
        for centre, half, count in zip(finger.centre_m, finger.half_m, (ALONG, ACROSS), strict=False)
    )
    across, along = (a.ravel() for a in np.meshgrid(y + 0.5 * opening_m, x, indexing="ij"))
    places_P = np.array([np.column_stack([along, side * across, 0.0 * along]) for side in (-1.0, 1.0)])
    return np.asarray([pose_K_P.apply(places)[:, :2] for places in places_P])


def fingertips_K_m(arm: Arm, pose_B_P: Pose) -> float:
    """Return the height in K of the fingertips at a pose."""
    at = arm.world.container.pose_B_K.inverse().apply(pose_B_P.position_m)
    return float(at[2]) - arm.description.gripper.fingertip_below_P_m


def rise_from_met(arm: Arm, rise: Motion[None]) -> Motion[None]:
    """Rise from what the fingertips came down on, and record where it is, so that no fingertip comes down there again.

    Args:
        arm: The arm, with the fingertips on something.
        rise: The motion that takes the hand up into free space.
    """
    pose_B_P, opening_m = arm.pose_B_P, arm.aperture_m
    standing = yield from arm.hold(FEEL_S)
    yield from rise
    free = yield from arm.hold(FEEL_S)
    side = force_offset_m(standing, free, arm.description.gripper.pose_E_P) / (0.5 * opening_m)
    right, left = fingertip_places(arm, pose_B_P, opening_m)
    tips_m = fingertips_K_m(arm, pose_B_P)
    if side < ONE_SIDED:
        arm.felt.add_met(right, tips_m)
    if side > -ONE_SIDED:
        arm.felt.add_met(left, tips_m)


def force_offset_m(pressed: Sequence[Observation], free: Sequence[Observation], pose_E_P: Pose) -> float:
    """Return the coordinate along y_P at which a force along z_P acts: its moment about x_P over the force.

    Args:
        pressed: The hand at rest, pressed.
        free: The same hand at rest in free space.
        pose_E_P: P in E (S = E).
    """
    wrench_E = np.mean([b.wrench_S.mean(axis=0) for b in pressed], axis=0)
    wrench_E = wrench_E - np.mean([b.wrench_S.mean(axis=0) for b in free], axis=0)
    force_P = pose_E_P.rotation.T @ wrench_E[:3]
    torque_P = pose_E_P.rotation.T @ (wrench_E[3:] - np.cross(pose_E_P.position_m, wrench_E[:3]))
    return float(torque_P[0] / force_P[2]) if abs(force_P[2]) > 1e-6 else 0.0
