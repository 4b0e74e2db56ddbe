"""The made-up run that the tests of the report read."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import pytest

from glotouch_backends.rizon4 import RIZON4_XENSE
from tests.support.made_run import INTERIOR_M, OBJECTS, POSE_B_K, WANTED, Made, make_run


@pytest.fixture(scope="session")
def writer() -> SimpleNamespace:
    """The maker of runs and what the tests compare with."""
    return SimpleNamespace(make_run=make_run, OBJECTS=OBJECTS, WANTED=WANTED, INTERIOR_M=INTERIOR_M, POSE_B_K=POSE_B_K)


@pytest.fixture(scope="session")
def whole(tmp_path_factory: pytest.TempPathFactory, writer: SimpleNamespace) -> Made:
    """One run from start to end, made once."""
    make: Callable[..., Made] = writer.make_run
    return make(tmp_path_factory.mktemp("run"), description=RIZON4_XENSE)
