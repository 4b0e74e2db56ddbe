"""The pytest plugin (entry point `pytest11`). It imports nothing until a fixture or option is used.

Fixtures: `scripted` runs a mission with scripted leaves, `fake_robot` makes robots without physics,
`faulty` injects faults into them. Options: `--glotouch-coverage`, `--glotouch-coverage-min`.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from glotouch_bt.faults import FaultInjector
    from glotouch_bt.mission import Mission
    from glotouch_bt.mission_testing.outcomes import Script
    from glotouch_bt.mission_testing.scripted import ScriptedRun
    from glotouch_bt.mission_testing.session import Session
    from glotouch_bt.robot import FakeRobot, Robot

KEY: pytest.StashKey[Session] = pytest.StashKey()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the plugin's options."""
    group = parser.getgroup("glotouch", "missions (glotouch_bt)")
    group.addoption(
        "--glotouch-coverage",
        action="store_true",
        help="report which outcomes of each leaf the scripted missions exercised",
    )
    group.addoption(
        "--glotouch-coverage-min", type=float, metavar="PERCENT", help="report outcomes, and fail below this percentage"
    )


def session_of(config: pytest.Config) -> Session:
    """Return the state of this session."""
    if KEY not in config.stash:
        from glotouch_bt.mission_testing.session import Session

        config.stash[KEY] = Session(config.rootpath)
    return config.stash[KEY]


class Scripted:
    """The `scripted` fixture: call it to run a mission; `load` loads one.

    Args:
        session: State shared by all tests.
        here: The test's folder; relative paths start there.
    """

    def __init__(self, session: Session, here: Path) -> None:
        self._session, self._here = session, here

    def load(
        self,
        mission: str | Path,
        settings: Mapping[str, Any] | None = None,
        *,
        objects: Path | None = None,
        skills: Mapping[str, Any] | None = None,
    ) -> Mission:
        """Return a checked mission: a shipped name, or a path relative to the test's folder or a folder above it.

        Raises:
            MissionFaults: All findings.
        """
        return self._session.load(mission, settings or {}, objects, skills, self._here)

    def __call__(
        self,
        mission: str | Path | Mission,
        script: Script | None = None,
        *,
        settings: Mapping[str, Any] | None = None,
        robot: Robot | None = None,
        timeout_s: float | None = None,
    ) -> ScriptedRun:
        """Run a mission with its leaves scripted; leaves that the script does not name succeed at once.

        Args:
            mission: A shipped name, a path, or a loaded mission.
            script: Outcomes by node name, skill name, path or pattern: `{"squeeze*": fails("no_squeeze")}`.
            settings: Values of the mission's parameters.
            robot: An open robot (default: a FakeRobot whose clock skips waiting).
            timeout_s: Longest duration on the robot's clock (default: the mission's).

        Raises:
            MissionFaults: The mission does not pass the check.
            ScriptError: The script does not fit the mission.
        """
        from glotouch_bt.mission_testing.scripted import run_scripted

        loaded = self.load(mission, settings) if isinstance(mission, str | Path) else mission
        run = run_scripted(loaded, script, robot=robot, timeout_s=timeout_s)
        self._session.coverage.add(loaded, run)
        return run


@pytest.fixture
def scripted(request: pytest.FixtureRequest) -> Scripted:
    """Run missions with scripted leaves: `run = scripted("retrieve", {"squeeze": fails("no_squeeze")})`."""
    return Scripted(session_of(request.config), request.path.parent)


@pytest.fixture
def fake_robot() -> Iterator[Callable[..., FakeRobot]]:
    """Make robots without physics: `fake_robot(walls=[...])`; arguments of `FakeRobot`; closed after the test."""
    from glotouch_bt.robot import FakeRobot

    made: list[FakeRobot] = []

    def make(*args: Any, **kwargs: Any) -> FakeRobot:
        made.append(FakeRobot(*args, **kwargs))
        return made[-1]

    yield make
    for robot in made:
        robot.close()


@pytest.fixture
def faulty() -> Iterator[Callable[..., FaultInjector]]:
    """Inject faults into a robot: `faulty([{"fault": "wrench_bias", "with": {"force_N": [0, 0, 3]}}], fake_robot())`.

    The faults are those of a plan's `plan` (see `glotouch faults`), or the path of a plan. A fault that altered
    nothing by the end fails the test, because such a test proves nothing.
    """
    from glotouch_bt.mission_testing.faults import faulted, idle

    made: list[FaultInjector] = []

    def make(plan: Sequence[Mapping[str, Any]] | str | Path, robot: Robot, seed: int = 0) -> FaultInjector:
        made.append(faulted(plan, robot, seed))
        return made[-1]

    yield make
    for injector in made:
        if found := idle(injector):
            pytest.fail(f"altered nothing: {', '.join(found)}", pytrace=False)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Show what is wrong with a mission or a script, and the test's line, without a traceback through this package."""
    report = yield
    if report.failed and call.excinfo is not None:
        from glotouch_bt.errors import BadInput

        if isinstance(call.excinfo.value, BadInput) and _is_users_mistake(call.excinfo.value):
            lines = [entry.lineno + 1 for entry in call.excinfo.traceback if entry.path == item.path]
            report.longrepr = f"{item.path.name}:{lines[-1] if lines else 1}: {call.excinfo.exconly()}"
    return report


def _is_users_mistake(error: Exception) -> bool:
    from glotouch_bt.mission.spec import MissionFaults
    from glotouch_bt.mission_testing.casting import ScriptError

    return isinstance(error, MissionFaults | ScriptError)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Send a worker's coverage to the controller; check the required percentage."""
    config = session.config
    output = getattr(config, "workeroutput", None)
    if output is not None:
        output["glotouch_coverage"] = session_of(config).coverage.plain() if KEY in config.stash else {}
        return
    if session.exitstatus == 0 and _coverage_is_short(config):
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def _coverage_is_short(config: pytest.Config) -> bool:
    percent = config.getoption("--glotouch-coverage-min")
    return percent is not None and session_of(config).coverage.percent < percent


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any, error: object) -> None:
    """Merge the coverage of a finished pytest-xdist worker."""
    seen = getattr(node, "workeroutput", {}).get("glotouch_coverage")
    if seen:
        session_of(node.config).coverage.merge(seen)


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Print the coverage of outcomes."""
    percent = config.getoption("--glotouch-coverage-min")
    if not config.getoption("--glotouch-coverage") and percent is None:
        return
    coverage = session_of(config).coverage
    terminalreporter.section("glotouch: outcomes of leaves")
    for line in coverage.lines():
        terminalreporter.line(line)
    if not coverage.missions:
        terminalreporter.line("no mission was run with scripted leaves (fixture `scripted`)")
    if percent is not None:
        done, total = coverage.exercised()
        short = _coverage_is_short(config)
        text = f"{done} of {total} outcomes ({coverage.percent:.1f} %), at least {percent:g} % asked"
        terminalreporter.line(f"{'FAILED: ' if short else ''}{text}", red=short, green=not short)
