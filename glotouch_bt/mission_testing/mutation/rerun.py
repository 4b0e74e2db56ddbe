"""Running tests of a finished pytest session again, against mutants."""

from __future__ import annotations

from functools import partial
from typing import Any

import pytest
from _pytest.runner import runtestprotocol

from glotouch_bt.mission_testing.mutation.pytest_mutation import try_mutants
from glotouch_bt.mission_testing.mutation.score import MutationScore
from glotouch_bt.mission_testing.session import Session


def mutate(pytest_session: pytest.Session, session: Session, given: str) -> None:
    """Try the mutants of one mission; the score is left in the session.

    Raises:
        UsageError: The mission cannot be loaded.
    """
    from glotouch_bt.robot import BadInput

    try:
        path = session.find(given)
        mission = session.load(path, {}, None, None, path.parent, "")
    except BadInput as e:
        raise pytest.UsageError(f"--glotouch-mutate {given}: {e}") from e
    users = session.users.get(path.resolve(), {})
    items = [i for i in pytest_session.items if i.nodeid in users]
    if not items:
        session.mutation_lines.append(f"{given}: no test of this session loads it with the fixture `scripted`")
        return
    progress = _Progress(pytest_session.config)
    tests = [(i.nodeid, partial(_passes, i)) for i in items]
    scripts = pytest_session.config.getoption("--glotouch-search")
    score = try_mutants(mission, session, tests, scripts=scripts, on_progress=progress)
    progress.end()
    session.scores.append(score)
    session.mutation_lines += [*score.lines(), ""]


def _passes(item: Any) -> bool:
    """Set up, call and tear down once more, from nothing; a skip passes."""
    item._initrequest()
    return not any(report.failed for report in runtestprotocol(item, log=False, nextitem=None))


class _Progress:
    """One line that is rewritten on a terminal; a line every tenth otherwise."""

    def __init__(self, config: pytest.Config) -> None:
        self._writer = config.get_terminal_writer()
        self._tenth = -1
        self._writer.line("")

    def __call__(self, tried: int, of: int, score: MutationScore) -> None:
        words = f"{score.mission}: mutant {tried} of {of}, {len(score.noticed)} noticed, {len(score.survivors)} survive"
        if self._writer.hasmarkup:
            self._writer.write(f"\r{words}", flush=True)
        elif tried * 10 // of != self._tenth:
            self._tenth = tried * 10 // of
            self._writer.line(words)

    def end(self) -> None:
        """Leave the line."""
        if self._writer.hasmarkup:
            self._writer.line("")
