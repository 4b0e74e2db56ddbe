"""Touching with the held probe: the guarded moves that several skills share. All positions are ball centres in K."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from glotouch_bt.motion import Motion, MoveResult
from glotouch_bt.robot import Array, MotionRefused, Pose
from glotouch_bt.touch import Baseline, Contact, ContactGuard, GuardParams, Onset, contact_point, fit_baseline
from skills.base import Context
from skills.held_tool import HeldTool

BASELINE_S = 0.12
SETTLE_S = 0.08
GENTLE_ACCELERATION_M_S2, GENTLE_JERK_M_S3 = 0.3, 5.0
"""Limits while a guard listens: the hand's own inertia stays below 0.06 N at the tip (feasibility study)."""

INERTIA_MARGIN = 1.5
"""Thresholds along the probe exceed the hand's largest inertial force by this factor."""


@dataclass(frozen=True)
class Probed:
    """Outcome of one guarded move of the tip.

    Attributes:
        contact: What stopped it, or None if it ran its whole way.
        path_K_m: (n, 3) where the tip's centre has been, one row a control period.
    """

    contact: Contact | None
    path_K_m: Array


class Prober:
    """Moves the ball of the held probe about, listening at the wrist.

    Args:
        context: The skill's context.
        tool: The held probe.
        guard: Contact thresholds.
    """

    def __init__(self, context: Context, tool: HeldTool, guard: GuardParams) -> None:
        self._context, self._tool, self._guard = context, tool, guard
        self._world = context.world
        self._pose_K_B = context.world.container.pose_B_K.inverse()

    @property
    def tip_K_m(self) -> Array:
        """(3,) where the ball's centre is commanded to be."""
        return self._tool.tip_K_m(self._world, self._context.arm.pose_B_P)

    def baseline(self) -> Motion[Baseline]:
        """Hold still and take the wrench that means "nothing touched"."""
        blocks = yield from self._context.arm.hold(BASELINE_S)
        return fit_baseline(np.concatenate([b.wrench_S for b in blocks]))

    def move(self, tip_K_m: Array, speed_m_s: float, *, any_direction: bool = False) -> Motion[Probed]:
        """Straight guarded move of the ball to `tip_K_m` (3,).

        Stops at the first contact that opposes the motion, or, with `any_direction`, at any (a graze too).
        """
        step = np.asarray(tip_K_m, dtype=np.float64) - self.tip_K_m
        length = float(np.linalg.norm(step))
        if length < 1e-4:
            return Probed(None, self.tip_K_m[None, :])
        step_B = self._world.container.pose_B_K.rotation @ step
        guard = yield from self._listen(None if any_direction else step_B / length)
        result = yield from self._context.arm.shift(
            step_B,
            speed_m_s,
            acceleration_m_s2=GENTLE_ACCELERATION_M_S2,
            jerk_m_s3=GENTLE_JERK_M_S3,
            guard=guard,
        )
        return self._outcome(result, step / length)

    def retreat(self, direction_K: Array, distance_m: float, speed_m_s: float) -> Motion[None]:
        """Unguarded move away from a contact along `direction_K` (3,), then a short rest for the wrench to settle."""
        step_B = self._world.container.pose_B_K.rotation @ (np.asarray(direction_K) * distance_m)
        yield from self._context.arm.shift(step_B, speed_m_s)
        yield from self._context.arm.hold(SETTLE_S)

    def hop(self, tip_K_m: Array, height_K_m: float, speed_m_s: float) -> Motion[None]:
        """Straight up until the ball's centre is at `height_K_m`, then across to above `tip_K_m`; unguarded."""
        tip = self.tip_K_m
        for goal in (np.array([tip[0], tip[1], height_K_m]), np.array([tip_K_m[0], tip_K_m[1], height_K_m])):
            if np.linalg.norm(goal - self.tip_K_m) > 1e-4:
                yield from self._context.arm.line(self._tool.pose_B_P(self._world, goal), speed_m_s)

    def _listen(self, approach_B: Array | None) -> Motion[ContactGuard]:
        baseline = yield from self.baseline()
        gripper = self._context.arm.description.gripper
        return ContactGuard(baseline, approach_B, self._tool.tip_P_m, gripper.pose_E_P, self._params(approach_B))

    def _params(self, approach_B: Array | None) -> GuardParams:
        """Thresholds for a direction: along the probe only the force tells, and it feels the whole hand's inertia.

        Across the probe the torque at the tip's lever tells a touch from inertia, so the thresholds stay as they are.
        """
        if approach_B is None:
            return self._guard
        gripper = self._context.arm.description.gripper
        mass_kg = gripper.mass_kg + 2 * gripper.finger_mass_kg + self._world.probe.mass_kg
        along = abs(float(approach_B @ self._context.arm.pose_B_P.rotation[:, 2]))
        inertial_N = INERTIA_MARGIN * mass_kg * GENTLE_ACCELERATION_M_S2 * along
        return replace(
            self._guard,
            directional_N=self._guard.directional_N + inertial_N,
            total_N=self._guard.total_N + inertial_N,
        )

    def _outcome(self, result: MoveResult, approach_K: Array) -> Probed:
        poses = result.path_B_m + self._context.arm.pose_B_P.rotation @ self._tool.tip_P_m
        path_K = self._pose_K_B.apply(poses)
        if result.stop is None:
            return Probed(None, path_K)
        if not isinstance(result.stop, Onset):
            raise MotionRefused("guarded move", f"the guard answered {result.stop!r}, not an onset")
        return Probed(self._contact(result.stop, approach_K), path_K)

    def _contact(self, onset: Onset, approach_K: Array) -> Contact:
        tip_K = self._tool.tip_K_m(self._world, Pose(onset.position_B_P, onset.quat_B_P))
        force_K = self._pose_K_B.rotation @ onset.force_B
        norm = float(np.linalg.norm(force_K))
        reaction = force_K / norm if norm > 1e-6 else -approach_K
        point = contact_point(tip_K[:2], self._tool.tip_radius_m, approach_K[:2], reaction[:2])
        return Contact(onset.stamp_s, tip_K, approach_K, reaction, point, norm)
