"""Faults of the jaws: what they do of what they are told, and what they say about it."""

from __future__ import annotations

from dataclasses import replace

from glotouch_bt.faults.effects.base import Effect, FaultParams, param
from glotouch_bt.robot import Command, GripperTarget, Observation


class Stall(Effect):
    """The jaws stand: targets are taken and not carried out. Told again when the fault ends."""

    def begin(self) -> None:
        """See `Effect`."""
        self._hold: GripperTarget | None = self._standing()
        self._missed: GripperTarget | None = None

    def command(self, command: Command) -> Command:
        """See `Effect`."""
        if command.gripper is not None:
            self._missed = command.gripper
            hold, self._hold = self._hold or self._standing(), None
            return replace(command, gripper=hold)
        if self._hold is not None and self.scene.sensed.gripper.moving:
            hold, self._hold = self._hold, None
            return replace(command, gripper=hold)
        return command

    def _standing(self) -> GripperTarget:
        hand, now = self.scene.description.gripper, self.scene.sensed.gripper
        aperture = min(max(now.aperture_m, 0.0), hand.stroke_m)
        return GripperTarget(aperture, hand.speed_m_s, min(max(now.force_N, 1.0), hand.force_N))


class ShortParams(FaultParams):
    """Parameters of `grip_short`."""

    short_m: float = param("The jaws stop so far before what they are told", unit="m", default=0.004, gt=0.0, le=0.08)
    min_m: float = param(
        "and never close farther than this", unit="m", default=0.0, ge=0.0, le=0.08, formerly="least_m"
    )


class Short(Effect):
    """The jaws do not close all the way."""

    Params = ShortParams
    params: ShortParams

    def command(self, command: Command) -> Command:
        """See `Effect`."""
        asked = command.gripper
        if asked is None or asked.aperture_m >= self.scene.sensed.gripper.aperture_m:
            return command
        stroke = self.scene.description.gripper.stroke_m
        aperture = min(max(asked.aperture_m + self.params.short_m, self.params.min_m), stroke)
        return replace(command, gripper=replace(asked, aperture_m=aperture))


class SlipParams(FaultParams):
    """Parameters of `grip_slip`."""

    factor: float = param("Share of the told force that the jaws really press with", default=0.1, gt=0.0, lt=1.0)


class Slip(Effect):
    """The jaws press with a part of the force they are told, and report the force they were told."""

    Params = SlipParams
    params: SlipParams

    def begin(self) -> None:
        """See `Effect`."""
        self._told = 0.0

    def command(self, command: Command) -> Command:
        """See `Effect`."""
        if command.gripper is None:
            return command
        self._told = command.gripper.force_N
        return replace(command, gripper=replace(command.gripper, force_N=max(0.2, self._told * self.params.factor)))

    def sense(self, observation: Observation) -> Observation:
        """See `Effect`."""
        state = observation.gripper
        if self._told == 0.0 or state.force_N < 0.1:
            return observation
        return replace(observation, gripper=replace(state, force_N=state.force_N / self.params.factor))


class MisreportParams(FaultParams):
    """Parameters of `grip_misreport`."""

    aperture_m: float = param("Added to the reported aperture", unit="m", default=0.004, ge=-0.08, le=0.08)


class Misreport(Effect):
    """The reported aperture is wrong by a constant."""

    Params = MisreportParams
    params: MisreportParams

    def sense(self, observation: Observation) -> Observation:
        """See `Effect`."""
        state = observation.gripper
        return replace(observation, gripper=replace(state, aperture_m=state.aperture_m + self.params.aperture_m))


class DropParams(FaultParams):
    """Parameters of `grip_drop`."""

    opening_m: float = param("How far the jaws open", unit="m", default=0.02, gt=0.001, le=0.08)
    duration_s: float = param("before they close again", unit="s", default=0.4, gt=0.0, le=10.0)
    masked: bool = param("The reports go on as if nothing had happened", default=False)


class Drop(Effect):
    """The jaws open for a moment and close again: what they held, the probe or an object, falls."""

    Params = DropParams
    params: DropParams

    def begin(self) -> None:
        """See `Effect`."""
        hand, state = self.scene.description.gripper, self.scene.sensed.gripper
        self._before = state
        self._left = max(1, round(self.params.duration_s / self.scene.period_s))
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
            self.acts.times += 1
            return replace(command, gripper=target)
        if self._left <= 0 and self._shut is not None:
            target, self._shut = self._shut, None
            return command if command.gripper is not None else replace(command, gripper=target)
        return replace(command, gripper=None) if self._left > 0 and command.gripper is not None else command

    def sense(self, observation: Observation) -> Observation:
        """See `Effect`."""
        if not self.params.masked:
            return observation
        state = observation.gripper
        before = self._before
        return replace(
            observation,
            gripper=replace(state, aperture_m=before.aperture_m, force_N=before.force_N, moving=before.moving),
        )
