"""The feed: whether motions go on, stop where they are along their path, or are stopped already.

One small value that the runner writes and the motions read, once a control period.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal

Style = Literal["hold", "retreat", "finish"]

BACK_OFF_M = 0.003
"""How far a `retreat` backs off: the probe bends and its pads give less than a millimetre at a touch."""
BACK_OFF_M_S = 0.02
"""Largest speed of backing off, and of coming back to the contact."""


@dataclass
class PauseSignal:
    """What a pause does to motions.

    Attributes:
        requested: A pause is asked for.
        style: What it does to the skill that runs: `hold`, `retreat` (a guarded motion also backs off), `finish` (the
            present motion is made to its end).
        handled: A motion under way takes care of the pause: it brakes, backs off or stands.
        standing: It stands.
    """

    requested: bool = False
    style: Style = "hold"
    handled: bool = False
    standing: bool = False
    _finishing: int = 0

    @property
    def stops(self) -> bool:
        """A motion under way must stop now."""
        return self.requested and self.style != "finish" and not self._finishing

    @property
    def deferred(self) -> bool:
        """A pause must wait for what is being finished."""
        return bool(self._finishing)

    @contextmanager
    def handling(self) -> Iterator[None]:
        """A motion takes care of the pause."""
        self.handled = True
        try:
            yield
        finally:
            self.handled = self.standing = False

    @contextmanager
    def finishing(self) -> Iterator[None]:
        """What is done inside is not interrupted by a pause, whatever the skill's style: the pause comes after it."""
        self._finishing += 1
        try:
            yield
        finally:
            self._finishing -= 1
