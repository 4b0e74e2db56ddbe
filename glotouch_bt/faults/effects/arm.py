"""Faults of the arm and its line: what it makes of a setpoint, and whether a cycle takes place at all."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from glotouch_bt.faults.effects.base import Cycle, Effect, FaultParams, Scene, param
from glotouch_bt.robot import HOLD, BackendError, BadInput, Command, MotionRefused, Observation, ParamError


class FollowingParams(FaultParams):
    """Parameters of `following_error`."""

    joint: int = param("Which joint, counted from the base, from 0", default=3, ge=0, le=31)
    offset_rad: float = param("It goes so far beside its setpoint", unit="rad", default=0.02, ge=-0.5, le=0.5)
    rise_s: float = param("The error grows to that within", unit="s", default=0.5, gt=0.0, le=60.0)


class FollowingError(Effect):
    """One joint goes beside its setpoint; what is measured is where it really is."""

    Params = FollowingParams
    params: FollowingParams

    def __init__(self, params: Any, scene: Scene) -> None:
        super().__init__(params, scene)
        if params.joint >= scene.description.dof:
            raise BadInput(f"joint {params.joint}: this arm has joints 0 to {scene.description.dof - 1}")
        self._joint = params.joint
        joint = scene.description.joints[self._joint]
        self._range = joint.lower_rad, joint.upper_rad

    def begin(self) -> None:
        """See `Effect`."""
        self._share = 0.0

    def command(self, command: Command) -> Command:
        """See `Effect`."""
        if command.motion is None:
            return command
        self._share = min(1.0, self._share + self.scene.period_s / self.params.rise_s)
        q = np.array(command.motion.q)
        q[self._joint] = np.clip(q[self._joint] + self._share * self.params.offset_rad, *self._range)
        return replace(command, motion=replace(command.motion, q=q))


class JointLimitParams(FaultParams):
    """Parameters of `joint_limit`."""

    margin_rad: float = param("How far the joints may go from where they are", unit="rad", default=0.05, gt=0.0, le=3.0)


class JointLimit(Effect):
    """The device refuses setpoints beyond a range that is narrower than its description says."""

    Params = JointLimitParams
    params: JointLimitParams

    def begin(self) -> None:
        """See `Effect`."""
        self._centre = np.array(self.scene.sensed.q[-1])

    def command(self, command: Command) -> Command:
        """See `Effect`."""
        if command.motion is None:
            return command
        away = np.abs(command.motion.q - self._centre)
        worst = int(away.argmax())
        if away[worst] > self.params.margin_rad:
            self.acts.times += 1
            joint = self.scene.description.joints[worst]
            rule = f"within {self.params.margin_rad:g} rad of {self._centre[worst]:.3f} rad (injected joint limit)"
            raise ParamError(f"command.motion.q[{joint.name}]", float(command.motion.q[worst]), rule)
        return command


class LostCycleParams(FaultParams):
    """Parameters of `lost_cycle`."""

    lost: float = param("Share of the commands that do not arrive", default=0.2, gt=0.0, le=1.0)


class LostCycle(Effect):
    """Commands get lost on the way: the device holds for that period."""

    Params = LostCycleParams
    params: LostCycleParams

    def command(self, command: Command) -> Command:
        """See `Effect`."""
        asks = command.motion is not None or command.gripper is not None
        return (
            replace(HOLD, tactile=command.tactile) if asks and self.scene.rng.random() < self.params.lost else command
        )


class SlowCycleParams(FaultParams):
    """Parameters of `slow_cycle`."""

    periods: int = param("A slow cycle takes so many control periods more", default=5, ge=1, le=1000)
    share: float = param("Share of the cycles that are slow", default=0.1, gt=0.0, le=1.0)


class SlowCycle(Effect):
    """Cycles overrun: the device holds on its own for some periods, whose samples nobody gets."""

    Params = SlowCycleParams
    params: SlowCycleParams
    drives = True

    def drive(self, cycle: Cycle, command: Command) -> Observation:
        """See `Effect`."""
        observation = cycle(command)
        if self.scene.rng.random() < self.params.share:
            self.acts.times += 1
            for _ in range(self.params.periods):
                observation = cycle(HOLD)
        return observation


class StaleData(Effect):
    """The block before the fault is delivered again and again, its stamps and all; the device goes on."""

    def begin(self) -> None:
        """See `Effect`."""
        self._last = self.scene.sensed

    def sense(self, observation: Observation) -> Observation:
        """See `Effect`."""
        return self._last


class RobotFaultParams(FaultParams):
    """Parameters of `robot_fault`."""

    message: str = param("What the controller says", default="servo fault (injected)")


class RobotFault(Effect):
    """The robot's controller stops by itself: this call of the seam and all after it fail."""

    Params = RobotFaultParams
    params: RobotFaultParams
    drives = True

    def drive(self, cycle: Cycle, command: Command) -> Observation:
        """See `Effect`."""
        self.refuse()
        return cycle(command)

    def refuse(self) -> None:
        """See `Effect`."""
        self.acts.times += 1
        raise BackendError(f"robot fault stop: {self.params.message}")


class IkFailure(Effect):
    """The arm's own planner finds no way: a motion is refused by the device."""

    drives = True

    def drive(self, cycle: Cycle, command: Command) -> Observation:
        """See `Effect`."""
        if command.motion is None:
            return cycle(command)
        self.acts.times += 1
        raise MotionRefused("setpoint", "the controller found no joint solution (injected)")
