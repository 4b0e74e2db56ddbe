"""Fixtures of the skills' and missions' tests that whole missions use too."""

from tests.mission.conftest import load, registry  # noqa: F401
from tests.skills.conftest import bench, found, things, tool, world  # noqa: F401
