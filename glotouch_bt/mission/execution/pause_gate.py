"""The gate between a tick and its cycle: while the mission is paused, what a skill commands waits until it may be sent.

A motion under way stops by itself (`motion.PauseSignal`) and goes on listening. Anything else waits here: a command the
arm would begin at rest is not sent, the arm holds, and nobody is ticked, so that no skill notices but for the clock.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from glotouch_bt.mission.execution.control import Control
from glotouch_bt.motion import Motion, PauseSignal, Style
from glotouch_bt.robot import HOLD, Command, Observation
from glotouch_bt.skill import Context

PAUSE, PAUSED, RESUMED = "pause", "paused", "resumed"
"""Events: asked for, the arm stands, going on."""


class PauseGate:
    """See the module's text.

    Args:
        control: Who asks for pauses.
        context: Of the run; `context.paused_s` is kept here.
        cycle: Sends one command and sets `context.observation`; raises what ends the run.
        paced: The robot's clock is the wall's.

    Attributes:
        pause_signal: What the arm's motions read.
    """

    def __init__(
        self, control: Control, context: Context, cycle: Callable[[Command], Observation], *, paced: bool = False
    ) -> None:
        self._control, self._context, self._cycle, self._paced = control, context, cycle, paced
        self.pause_signal = PauseSignal()
        context.arm.pause_signal = self.pause_signal
        self._standing = False
        self._looked_s = 0.0
        self._last = HOLD

    def look(self, ticks: int) -> None:
        """Before a tick: is a pause wanted?"""
        now_s = self._context.observation.now_s
        wanted = self._control.wants_pause(ticks, now_s)
        if wanted is not self.pause_signal.requested:
            self.pause_signal.requested = wanted
            self._event(PAUSE if wanted else RESUMED, now_s, tick=ticks)
            self._standing = False
        elif wanted and self.pause_signal.standing:
            if self._standing:
                self._context.paused_s += now_s - self._looked_s
            self._stands("on the way")
        if self._standing and not self._paced:
            self._control.rest(now_s - self._looked_s)
        self._looked_s = now_s

    def begins(self, style: Style) -> None:
        """A skill that declares this has begun."""
        self.pause_signal.style = style

    def send(self, command: Command, ticks: int) -> None:
        """Send a skill's command, when it may be sent."""
        if self.pause_signal.requested and self._holds_back():
            self._wait(ticks)
        self._cycle(command)
        self._last = command

    def _holds_back(self) -> bool:
        """The arm stands where the last motion ended, and nothing is under way that must be finished first."""
        motion = self._last.motion
        at_rest = motion is None or not (np.count_nonzero(motion.dq) or np.count_nonzero(motion.ddq))
        return at_rest and not self.pause_signal.handled and not self.pause_signal.deferred

    def _wait(self, ticks: int) -> None:
        """Hold until the pause is over."""
        context = self._context
        waiting = self._waiting(ticks)
        command = next(waiting)
        while True:
            before_s = context.observation.now_s
            observation = self._cycle(command)
            context.paused_s += observation.now_s - before_s
            try:
                command = waiting.send(observation)
            except StopIteration:
                return

    def _waiting(self, ticks: int) -> Motion[None]:
        arm, way = self._context.arm, None
        if self.pause_signal.style == "retreat":
            way = yield from arm.retreat()
        self._stands("backed off" if way else "at rest")
        while True:
            yield HOLD
            self.look(ticks)
            if not self.pause_signal.requested:
                break
        if way is not None:
            yield from arm.return_to_contact(way)

    def _stands(self, where: str) -> None:
        if not self._standing:
            self._standing = True
            self._event(PAUSED, self._context.observation.now_s, where=where, style=self.pause_signal.style)

    def _event(self, kind: str, stamp_s: float, **data: object) -> None:
        self._context.journal.event(kind, stamp_s, data)
