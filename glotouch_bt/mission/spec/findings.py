"""What a check found: every fault with its place, gathered and reported together."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from types import MappingProxyType
from typing import Literal

from glotouch_bt.mission.spec.explanations import WARNINGS, WHY
from glotouch_bt.mission.spec.source import Place
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
        path: Outcomes of leaves on the shortest run that shows it, the node it is about last; empty: no run is needed.
        node: Name of the node it is about, or empty.
    """

    place: Place
    code: str
    what: str
    valid: str = ""
    hint: str = ""
    path: tuple[str, ...] = ()
    node: str = ""

    @property
    def severity(self) -> Literal["error", "warning"]:
        """A warning leaves the mission as it is: it may be meant so."""
        return "warning" if self.code in WARNINGS else "error"

    @property
    def why(self) -> str:
        """Why it matters, or empty."""
        return WHY.get(self.code, "")

    def __str__(self) -> str:
        hint = f"; did you mean {self.hint!r}?" if self.hint else ""
        valid = f" (valid: {self.valid})" if self.valid else ""
        path = f" [{' > '.join(self.path)}]" if len(self.path) > 1 else ""
        return f"{self.place}: {self.what}{hint}{valid}{path}"

    def as_dict(self) -> dict[str, object]:
        """For --json."""
        return {
            **asdict(self.place),
            "severity": self.severity,
            "code": self.code,
            "what": self.what,
            "why": self.why,
            "valid": self.valid,
            "hint": self.hint,
            "path": list(self.path),
            "node": self.node,
        }


NO_NAMES: Mapping[str, str] = MappingProxyType({})


class Findings:
    """A growing, duplicate-free list of faults."""

    def __init__(self) -> None:
        self._found: dict[Finding, None] = {}

    def add(
        self,
        place: Place,
        code: str,
        what: str,
        *,
        valid: str = "",
        hint: str = "",
        path: tuple[str, ...] = (),
        node: str = "",
    ) -> None:
        """Note one fault."""
        self._found[Finding(place, code, what, valid, hint, path, node)] = None

    @staticmethod
    def nearest(name: str, valid: Iterable[str]) -> str:
        """The valid name that is most like another, or empty."""
        plain = {_plain(v): v for v in sorted(valid, reverse=True)}
        near = difflib.get_close_matches(_plain(name), sorted(plain), n=1)
        return plain[near[0]] if near else ""

    @staticmethod
    def near(name: str, valid: Iterable[str], most: int = 12) -> list[str]:
        """The valid names, if they are many those that are most like another, in order of the alphabet."""
        names = sorted(valid)
        return names if len(names) <= most else sorted(difflib.get_close_matches(name, names, n=most, cutoff=0.0))

    def unknown(
        self, place: Place, code: str, kind: str, name: str, valid: Iterable[str], also: Mapping[str, str] = NO_NAMES
    ) -> str:
        """Note a name nobody knows; returns the nearest valid one or an empty string.

        `also`: what others call some of the valid ones.
        """
        names = sorted(valid)
        nearest = self.nearest(name, [*names, *also])
        hint = also.get(nearest, nearest)
        self._found[Finding(place, code, f"unknown {kind} {name!r}", ", ".join(names) or "none", hint)] = None
        return hint

    def sorted(self) -> list[Finding]:
        """All faults and warnings by file, line and column."""
        return sorted(self._found)

    @property
    def errors(self) -> list[Finding]:
        """The faults, by place."""
        return [f for f in self.sorted() if f.severity == "error"]

    @property
    def warnings(self) -> list[Finding]:
        """What may be meant as it is, by place."""
        return [f for f in self.sorted() if f.severity == "warning"]

    def __len__(self) -> int:
        """How many faults."""
        return sum(f.severity == "error" for f in self._found)


def _plain(name: str) -> str:
    """A name without what is easily mistaken: capitals and separators."""
    return re.sub("[-_ .]", "", name).lower() or name


class MissionFaults(BadInput):
    """Everything that is wrong with a mission, in one report.

    Attributes:
        findings: All faults, sorted by place.
        warnings: What may be meant as it is.
    """

    def __init__(self, findings: list[Finding], warnings: Sequence[Finding] = ()) -> None:
        super().__init__("\n".join(str(f) for f in findings))
        self.findings, self.warnings = findings, list(warnings)
