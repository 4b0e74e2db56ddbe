"""What a check found: every fault with its place, gathered and reported together."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import asdict, dataclass

from glotouch_bt.mission.source import Place
from glotouch_bt.robot import BadInput


@dataclass(frozen=True, order=True)
class Finding:
    """One fault.

    Attributes:
        place: Where it stands.
        code: Short stable word, for programs (``unknown_skill``, ``port_unset`` ...).
        what: What is wrong, for a person.
        valid: What would be right, or empty.
        hint: The nearest valid name, or empty.
    """

    place: Place
    code: str
    what: str
    valid: str = ""
    hint: str = ""

    def __str__(self) -> str:
        hint = f"; did you mean {self.hint!r}?" if self.hint else ""
        valid = f" (valid: {self.valid})" if self.valid else ""
        return f"{self.place}: {self.what}{hint}{valid}"

    def as_dict(self) -> dict[str, object]:
        """For --json."""
        return {**asdict(self.place), "code": self.code, "what": self.what, "valid": self.valid, "hint": self.hint}


class Findings:
    """A growing, duplicate-free list of faults."""

    def __init__(self) -> None:
        self._found: dict[Finding, None] = {}

    def add(self, place: Place, code: str, what: str, *, valid: str = "") -> None:
        """Note one fault."""
        self._found[Finding(place, code, what, valid)] = None

    def unknown(self, place: Place, code: str, kind: str, name: str, valid: Iterable[str]) -> str:
        """Note a name nobody knows; returns the nearest valid one or an empty string."""
        names = sorted(valid)
        near = difflib.get_close_matches(name, names, n=1)
        hint = near[0] if near else ""
        self._found[Finding(place, code, f"unknown {kind} {name!r}", ", ".join(names) or "none", hint)] = None
        return hint

    def sorted(self) -> list[Finding]:
        """All faults by file, line and column."""
        return sorted(self._found)

    def __len__(self) -> int:
        return len(self._found)


class MissionFaults(BadInput):
    """Everything that is wrong with a mission, in one report.

    Attributes:
        findings: All faults, sorted by place.
    """

    def __init__(self, findings: list[Finding]) -> None:
        super().__init__("\n".join(str(f) for f in findings))
        self.findings = findings
