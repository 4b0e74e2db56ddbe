"""Faults of the arm and its connection: altered setpoints and lost, slow or failing cycles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from glotouch_bt.faults.effects.base import Cycle, Effect, EffectContext, FaultParams, param
from glotouch_bt.robot import HOLD, BackendError, BadInput, Command, MotionRefused, Observation, ParamError


class FollowingErrorParams(FaultParams):
    """Parameters of `following_error`."""

    joint: int = param("Index of the joint, from 0 at the base", default=3, ge=0, le=31)
    offset_rad: float = param("Final deviation from the setpoint", unit="rad", default=0.02, ge=-0.5, le=0.5)
    rise_s: float = param("Time in which the deviation grows to that", unit="s", default=0.5, gt=0.0, le=60.0)


class FollowingError(Effect[FollowingErrorParams]):
    """One joint deviates from its setpoint; the device measures its true position."""

    def __init__(self, params: FollowingErrorParams, context: EffectContext) -> None:
        super().__init__(params, context)
        if params.joint >= context.description.dof:
            raise BadInput(f"joint {params.joint}: this arm has joints 0 to {context.description.dof - 1}")
        self._joint = params.joint
        joint = context.description.joints[self._joint]
        self._range = joint.lower_rad, joint.upper_rad

    def begin(self) -> None:
        """See `Effect`."""
        self._away_rad = self._rate_rad_s = 0.0
        self._held = False

    def command(self, command: Command) -> Command:
        """See `Effect`."""
        if command.motion is None:
            self._held = True
            return command
        q, dq = np.array(command.motion.q), np.array(command.motion.dq)
        if self._held:  # the arm has braked by itself; the deviation grows from where the joint stands
            self._away_rad = float(self.context.sensed.q[-1, self._joint]) - float(q[self._joint])
            self._rate_rad_s, self._held = 0.0, False
        self._deviate()
        q[self._joint] = np.clip(q[self._joint] + self._away_rad, *self._range)
        dq[self._joint] += self._rate_rad_s
        return replace(command, motion=replace(command.motion, q=q, dq=dq))

    def _deviate(self) -> None:
        """Let the deviation grow for one period; the joint takes a period to reach its speed, and one to stop."""
        before, offset_rad = self._rate_rad_s, self.params.offset_rad
        rate_rad_s = offset_rad / self.params.rise_s
        half_step = 0.5 * self.context.period_s * rate_rad_s
        left = (offset_rad - self._away_rad) * (1.0 if offset_rad > 0.0 else -1.0)
        if left > 1.001 * abs(half_step):
            self._rate_rad_s = rate_rad_s
            self._away_rad += half_step + 0.5 * self.context.period_s * before
        else:
            self._rate_rad_s = 0.0
            if left > 0.0:  # otherwise it has braked beyond its final deviation, and stays there
                self._away_rad = offset_rad


class JointLimitParams(FaultParams):
    """Parameters of `joint_limit`."""

    margin_rad: float = param("Largest joint motion since its start", unit="rad", default=0.05, gt=0.0, le=3.0)


class JointLimit(Effect[JointLimitParams]):
    """The device refuses setpoints outside a range narrower than in its description."""

    def begin(self) -> None:
        """See `Effect`."""
        self._centre = np.array(self.context.sensed.q[-1])

    def command(self, command: Command) -> Command:
        """See `Effect`."""
        if command.motion is None:
            return command
        away = np.abs(command.motion.q - self._centre)
        worst = int(away.argmax())
        if away[worst] > self.params.margin_rad:
            self.actions.count += 1
            joint = self.context.description.joints[worst]
            rule = f"within {self.params.margin_rad:g} rad of {self._centre[worst]:.3f} rad (injected joint limit)"
            raise ParamError(f"command.motion.q[{joint.name}]", float(command.motion.q[worst]), rule)
        return command


class LostCycleParams(FaultParams):
    """Parameters of `lost_cycle`."""

    lost: float = param("Share of the commands that are lost", default=0.2, gt=0.0, le=1.0)


class LostCycle(Effect[LostCycleParams]):
    """Commands get lost on the way: the device holds for that period."""

    def command(self, command: Command) -> Command:
        """See `Effect`."""
        asks = command.motion is not None or command.gripper is not None
        lost = asks and self.context.rng.random() < self.params.lost
        return replace(HOLD, tactile=command.tactile) if lost else command


class SlowCycleParams(FaultParams):
    """Parameters of `slow_cycle`."""

    periods: int = param("Additional control periods of a slow cycle", default=5, ge=1, le=1000)
    share: float = param("Share of the cycles that are slow", default=0.1, gt=0.0, le=1.0)


class SlowCycle(Effect[SlowCycleParams]):
    """Cycles overrun: the device holds on its own for some periods, whose samples nobody gets."""

    drives = True

    def drive(self, cycle: Cycle, command: Command) -> Observation:
        """See `Effect`."""
        observation = cycle(command)
        if self.context.rng.random() < self.params.share:
            self.actions.count += 1
            for _ in range(self.params.periods):
                observation = cycle(HOLD)
        return observation


class StaleData(Effect[FaultParams]):
    """The block before the fault is delivered repeatedly with its old stamps; the device continues."""

    def begin(self) -> None:
        """See `Effect`."""
        self._last = self.context.sensed

    def sense(self, observation: Observation) -> Observation:
        """See `Effect`."""
        return self._last


class RobotFaultParams(FaultParams):
    """Parameters of `robot_fault`."""

    message: str = param("Message of the controller", default="servo fault (injected)", max_length=200)


class RobotFault(Effect[RobotFaultParams]):
    """The robot's controller stops by itself: every robot call fails."""

    drives = True

    def drive(self, cycle: Cycle, command: Command) -> Observation:
        """See `Effect`."""
        self.refuse()
        return cycle(command)

    def refuse(self) -> None:
        """See `Effect`."""
        self.actions.count += 1
        raise BackendError(f"robot fault stop: {self.params.message}")


class IkFailure(Effect[FaultParams]):
    """The arm's own planner finds no solution: the device refuses a motion."""

    drives = True

    def drive(self, cycle: Cycle, command: Command) -> Observation:
        """See `Effect`."""
        if command.motion is None:
            return cycle(command)
        self.actions.count += 1
        raise MotionRefused("setpoint", "the controller found no joint solution (injected)")
