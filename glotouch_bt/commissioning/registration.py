"""Register the container: touch three of its walls and its floor with the closed fingers.

Two touches of one long wall give the yaw, one of each short wall the centre and a check of the length, the floor the
height. The container must be empty within 6 cm of its walls.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from glotouch_bt.motion import Arm, Motion, finger_outline_half_m, hand_pose_B
from glotouch_bt.robot import Array, Observation, Pose, World

TOUCH_N = 2.5
"""Force that counts as a touch: above the inertial force of the hand at this speed, far below a harmful one."""
APPROACH_M_S = 0.008
"""Speed towards a wall or the floor."""
TRAVEL_M_S = 0.08
"""Speed of free motions."""
CLEAR_M = 0.020
"""Distance of the fingers from the configured wall at the start of an approach."""
MAX_BEYOND_M = 0.015
"""Farthest motion beyond the configured wall."""
TIP_HEIGHT_M = 0.03
"""Height of the fingertips above the floor when they touch a wall."""
ABOVE_M = 0.03
"""Clearance of the fingertips above the walls."""
LOWER_M_S = 0.03
"""Speed of lowering."""
SETTLE_S = 0.3
"""Time at rest before a measurement."""
FLOOR_SHARE = 0.6
"""Place of the floor touch, as a share of the half length."""
SPREAD_SHARE = 0.30
"""Places of the two touches of the long wall, as shares of its half length from its middle."""


@dataclass(frozen=True)
class WallContact:
    """One touch.

    Attributes:
        wall: Name of the wall.
        normal_K: (2,) direction from the container's inside towards the wall, nominal K.
        point_K_m: (3,) the touched point of the fingers' outline, in nominal K.
        nominal_m: Configured distance of the wall along the normal.
        peak_N: Largest force while touching.
    """

    wall: str
    normal_K: Array
    point_K_m: Array
    nominal_m: float
    peak_N: float


@dataclass(frozen=True)
class Registration:
    """The measured pose of the container.

    Attributes:
        shift_K_m: (3,) shift of its centre, in nominal K (the height from the floor).
        yaw_rad: Its rotation about z_K.
        residual_m: Largest distance of a touch from a box of the configured size.
        pose_B_K: The corrected frame.
        peak_N: Largest force of all touches.
    """

    shift_K_m: Array
    yaw_rad: float
    residual_m: float
    pose_B_K: Pose
    peak_N: float


def solve(touches: list[WallContact], floor_m: float, pose_B_K: Pose) -> Registration:
    """Solve for a small shift t and rotation d by least squares.

    Each touch at r gives n.t - d (n_x r_y - n_y r_x) = n.r - nominal.
    """
    rows, values = [], []
    for touch in touches:
        n, r = touch.normal_K, touch.point_K_m
        rows.append([n[0], n[1], -(n[0] * r[1] - n[1] * r[0])])
        values.append(float(n @ r[:2]) - touch.nominal_m)
    a, b = np.array(rows), np.array(values)
    found, *_ = np.linalg.lstsq(a, b, rcond=None)
    shift = np.array([found[0], found[1], floor_m])
    return Registration(
        shift,
        float(found[2]),
        float(np.abs(a @ found - b).max()),
        pose_B_K @ Pose.planar(shift, float(found[2])),
        max(t.peak_N for t in touches),
    )


class TouchGuard:
    """Trips when the block's mean force has changed by `TOUCH_N` along a direction since the guard was made."""

    def __init__(self, observation: Observation, into_S: Array) -> None:
        self._into = into_S
        self._rest = float((observation.wrench_S[:, :3] @ into_S).mean())
        self.peak_N = 0.0

    def __call__(self, observation: Observation) -> float | None:
        """The force against the motion if it is a touch."""
        force = self._rest - float((observation.wrench_S[:, :3] @ self._into).mean())
        self.peak_N = max(self.peak_N, force)
        return force if force > TOUCH_N else None


def touch_walls(arm: Arm, world: World, observe: Callable[[], Observation]) -> Motion[Registration | str]:
    """Register the container with empty closed jaws; return an error text if a wall was not found."""
    interior = world.container.interior_m
    half = 0.5 * np.array(interior[:2])
    long_axis = int(half[1] > half[0])
    touches: list[WallContact] = []
    spread = SPREAD_SHARE * float(half[long_axis])
    across, along_it = 1 - long_axis, long_axis
    for axis, side, along in (
        (across, 1.0, -spread),
        (across, 1.0, spread),
        (along_it, 1.0, 0.0),
        (along_it, -1.0, 0.0),
    ):
        touch = yield from _touch_wall(arm, world, observe, axis, side, along)
        if isinstance(touch, str):
            return touch
        touches.append(touch)
    floor = yield from _touch_floor(arm, world, observe)
    if isinstance(floor, str):
        return floor
    return solve(touches, floor, world.container.pose_B_K)


def _over(world: World, arm: Arm) -> float:
    """Return the height of P in B at which the fingers clear the walls."""
    below = arm.description.gripper.fingertip_below_P_m
    floor = float(world.container.pose_B_K.position_m[2])
    return floor + world.container.interior_m[2] + below + ABOVE_M


def _lower(arm: Arm, world: World, observe: Callable[[], Observation], pose_B_P: Pose) -> Motion[str | None]:
    """Move up, across, and down under a guard, and rest there; return an error text if something is in the way."""
    height = _over(world, arm)
    above = Pose(np.array([*pose_B_P.position_m[:2], height]), pose_B_P.quat)
    yield from arm.transit(above, height, TRAVEL_M_S)
    yield from arm.hold(SETTLE_S)
    down_B = np.array([0.0, 0.0, -1.0])
    guard = TouchGuard(observe(), arm.rotation_B_S.T @ down_B)
    result = yield from arm.line(pose_B_P, LOWER_M_S, guard=guard, check=False)
    if result.stop is not None:
        yield from arm.line(above, TRAVEL_M_S, check=False)
        x, y, _ = world.container.pose_B_K.inverse().apply(pose_B_P.position_m).tolist()
        return f"something is where the fingers are lowered, at x {x:+.3f}, y {y:+.3f} m in the container: empty it"
    yield from arm.hold(SETTLE_S)
    return None


def _touch_wall(
    arm: Arm, world: World, observe: Callable[[], Observation], axis: int, side: float, along: float
) -> Motion[WallContact | str]:
    container = world.container
    reach = float(finger_outline_half_m(arm.description.gripper, 0.0)[axis])
    nominal_m = 0.5 * container.interior_m[axis]
    normal = np.zeros(3)
    normal[axis] = side
    start = np.zeros(3)
    start[axis], start[1 - axis] = side * (nominal_m - reach - CLEAR_M), along
    start[2] = TIP_HEIGHT_M + arm.description.gripper.fingertip_below_P_m
    blocked = yield from _lower(arm, world, observe, hand_pose_B(arm, container, start, 0.0))
    if blocked is not None:
        return blocked
    into_B = container.pose_B_K.rotation @ normal
    guard = TouchGuard(observe(), arm.rotation_B_S.T @ into_B)
    result = yield from arm.shift((CLEAR_M + MAX_BEYOND_M) * into_B, APPROACH_M_S, guard=guard, check=False)
    place = container.pose_B_K.inverse().apply(result.path_B_m[-1])
    yield from arm.shift(-CLEAR_M * into_B, TRAVEL_M_S, check=False)
    name = f"wall {'+' if side > 0 else '-'}{'xy'[axis]}"
    if result.stop is None:
        return f"{name} was not met within {MAX_BEYOND_M * 1e3:.0f} mm beyond its configured place"
    return WallContact(name, normal[:2], place + reach * normal, nominal_m, guard.peak_N)


def _touch_floor(arm: Arm, world: World, observe: Callable[[], Observation]) -> Motion[float | str]:
    """Return the height of the floor above its configured place."""
    below = arm.description.gripper.fingertip_below_P_m
    half = 0.5 * np.array(world.container.interior_m[:2])
    place = np.array([0.0, 0.0, below + CLEAR_M])
    place[int(half[1] > half[0])] = -FLOOR_SHARE * half.max()
    blocked = yield from _lower(arm, world, observe, hand_pose_B(arm, world.container, place, 0.0))
    if blocked is not None:
        return blocked
    down_B = np.array([0.0, 0.0, -1.0])
    guard = TouchGuard(observe(), arm.rotation_B_S.T @ down_B)
    result = yield from arm.shift((CLEAR_M + MAX_BEYOND_M) * down_B, APPROACH_M_S, guard=guard, check=False)
    lowest = float(result.path_B_m[-1][2]) - below - float(world.container.pose_B_K.position_m[2])
    yield from arm.shift(-CLEAR_M * down_B, TRAVEL_M_S, check=False)
    here = arm.pose_B_P.position_m
    yield from arm.shift([0.0, 0.0, max(0.0, _over(world, arm) - float(here[2]))], TRAVEL_M_S, check=False)
    if result.stop is None:
        return f"the floor was not met within {MAX_BEYOND_M * 1e3:.0f} mm below its configured place"
    return lowest
