"""The plugin as a third party meets it: a folder with a mission and tests, and pytest."""

from __future__ import annotations

from pathlib import Path

import pytest

import glotouch_bt.mission_testing.scripted  # noqa: F401  loaded before pytester, which unloads what it loads
from glotouch_bt.mission.read.library import SkillRegistry

dict(SkillRegistry())
pytest_plugins = ["pytester"]

MISSION = """
mission: put_back
world: container_five
tree:
  sequence:
    - tool_pickup
    - retry: {attempts: 2, do: tool_return}
"""

WEAK = """
def test_it_ends_well(scripted):
    assert scripted("missions/put_back.yaml").succeeded
"""

STRONG = """
import pytest
from glotouch_bt.mission_testing import fails, ok

def test_it_ends_well(scripted):
    run = scripted("missions/put_back.yaml")
    assert run.succeeded and run.order == ["tool_pickup", "tool_return"]

@pytest.mark.parametrize("code", ["request_failed", "motion_refused"])
def test_it_is_put_back_twice_at_most(scripted, code):
    run = scripted("missions/put_back.yaml", {"tool_return": fails(code)})
    assert run.failed_with(code) and run.ran("tool_return") == 2

def test_without_a_probe_there_is_nothing_to_put_back(scripted):
    run = scripted("missions/put_back.yaml", {"tool_pickup": fails("no_probe")})
    assert run.failed_with("no_probe") and run.never_ran("tool_return")
"""


@pytest.fixture
def folder(pytester: pytest.Pytester) -> pytest.Pytester:
    """A user's project."""
    (pytester.path / "missions").mkdir()
    (pytester.path / "missions/put_back.yaml").write_text(MISSION)
    pytester.makeini("[pytest]\naddopts = -p no:cacheprovider\n")
    return pytester


def test_outcomes_are_counted_and_too_few_fail(folder: pytest.Pytester) -> None:
    folder.makepyfile(WEAK)
    done = folder.runpytest_inprocess("--glotouch-coverage-min", "80")
    done.assert_outcomes(passed=1)
    said = ["missions/put_back.yaml: 2 of * outcomes exercised*", "*tool_return*failure 0/*missing:*"]
    done.stdout.fnmatch_lines([*said, "FAILED: 2 of *at least 80 % asked"])
    assert done.ret == pytest.ExitCode.TESTS_FAILED


def test_without_options_nothing_is_said(folder: pytest.Pytester) -> None:
    folder.makepyfile(WEAK)
    done = folder.runpytest_inprocess()
    assert "glotouch:" not in done.stdout.str()
    assert done.ret == 0


@pytest.mark.study
def test_workers_send_what_they_have_seen(folder: pytest.Pytester) -> None:
    folder.makepyfile(STRONG)
    one = folder.runpytest_inprocess("--glotouch-coverage").stdout.str()
    two = folder.runpytest_subprocess("--glotouch-coverage", "-n", "2").stdout.str()
    line = "missions/put_back.yaml: "
    said = [next(text for text in out.splitlines() if text.startswith(line)) for out in (one, two)]
    assert said[0] == said[1]


def test_a_mission_is_found_beside_the_test_too(folder: pytest.Pytester) -> None:
    (folder.path / "deep").mkdir()
    (folder.path / "deep/test_it.py").write_text(WEAK.replace("missions/put_back", "mine"))
    (folder.path / "deep/mine.yaml").write_text(MISSION)
    folder.runpytest_inprocess("deep").assert_outcomes(passed=1)


def test_a_mission_is_found_above_the_test(folder: pytest.Pytester) -> None:
    """pytest is started in a folder above the package whose missions its tests name."""
    tests, missions = folder.path / "package/tests/deep", folder.path / "package/missions"
    tests.mkdir(parents=True)
    missions.mkdir()
    (missions / "mine.yaml").write_text(MISSION)
    (tests / "test_it.py").write_text(WEAK.replace("missions/put_back", "missions/mine"))
    folder.runpytest_inprocess("package").assert_outcomes(passed=1)


def test_a_mission_that_does_not_pass_the_check_fails_its_test(folder: pytest.Pytester) -> None:
    Path(folder.path / "missions/put_back.yaml").write_text(MISSION.replace("tool_return", "tool_retrun"))
    folder.makepyfile(WEAK)
    done = folder.runpytest_inprocess()
    done.assert_outcomes(failed=1)
    done.stdout.fnmatch_lines(["test_*.py:2: *MissionFaults: *did you mean 'tool_return'*"])
    assert "Traceback" not in done.stdout.str()
    assert "casting.py" not in done.stdout.str()
