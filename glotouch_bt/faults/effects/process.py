"""Faults of the process that runs the mission."""

from __future__ import annotations

import os
import signal
import threading

from glotouch_bt.faults.effects.base import Cycle, Effect, FaultParams, param
from glotouch_bt.robot import BadInput, Command, Observation


class DriverException(Effect[FaultParams]):
    """The driver raises an undocumented error."""

    drives = True

    def drive(self, cycle: Cycle, command: Command) -> Observation:
        """See `Effect`."""
        self.refuse()
        return cycle(command)

    def refuse(self) -> None:
        """See `Effect`."""
        self.actions.count += 1
        raise RuntimeError("the driver broke (injected exception)")


class HangParams(FaultParams):
    """Parameters of `hang`."""

    wall_s: float = param("Wall time for which one cycle blocks", unit="s", default=2.0, gt=0.0, le=600.0)


class Hang(Effect[HangParams]):
    """One cycle blocks for a while."""

    drives = True

    def begin(self) -> None:
        """See `Effect`."""
        self._slept = False

    def drive(self, cycle: Cycle, command: Command) -> Observation:
        """See `Effect`."""
        if not self._slept:
            self._slept = True
            self.actions.count += 1
            threading.Event().wait(self.params.wall_s)  # block this thread, as a blocking call does
        return cycle(command)


class Kill(Effect[FaultParams]):
    """The process is killed (SIGKILL), as in a power failure; only if it runs nothing but this mission."""

    drives = True

    def prepare(self) -> None:
        """See `Effect`.

        Raises:
            BadInput: This process does more than run the mission.
        """
        if not self.context.may_kill:
            raise BadInput("fault kill: the process does more than run this mission; use `glotouch run --faults`")

    def drive(self, cycle: Cycle, command: Command) -> Observation:
        """See `Effect`."""
        self.actions.count += 1
        os.kill(os.getpid(), signal.SIGKILL)
        return cycle(command)
