"""Fixtures of all tests."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from glotouch_bt.lazy import load_all
from glotouch_bt.mission import load_mission
from glotouch_bt.mission.spec import Finding, MissionFaults
from glotouch_bt.validation.seeded_mistakes.bench import alarms


@pytest.fixture(scope="session", autouse=True)
def interruptible() -> Iterator[None]:
    """Let programs that tests start obey SIGINT: a shell without job control ignores it in what it starts with `&`."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="session", autouse=True)
def compiled_functions() -> None:
    """Load Numba and the machine code first: within a property's first example they would exceed its deadline."""
    load_all()


@pytest.fixture
def found_in(tmp_path: Path) -> Callable[..., list[Finding]]:
    """Return the findings of a mission's text, without unwritten optional inputs unless `every`; keywords: settings."""

    def found(text: str, *, every: bool = False, **settings: str) -> list[Finding]:
        path = tmp_path / "m.yaml"
        path.write_text(text)
        try:
            made = list(load_mission(path, settings).warnings)
        except MissionFaults as e:
            made = [*e.findings, *e.warnings]
        return made if every else alarms(made)

    return found
