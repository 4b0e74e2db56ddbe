"""The findings of a check: every fault and warning with its place, gathered and reported together."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from types import MappingProxyType
from typing import Literal

from glotouch_bt.mission.spec.finding_kinds import FINDING_KINDS, FindingKind
from glotouch_bt.mission.spec.source import Place
from glotouch_bt.robot import BadInput


@dataclass(frozen=True, order=True)
class Finding:
    """One fault or warning.

    Attributes:
        place: Where it stands.
        code: Short stable word, for programs (``unknown_skill``, ``port_unset`` ...); a key of `FINDING_KINDS`.
        what: What is wrong, for a person.
        valid: What would be right, or empty.
        hint: The nearest valid name, or empty.
        path: Outcomes of leaves on the shortest run that shows it, then the node it is about; empty: no run is needed.
        node: Name of the node it is about, or empty.
    """

    place: Place
    code: str
    what: str
    valid: str = ""
    hint: str = ""
    path: tuple[str, ...] = ()
    node: str = ""

    def __post_init__(self) -> None:
        if self.code not in FINDING_KINDS:
            raise ValueError(f"finding {self.code!r} is not declared in mission/spec/finding_kinds.py")

    @property
    def kind(self) -> FindingKind:
        """Its declaration."""
        return FINDING_KINDS[self.code]

    @property
    def severity(self) -> Literal["error", "warning"]:
        """A mission with an error is not run; a warning may be intended."""
        return self.kind.severity

    def __str__(self) -> str:
        hint = f"; did you mean {self.hint!r}?" if self.hint else ""
        valid = f" (valid: {self.valid})" if self.valid else ""
        path = f" [{' > '.join(self.path)}]" if len(self.path) > 1 else ""
        return f"{self.place}: {self.what}{hint}{valid}{path}"

    def as_dict(self) -> dict[str, object]:
        """Return it as plain data, for --json."""
        return {
            **asdict(self.place),
            "severity": self.severity,
            "code": self.code,
            "what": self.what,
            "why": self.kind.why,
            "advice": self.kind.advice,
            "valid": self.valid,
            "hint": self.hint,
            "path": list(self.path),
            "node": self.node,
        }


NO_NAMES: Mapping[str, str] = MappingProxyType({})


class Findings:
    """A growing list of findings without duplicates."""

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
        """Note one finding; the arguments are the fields of `Finding`.

        Raises:
            ValueError: The code is not declared.
        """
        self._found[Finding(place, code, what, valid, hint, path, node)] = None

    @staticmethod
    def nearest(name: str, valid: Iterable[str]) -> str:
        """Return the valid name that is most like another name, or empty."""
        plain = {_plain(v): v for v in sorted(valid, reverse=True)}
        near = difflib.get_close_matches(_plain(name), sorted(plain), n=1)
        return plain[near[0]] if near else ""

    @staticmethod
    def listed(name: str, valid: Iterable[str], max_names: int = 12) -> str:
        """Return the valid names in alphabetical order; of many, those that are most like `name`, and how many more."""
        names = sorted(valid)
        if len(names) <= max_names:
            return ", ".join(names)
        near = sorted(difflib.get_close_matches(name, names, n=max_names, cutoff=0.0))
        return f"{', '.join(near)} and {len(names) - len(near)} more"

    def unknown(
        self, place: Place, code: str, kind: str, name: str, valid: Iterable[str], also: Mapping[str, str] = NO_NAMES
    ) -> str:
        """Note an unknown name; return the nearest valid one or an empty string.

        `also`: other words for some of the valid names.
        """
        names = sorted(valid)
        nearest = self.nearest(name, [*names, *also])
        hint = also.get(nearest, nearest)
        self.add(place, code, f"unknown {kind} {name!r}", valid=self.listed(name, names) or "none", hint=hint)
        return hint

    def sorted(self) -> list[Finding]:
        """Return all findings by file, line and column."""
        return sorted(self._found)

    @property
    def errors(self) -> list[Finding]:
        """The errors, by place."""
        return [f for f in self.sorted() if f.severity == "error"]

    @property
    def warnings(self) -> list[Finding]:
        """The warnings, by place."""
        return [f for f in self.sorted() if f.severity == "warning"]

    def __len__(self) -> int:
        """Return the number of errors."""
        return sum(f.severity == "error" for f in self._found)


def _plain(name: str) -> str:
    """Return a name without capitals and separators, which are easily mistaken."""
    return re.sub("[-_ .]", "", name).lower() or name


class MissionFaults(BadInput):
    """Everything that is wrong with a mission, in one report.

    Attributes:
        findings: All errors, by place.
        warnings: All warnings, by place.
    """

    def __init__(self, findings: list[Finding], warnings: Sequence[Finding] = ()) -> None:
        super().__init__("\n".join(f"{f}; {f.kind.advice}" if f.kind.advice else str(f) for f in findings))
        self.findings, self.warnings = findings, list(warnings)
