"""The pytest plugin: comes with the package (entry point `pytest11`), costs nothing until a fixture or option is used.

Fixtures: `scripted` runs a mission with scripted leaves, `load` loads one, `fake_robot` makes robots without physics,
`faulty` puts faults round them. Options: `--glotouch-coverage`, `--glotouch-coverage-min`, `--glotouch-mutate`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
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
    """The plugin's options."""
    group = parser.getgroup("glotouch", "missions (glotouch_bt)")
    group.addoption(
        "--glotouch-coverage",
        action="store_true",
        help="say which outcomes of each leaf of the scripted missions were exercised",
    )
    group.addoption(
        "--glotouch-coverage-min", type=float, metavar="PERCENT", help="fail if fewer of them were; prints them too"
    )
    group.addoption(
        "--glotouch-mutate",
        action="append",
        default=[],
        metavar="MISSION",
        help="after the tests, change this mission in every way a slip would, and see that a test fails each time",
    )
    group.addoption(
        "--glotouch-mutate-min", type=float, metavar="PERCENT", help="fail if fewer mutants than this are noticed"
    )
    group.addoption(
        "--glotouch-search",
        type=int,
        default=300,
        metavar="N",
        help="random scripts tried on each mutant no test notices (default 300; 0: quick, none is called equivalent)",
    )


def session_of(config: pytest.Config) -> Session:
    """What the plugin knows of this session."""
    if KEY not in config.stash:
        from glotouch_bt.mission_testing.session import Session

        config.stash[KEY] = Session(config.rootpath)
    return config.stash[KEY]


class Scripted:
    """The `scripted` fixture: call it to run a mission; `load` loads one.

    Args:
        session: What all tests share.
        here: The test's folder; relative paths are looked for there too.
        test: The test's id.
    """

    def __init__(self, session: Session, here: Path, test: str) -> None:
        self._session, self._here, self._test = session, here, test

    def load(
        self,
        mission: str | Path,
        settings: Mapping[str, Any] | None = None,
        *,
        objects: Path | None = None,
        skills: Mapping[str, Any] | None = None,
    ) -> Mission:
        """A checked mission: a shipped name, or a path as given, beside the test, or under pytest's root.

        Raises:
            MissionFaults: Everything that is wrong with it.
        """
        return self._session.load(mission, settings or {}, objects, skills, self._here, self._test)

    def __call__(
        self,
        mission: str | Path | Mission,
        script: Script | None = None,
        *,
        settings: Mapping[str, Any] | None = None,
        robot: Robot | None = None,
        timeout_s: float | None = None,
    ) -> ScriptedRun:
        """Run a mission with its leaves scripted; what the script does not name succeeds at once.

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
        self._session.ran(loaded, run)
        return run


@pytest.fixture
def scripted(request: pytest.FixtureRequest) -> Scripted:
    """Run missions with scripted leaves: `run = scripted("retrieve", {"squeeze": fails("no_squeeze")})`."""
    return Scripted(session_of(request.config), request.path.parent, request.node.nodeid)


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
    """Put faults round a robot: `faulty([{"fault": "wrench_bias", "with": {"force_N": [0, 0, 3]}}], fake_robot())`.

    The faults are those of a plan's `plan` (see `glotouch faults`), or the path of a plan. A fault that altered
    nothing by the end of the test fails it: such a test shows nothing.
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


def pytest_configure(config: pytest.Config) -> None:
    """Refuse what does not go together."""
    if config.getoption("--glotouch-mutate") and config.getoption("numprocesses", None):
        raise pytest.UsageError("--glotouch-mutate runs its tests in one process: leave out -n")


@pytest.hookimpl(wrapper=True)
def pytest_runtestloop(session: pytest.Session) -> Iterator[None]:
    """After the tests, if they pass: the mutants."""
    done = yield
    missions = session.config.getoption("--glotouch-mutate")
    if missions and not session.config.option.collectonly and not hasattr(session.config, "workerinput"):
        if session.testsfailed:
            session_of(session.config).mutation_lines.append("no mutant was tried, for a test fails without any")
        else:
            from glotouch_bt.mission_testing.mutation import mutate

            for mission in missions:
                mutate(session, session_of(session.config), mission)
    return done


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Send what a worker has seen to the controller; judge the coverage."""
    config = session.config
    output = getattr(config, "workeroutput", None)
    if output is not None:
        output["glotouch_coverage"] = session_of(config).coverage.plain() if KEY in config.stash else {}
        return
    if session.exitstatus == 0 and any(_short(config)):
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def _short(config: pytest.Config) -> tuple[bool, bool]:
    """Less than was asked: (outcomes exercised, mutants noticed)."""
    outcomes, mutants = config.getoption("--glotouch-coverage-min"), config.getoption("--glotouch-mutate-min")
    return (
        outcomes is not None and session_of(config).coverage.percent < outcomes,
        mutants is not None and any(s.percent < mutants for s in session_of(config).scores),
    )


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any, error: object) -> None:
    """A worker of pytest-xdist has ended: take over what it has seen."""
    seen = getattr(node, "workeroutput", {}).get("glotouch_coverage")
    if seen:
        session_of(node.config).coverage.merge(seen)


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Print the coverage of outcomes, and what came of the mutants."""
    least = config.getoption("--glotouch-coverage-min")
    if config.getoption("--glotouch-coverage") or least is not None:
        _print_coverage(terminalreporter, config, least)
    if config.getoption("--glotouch-mutate"):
        _print_mutants(terminalreporter, config)


def _print_coverage(reporter: Any, config: pytest.Config, least: float | None) -> None:
    coverage = session_of(config).coverage
    reporter.section("glotouch: outcomes of leaves")
    for line in coverage.lines():
        reporter.line(line)
    if not coverage.missions:
        reporter.line("no mission was run with scripted leaves (fixture `scripted`)")
    if least is not None:
        done, total = coverage.exercised()
        words = f"{done} of {total} outcomes ({coverage.percent:.1f} %), at least {least:g} % asked"
        _print_verdict(reporter, _short(config)[0], words)


def _print_mutants(reporter: Any, config: pytest.Config) -> None:
    session, least = session_of(config), config.getoption("--glotouch-mutate-min")
    reporter.section("glotouch: mutants")
    for line in session.mutation_lines:
        reporter.line(line)
    if least is not None and session.scores:
        worst = min(s.percent for s in session.scores)
        _print_verdict(reporter, _short(config)[1], f"{worst:.1f} % of the mutants noticed, at least {least:g} % asked")


def _print_verdict(reporter: Any, short: bool, words: str) -> None:
    reporter.line(f"{'FAILED: ' if short else ''}{words}", red=short, green=not short)
