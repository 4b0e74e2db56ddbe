"""Mutation testing of missions inside pytest: every slip is made in turn, and the tests that use the mission run again.

A mutant is refused (by `glotouch check`, so that nobody could run it), noticed (a test fails), or survives. A survivor
for which no random script shows a difference is held to be equivalent; the others are printed with such a script: the
test that is missing.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from glotouch_bt.mission import Mission
from glotouch_bt.mission_testing.mutation.mutants import Mutant, findings_of, mutants_of
from glotouch_bt.mission_testing.mutation.score import MutationScore, Survivor
from glotouch_bt.mission_testing.mutation.search import Search
from glotouch_bt.mission_testing.session import Session

Test = Callable[[], bool]
"""Runs one test again; True if it passes."""


def try_mutants(
    mission: Mission,
    session: Session,
    tests: Sequence[tuple[str, Test]],
    *,
    scripts: int = 300,
    on_progress: Callable[[int, int, MutationScore], None] | None = None,
) -> MutationScore:
    """Run the tests against every mutant of a mission.

    Args:
        mission: The mission as it is.
        session: Where the tests get their missions from; changed while a mutant is tried.
        tests: The tests that use it, by name; all pass on the mission as it is.
        scripts: Random scripts tried for each survivor; 0: none, all count as survivors.
        on_progress: Called after each mutant with (tried, of how many, score so far).
    """
    score, search = MutationScore(mission.name, scripts), Search(mission, scripts)
    bench = _Bench(mission.file.resolve(), session, dict(tests))
    mutants = list(mutants_of(mission.tree))
    for mutant in mutants:
        tree = mutant.apply(mission.tree)
        if findings_of(mission, tree):
            score.refused.append(mutant)
        elif (name := bench.notices(mutant)) is not None:
            score.noticed.append((mutant, name))
        elif (difference := search.difference(tree)) is not None or scripts == 0:
            score.survivors.append(Survivor(mutant, difference))
        else:
            score.equivalent.append(mutant)
        if on_progress is not None:
            on_progress(score.tried, len(mutants), score)
    return score


class _Bench:
    """Runs tests against mutants; those that notice much in little time go first."""

    def __init__(self, file: Path, session: Session, tests: Mapping[str, Test]) -> None:
        self._file, self._session, self._tests = file, session, tests
        self._noticed = dict.fromkeys(tests, 0)
        self._spent_s = dict.fromkeys(tests, 1e-3)

    def notices(self, mutant: Mutant) -> str | None:
        """The first test that fails, or None."""

        def change(loaded: Mission) -> Mission:
            return replace(loaded, tree=mutant.apply(loaded.tree)) if loaded.file.resolve() == self._file else loaded

        self._session.change = change
        try:
            return next((name for name in self._in_order() if not self._passes(name)), None)
        finally:
            self._session.change = None

    def _in_order(self) -> list[str]:
        def worth(name: str) -> float:
            return (self._noticed[name] + 1) / self._spent_s[name]

        return sorted(self._tests, key=worth, reverse=True)

    def _passes(self, name: str) -> bool:
        began = time.perf_counter()
        passed = self._tests[name]()
        self._spent_s[name] += time.perf_counter() - began
        self._noticed[name] += not passed
        return passed
