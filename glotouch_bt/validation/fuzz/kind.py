"""The base of fuzzers: a kind makes and tries random inputs. One file per kind, registered in `KINDS` (`campaign`)."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar, Literal

import numpy as np

from glotouch_bt.mission.spec import MissionFaults
from glotouch_bt.robot import BadInput

Class = Literal[
    "refused with places", "refused unread", "ran to success", "ran to failure", "ran on", "stopped by a fault",
    "checked only", "accepted", "traceback", "hang", "code run", "accepted wrongly", "process died",
]  # fmt: skip
BAD: tuple[Class, ...] = ("traceback", "hang", "code run", "accepted wrongly", "process died")
"""The classes that must not occur."""


class FuzzKind:
    """One kind of input.

    Attributes:
        name: Its name on the command line.
        description: One line for people.
        writes: Trying an input may write below its folder; anything else counts as "code run".
    """

    name: ClassVar[str]
    description: ClassVar[str]
    writes: ClassVar[bool] = False

    def prepare(self, folder: Path) -> None:
        """Put what all inputs share into the folder, before trials are watched."""

    def make(self, rng: np.random.Generator, folder: Path) -> str:
        """Write one input into the folder, over an earlier one; return its sort, under which results are counted."""
        raise NotImplementedError

    def attempt(self, sort: str, folder: Path, rng: np.random.Generator) -> tuple[Class, str]:
        """Use the input as a command would; return its class, and a detail for the bad ones.

        Whatever this raises, but for what it expects and classes itself, counts as "traceback".
        """
        raise NotImplementedError


def refused(error: BadInput) -> tuple[Class, str]:
    """Check that a refusal is readable and that every finding has a place."""
    words = str(error)
    if not words.strip() or "Traceback" in words:
        return "traceback", f"unreadable message: {words!r}"
    if not isinstance(error, MissionFaults):
        return "refused unread", ""
    if not error.findings or any(not f.what.strip() or not f.place.file for f in error.findings):
        return "traceback", f"findings without place or text: {error.findings!r}"
    return "refused with places", ""
