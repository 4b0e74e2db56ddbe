"""Fixtures of the skills' and missions' tests that whole missions use too, and a block."""

from __future__ import annotations

from pathlib import Path

import pytest
import trimesh

from tests.mission.conftest import load, registry  # noqa: F401
from tests.skills.conftest import bench, found, things, tool, world  # noqa: F401

BLOCK_M = (0.05, 0.04, 0.06)
FIRST = "test_the_page_is_true"
"""The tutorial, one of the longest tests. If it began last, the other processes would wait for it."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the tutorial."""
    items.sort(key=lambda item: item.name != FIRST)


@pytest.fixture(scope="session")
def block(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with one object."""
    folder = tmp_path_factory.mktemp("block")
    trimesh.creation.box(BLOCK_M).export(folder / "block.stl")
    return folder
