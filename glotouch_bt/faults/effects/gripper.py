"""Faults of the gripper: altered targets and altered reports."""

from __future__ import annotations

from dataclasses import replace

from glotouch_bt.faults.effects.base import Effect, FaultParams, param
from glotouch_bt.robot import Command, GripperTarget, Observation


class GripStall(Effect[FaultParams]):
    """The jaws do not move: targets are accepted and not executed."""

    def begin(self) -> None:
        """See `Effect`."""
        self._hold: GripperTarget | None = self._standing()

    def command(self, command: Command) -> Command:
        """See `Effect`."""
        if command.gripper is None and (self._hold is None or not self.context.sensed.gripper.moving):
            return command
        hold, self._hold = self._hold or self._standing(), None
        return replace(command, gripper=hold)

    def _standing(self) -> GripperTarget:
        hand, now = self.context.description.gripper, self.context.sensed.gripper
        aperture = min(max(now.aperture_m, 0.0), hand.stroke_m)
        return GripperTarget(aperture, hand.speed_m_s, min(max(now.force_N, 1.0), hand.force_N))


class GripShortParams(FaultParams):
    """Parameters of `grip_short`."""

    short_m: float = param("Distance of the jaws short of the target", unit="m", default=0.004, gt=0.0, le=0.08)
    min_m: float = param("Smallest aperture they reach", unit="m", default=0.0, ge=0.0, le=0.08)


class GripShort(Effect[GripShortParams]):
    """The jaws do not close completely."""

    def command(self, command: Command) -> Command:
        """See `Effect`."""
        asked = command.gripper
        if asked is None or asked.aperture_m >= self.context.sensed.gripper.aperture_m:
            return command
        stroke = self.context.description.gripper.stroke_m
        aperture = min(max(asked.aperture_m + self.params.short_m, self.params.min_m), stroke)
        return replace(command, gripper=replace(asked, aperture_m=aperture))


class GripSlipParams(FaultParams):
    """Parameters of `grip_slip`."""

    factor: float = param("Share of the commanded force that the jaws apply", default=0.1, gt=0.0, lt=1.0)


class GripSlip(Effect[GripSlipParams]):
    """The jaws apply a fraction of the commanded force and report the commanded force."""

    def begin(self) -> None:
        """See `Effect`."""
        self._commanded_N = 0.0

    def command(self, command: Command) -> Command:
        """See `Effect`."""
        if command.gripper is None:
            return command
        self._commanded_N = command.gripper.force_N
        force_N = max(0.2, self._commanded_N * self.params.factor)
        return replace(command, gripper=replace(command.gripper, force_N=force_N))

    def sense(self, observation: Observation) -> Observation:
        """See `Effect`."""
        state = observation.gripper
        if self._commanded_N == 0.0 or state.force_N < 0.1:
            return observation
        return replace(observation, gripper=replace(state, force_N=state.force_N / self.params.factor))


class GripMisreportParams(FaultParams):
    """Parameters of `grip_misreport`."""

    aperture_m: float = param("Added to the reported aperture", unit="m", default=0.004, ge=-0.08, le=0.08)


class GripMisreport(Effect[GripMisreportParams]):
    """The reported aperture has a constant error."""

    def sense(self, observation: Observation) -> Observation:
        """See `Effect`."""
        state = observation.gripper
        return replace(observation, gripper=replace(state, aperture_m=state.aperture_m + self.params.aperture_m))


class GripDropParams(FaultParams):
    """Parameters of `grip_drop`."""

    opening_m: float = param("Distance by which the jaws open", unit="m", default=0.02, gt=0.001, le=0.08)
    duration_s: float = param("Time until they close again", unit="s", default=0.4, gt=0.0, le=10.0)
    masked: bool = param("Report the state before the fault", default=False)


class GripDrop(Effect[GripDropParams]):
    """The jaws open briefly and close again, so that the probe or object they hold falls."""

    def begin(self) -> None:
        """See `Effect`."""
        hand, state = self.context.description.gripper, self.context.sensed.gripper
        self._before = state
        self._left = max(1, round(self.params.duration_s / self.context.period_s))
        force = min(max(state.force_N, 5.0), hand.force_N)
        self._open: GripperTarget | None = GripperTarget(
            min(state.aperture_m + self.params.opening_m, hand.stroke_m), hand.speed_m_s, force
        )
        self._shut: GripperTarget | None = GripperTarget(0.0, min(0.1, hand.speed_m_s), force)

    def command(self, command: Command) -> Command:
        """See `Effect`."""
        self._left -= 1
        if self._open is not None:
            target, self._open = self._open, None
            self.actions.count += 1
            return replace(command, gripper=target)
        if self._left <= 0 and self._shut is not None:
            target, self._shut = self._shut, None
            return command if command.gripper is not None else replace(command, gripper=target)
        return replace(command, gripper=None) if self._left > 0 and command.gripper is not None else command

    def sense(self, observation: Observation) -> Observation:
        """See `Effect`."""
        if not self.params.masked:
            return observation
        return replace(observation, gripper=replace(self._before, stamp_s=observation.gripper.stamp_s))
