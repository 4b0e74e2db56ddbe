"""The made-up run that the tests of the view read, and a server that only notes what it is told."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.made_run import Made, make_run


@pytest.fixture(scope="session")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Made:
    """One run from start to end, made once."""
    return make_run(tmp_path_factory.mktemp("run"))


@pytest.fixture
def cut(tmp_path: Path) -> Made:
    """A run that ended after its first contact."""
    return make_run(tmp_path / "cut", until="sweep")
