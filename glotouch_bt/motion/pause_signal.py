"""The pause signal: the runner writes it, the motions read it once a control period."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal

Style = Literal["hold", "retreat", "finish"]

RETREAT_M = 0.003
"""Distance of a retreat from a contact. Above the combined compliance of probe and pads, which is below 1 mm."""
RETREAT_M_S = 0.02
"""Maximum speed of a retreat and of the return to the contact."""


@dataclass
class PauseSignal:
    """State of a pause, shared by the runner and the motions.

    Attributes:
        requested: The operator or a rule requested a pause.
        style: Effect on the running skill: `hold` (brake on the path), `retreat` (a guarded motion also backs off),
            `finish` (complete the current motion first).
        handled: The current motion handles the pause: it brakes, backs off or stands still.
        standing: The current motion stands still.
    """

    requested: bool = False
    style: Style = "hold"
    handled: bool = False
    standing: bool = False
    _finishing: int = 0

    @property
    def stops(self) -> bool:
        """True if the current motion must stop now."""
        return self.requested and self.style != "finish" and not self._finishing

    @property
    def deferred(self) -> bool:
        """True while an uninterruptible section defers the pause."""
        return bool(self._finishing)

    @contextmanager
    def handling(self) -> Iterator[None]:
        """Mark the pause as handled by the current motion."""
        self.handled = True
        try:
            yield
        finally:
            self.handled = self.standing = False

    @contextmanager
    def finishing(self) -> Iterator[None]:
        """Defer every pause to the end of this section, whatever the skill's style."""
        self._finishing += 1
        try:
            yield
        finally:
            self._finishing -= 1
