"""Fixtures of all tests."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from glotouch_bt.mission import load_mission
from glotouch_bt.mission.spec import Finding, MissionFaults


@pytest.fixture
def found_in(tmp_path: Path) -> Callable[..., list[Finding]]:
    """What reading a mission's text finds, its warnings too; keywords: settings."""

    def found(text: str, **settings: str) -> list[Finding]:
        path = tmp_path / "m.yaml"
        path.write_text(text)
        try:
            return list(load_mission(path, settings).warnings)
        except MissionFaults as e:
            return [*e.findings, *e.warnings]

    return found
