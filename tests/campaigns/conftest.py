"""Fixtures of the mission tests that the campaigns use."""

from tests.mission.conftest import found_in as found_in
