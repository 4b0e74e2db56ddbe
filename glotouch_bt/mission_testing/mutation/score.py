"""What came of the mutants of a mission."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from glotouch_bt.mission_testing.mutation.mutants import Mutant
from glotouch_bt.mission_testing.mutation.search import Difference


@dataclass(frozen=True)
class Survivor:
    """A mutant no test noticed.

    Attributes:
        mutant: What was changed.
        difference: A script that tells it from the mission; None: none was found.
    """

    mutant: Mutant
    difference: Difference | None


@dataclass
class MutationScore:
    """What came of all mutants of one mission.

    Attributes:
        mission: Its name.
        refused: By the checker.
        noticed: With the test that failed first.
        survivors: Those a script tells from the mission.
        equivalent: Those for which no difference was found.
        scripts: How many random scripts were tried for each survivor.
    """

    mission: str
    scripts: int
    refused: list[Mutant] = field(default_factory=list)
    noticed: list[tuple[Mutant, str]] = field(default_factory=list)
    survivors: list[Survivor] = field(default_factory=list)
    equivalent: list[Mutant] = field(default_factory=list)

    @property
    def tried(self) -> int:
        """Mutants so far."""
        return len(self.refused) + len(self.noticed) + len(self.survivors) + len(self.equivalent)

    @property
    def percent(self) -> float:
        """Share of noticed mutants among those that can run and behave differently."""
        counted = len(self.noticed) + len(self.survivors)
        return 100.0 * len(self.noticed) / counted if counted else 100.0

    @property
    def strict_percent(self) -> float:
        """The same with the equivalent ones counted as survivors."""
        counted = len(self.noticed) + len(self.survivors) + len(self.equivalent)
        return 100.0 * len(self.noticed) / counted if counted else 100.0

    def lines(self) -> Iterator[str]:
        """The report for a terminal."""
        yield f"{self.mission}: {self.tried} mutants"
        yield f"  refused by check  {len(self.refused):4d}"
        yield f"  noticed by tests  {len(self.noticed):4d}"
        yield f"  survive           {len(self.survivors):4d}"
        if self.scripts:
            yield f"  equivalent        {len(self.equivalent):4d}  (no difference in {self.scripts} random scripts)"
        yield (
            f"  score             {self.percent:.1f} % of those that run and differ"
            f" ({self.strict_percent:.1f} % with the equivalent ones)"
        )
        for survivor in self.survivors:
            yield ""
            yield f"{survivor.mutant.place}: {survivor.mutant.what}: no test notices"
            if survivor.difference is not None:
                yield f"  a test that would: scripted(..., {survivor.difference.script})"
                yield f"  they part {survivor.difference.where}"
                yield f"    the mission  {survivor.difference.before}"
                yield f"    the mutant   {survivor.difference.after}"
        for mutant in self.equivalent:
            yield f"{mutant.place}: {mutant.what}: equivalent"
