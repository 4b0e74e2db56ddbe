"""The pause gate between a tick and its control cycle: it delays a skill's command while the mission is paused.

A motion in progress stops itself (`motion.PauseSignal`). Every other command, which starts from rest, waits here: the
arm holds and the tree is not ticked, so a skill sees no difference except the clock.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from glotouch_bt.mission.execution.control import Control
from glotouch_bt.motion import Motion, PauseSignal
from glotouch_bt.robot import HOLD, Command, Observation
from glotouch_bt.skill import Context

PAUSE, PAUSED, RESUMED = "pause", "paused", "resumed"
"""Event kinds: a pause was requested; the arm stands; the mission continues."""


class PauseGate:
    """Hold back commands during a pause and record pause events.

    Args:
        control: Source of pause requests.
        context: Context of the run; `context.paused_s` is updated here.
        cycle: Sends one command and sets `context.observation`; may raise to end the run.
        paced: The robot clock is the wall clock.

    Attributes:
        pause_signal: The request as the arm's motions read it.
    """

    def __init__(
        self, control: Control, context: Context, cycle: Callable[[Command], Observation], *, paced: bool = False
    ) -> None:
        self._control, self._context, self._cycle, self._paced = control, context, cycle, paced
        self.pause_signal = PauseSignal()
        context.arm.pause_signal = self.pause_signal
        self._standing = False
        self._updated_s = 0.0
        self._last = HOLD

    def update(self, ticks: int) -> None:
        """Ask for a pause request; call before each tick."""
        now_s = self._context.observation.now_s
        wanted = self._control.wants_pause(ticks, now_s)
        if wanted is not self.pause_signal.requested:
            self.pause_signal.requested = wanted
            self._event(PAUSE if wanted else RESUMED, now_s, tick=ticks)
            self._standing = False
        elif wanted and self.pause_signal.standing:
            if self._standing:
                self._context.paused_s += now_s - self._updated_s
            self._record_standing("on the way")
        if self._standing and not self._paced:
            self._control.rest(now_s - self._updated_s)
        self._updated_s = now_s

    def send(self, command: Command, ticks: int) -> None:
        """Send a skill's command, after a pause if one is due now."""
        if self.pause_signal.requested and self._can_pause_here():
            self._hold_until_resumed(ticks)
        self._cycle(command)
        self._last = command

    def _can_pause_here(self) -> bool:
        """Return True if the arm is at rest and no motion handles or defers the pause."""
        motion = self._last.motion
        at_rest = motion is None or not (np.count_nonzero(motion.dq) or np.count_nonzero(motion.ddq))
        return at_rest and not self.pause_signal.handled and not self.pause_signal.deferred

    def _hold_until_resumed(self, ticks: int) -> None:
        context = self._context
        pause = self._pause_motion(ticks)
        command = next(pause)
        while True:
            before_s = context.observation.now_s
            observation = self._cycle(command)
            context.paused_s += observation.now_s - before_s
            try:
                command = pause.send(observation)
            except StopIteration:
                return

    def _pause_motion(self, ticks: int) -> Motion[None]:
        arm, way = self._context.arm, None
        if self.pause_signal.style == "retreat":
            way = yield from arm.retreat()
        self._record_standing("backed off" if way else "at rest")
        while True:
            yield HOLD
            self.update(ticks)
            if not self.pause_signal.requested:
                break
        if way is not None:
            yield from arm.return_to_contact(way)

    def _record_standing(self, where: str) -> None:
        if not self._standing:
            self._standing = True
            self._event(PAUSED, self._context.observation.now_s, where=where, style=self.pause_signal.style)

    def _event(self, kind: str, stamp_s: float, **data: object) -> None:
        self._context.journal.event(kind, stamp_s, data)
