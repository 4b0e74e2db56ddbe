"""Skills that hang, and everything a skill can raise: the mission ends, the arm is held, the node is named."""

from __future__ import annotations

import os
import signal
import threading
import time
from asyncio import CancelledError
from collections.abc import Callable, Iterator
from typing import Any, ClassVar

import pytest
from py_trees.common import Status

from glotouch_bt.mission.execution.runner import Outcome, run_mission
from glotouch_bt.mission.execution.watchdog import SkillHung, Watchdog
from glotouch_bt.robot import HOLD, BackendError, GlotouchError, MotionRefused, ParamError, StaleReading
from glotouch_bt.skill import Out, Skill, SkillFailed, SkillRun
from tests.mission.execution.test_pause import Events


class Forever(Skill):
    """Yields for ever."""

    MAX_DURATION_S: ClassVar[float] = 2.0

    def run(self) -> SkillRun:
        while True:
            yield HOLD


class Spins(Skill):
    """Never yields again, and catches what it can."""

    def run(self) -> SkillRun:
        yield HOLD
        while True:
            try:
                sum(range(1000))
            except Exception:
                continue


class Sleeps(Skill):
    """Waits for something that does not come."""

    def run(self) -> SkillRun:
        yield HOLD
        time.sleep(1000.0)


class Raises(Skill):
    """Raises what a test wants, where a test wants."""

    what: ClassVar[BaseException] = ValueError("bug")
    where: ClassVar[str] = "run"
    number = Out(int, "a number")

    def initialise(self) -> None:
        if self.where == "initialise":
            raise self.what
        super().initialise()

    def update(self) -> Status:
        if self.where == "update":
            raise self.what
        return super().update()

    def terminate(self, new_status: Status) -> None:
        super().terminate(new_status)
        if self.where == "terminate" and new_status is not Status.RUNNING:
            raise self.what

    def run(self) -> SkillRun:
        if self.where == "first":
            raise self.what
        yield HOLD
        if self.where == "port":
            self.write_port("numbre", 3)
        try:
            if self.where == "run":
                raise self.what
            if self.where == "deep":
                self.deep()
        finally:
            if self.where == "finally":
                raise self.what
        yield HOLD

    def deep(self) -> None:
        self.deep()


class Stubborn(Skill):
    """Does not let itself be closed."""

    def run(self) -> SkillRun:
        while True:
            try:
                yield HOLD
            except GeneratorExit:
                continue


@pytest.fixture(autouse=True)
def _skills(registry: dict[str, type[Skill]]) -> Iterator[None]:
    mine = {"forever": Forever, "spins": Spins, "sleeps": Sleeps, "raises": Raises, "stubborn": Stubborn}
    mine |= {"odd": Odd, "unmade": Unmade, "lingers": Lingers}
    registry.update(mine)
    yield
    for name in mine:
        registry.pop(name)


@pytest.fixture
def go(load: Callable[..., Any], robot: Any, no_arm: Any) -> Callable[..., Outcome]:
    def run(tree: str, record: Any = None, **options: Any) -> Outcome:
        return run_mission(load(tree), robot, record or Events(), make_arm=no_arm, **options)

    return run


def test_a_skill_that_yields_for_ever_fails_by_its_limit(go: Any, robot: Any) -> None:
    outcome = go("  - forever\n")
    assert outcome.status == "failure"
    last = outcome.chain[-1].as_dict()
    assert (last["node"], last["code"]) == ("forever", "skill_timeout")
    assert last["evidence"]["limit_s"] == 2.0
    assert "2 s" in last["message"]
    assert outcome.end_s - outcome.start_s == pytest.approx(2.0, abs=0.02)


def test_the_tree_may_recover_from_it(go: Any) -> None:
    assert go("  - selector: [forever, find]\n").status == "success"


@pytest.mark.parametrize("name", ["spins", "sleeps"])
def test_a_skill_that_blocks_is_broken_off_with_its_stack(go: Any, robot: Any, name: str) -> None:
    record = Events()
    outcome = go(f"  - find\n  - {name}\n", record, stuck_s=0.3)
    assert outcome.status == "aborted"
    assert isinstance(outcome.error, SkillHung)
    last = outcome.chain[-1].as_dict()
    assert (last["node"], last["code"]) == (f"m/sequence/{name}", "skill_hung")
    assert robot.held >= 1
    (stuck,) = [d for k, _, d in record.events if k == "stuck"]
    assert "in run" in stuck["stack"]
    assert "test_hanging.py" in stuck["stack"]


def test_it_is_broken_off_in_another_thread_too(go: Any) -> None:
    out: list[Outcome] = []
    thread = threading.Thread(target=lambda: out.append(go("  - find\n  - spins\n", stuck_s=0.3)))
    thread.start()
    thread.join(30.0)
    assert isinstance(out[0].error, SkillHung)


def test_an_arm_with_a_clock_of_its_own_is_held_while_a_skill_blocks(go: Any, robot: Any) -> None:
    robot.paced, held = True, []
    hold = robot.hold
    robot.hold = lambda: (held.append(threading.current_thread().name), hold())
    go("  - sleeps\n", stuck_s=1.0)
    assert held[0] == "watchdog"
    assert held[-1] == "MainThread"


def test_what_cannot_be_broken_off_is_handed_to_the_last_resort(robot: Any) -> None:
    lost = threading.Event()
    seen: list[SkillHung] = []

    def on_unresponsive(stuck: SkillHung) -> None:
        seen.append(stuck)
        lost.set()

    dog = Watchdog(robot, lambda: "m/node", 0.05, on_unresponsive, grace_s=0.05)
    dog._interrupt = lambda: None  # type: ignore[method-assign]
    with dog:
        assert lost.wait(10.0)
    assert seen[0].node == "m/node"
    assert "on_unresponsive" not in seen[0].stack


def test_a_busy_mission_is_not_taken_for_a_stuck_one(go: Any, robot: Any) -> None:
    cycle = robot.cycle

    def slow(command: object) -> Any:
        time.sleep(0.02)
        return cycle(command)

    robot.cycle = slow
    assert go("  - act: {script: " + "R" * 20 + "S}\n", stuck_s=0.3).status == "success"


RAISED = [
    KeyError("port"),
    RecursionError("deep"),
    MemoryError(),
    ZeroDivisionError("bug"),
    ParamError("x", 1, "2"),
    BackendError("cable"),
    StaleReading("wrench", 1.0, 0.2),
    SystemExit(3),
    AssertionError(),
    StopIteration(),
    TimeoutError("socket"),
    CancelledError(),
    BaseException("a panic of compiled code"),
]


@pytest.mark.parametrize("where", ["initialise", "update", "first", "run", "finally", "terminate"])
@pytest.mark.parametrize("what", RAISED, ids=lambda e: type(e).__name__)
def test_whatever_a_skill_raises_wherever_it_ends_the_mission_with_its_node(
    go: Any, robot: Any, monkeypatch: pytest.MonkeyPatch, what: BaseException, where: str
) -> None:
    monkeypatch.setattr(Raises, "what", what)
    monkeypatch.setattr(Raises, "where", where)
    outcome = go("  - find\n  - raises\n  - act\n")
    if isinstance(what, StopIteration) and where == "update":
        return  # a generator's own language
    assert outcome.status == "aborted", outcome
    assert outcome.chain[-1].node == "m/sequence/raises"
    assert robot.held >= 1


@pytest.mark.parametrize("where", ["first", "run", "finally"])
def test_a_refused_motion_is_a_failure_wherever_it_is_raised(
    go: Any, monkeypatch: pytest.MonkeyPatch, where: str
) -> None:
    monkeypatch.setattr(Raises, "what", MotionRefused("line", "the wall"))
    monkeypatch.setattr(Raises, "where", where)
    outcome = go("  - raises\n")
    assert outcome.status == "failure"
    assert outcome.chain[-1].as_dict()["code"] == "motion_refused"


@pytest.mark.parametrize("where", ["port", "deep"])
def test_faults_of_the_tree_library_and_of_python_are_named_too(
    go: Any, monkeypatch: pytest.MonkeyPatch, where: str
) -> None:
    monkeypatch.setattr(Raises, "where", where)
    outcome = go("  - raises\n")
    assert outcome.status == "aborted"
    assert outcome.chain[-1].node == "m/sequence/raises"


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_skill_that_will_not_be_closed_hides_nothing(go: Any, robot: Any) -> None:
    robot.fail_at = (0.05, BackendError("cable"))
    outcome = go("  - stubborn\n")
    assert str(outcome.error) == "cable"
    timed = go("  - timeout: {seconds: 0.02, do: stubborn}\n")
    assert timed.status == "aborted"
    assert timed.chain[-1].node.endswith("stubborn")


class Odd(Skill):
    """Its body is not what a body is."""

    body: ClassVar[Callable[[], Any]] = staticmethod(lambda: None)

    def run(self) -> SkillRun:
        return type(self).body()


def _returns_a_status() -> Iterator[object]:
    yield HOLD
    return Status.FAILURE


def _yields_nothing() -> Iterator[object]:
    yield None


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (_returns_a_status, "returned <Status.FAILURE"),
        (_yields_nothing, "yielded None"),
        (lambda: 3, "run() is no generator"),
    ],
)
def test_a_body_that_gives_what_no_body_gives_is_not_taken_for_success(
    go: Any, robot: Any, monkeypatch: pytest.MonkeyPatch, body: Callable[[], Any], message: str
) -> None:
    monkeypatch.setattr(Odd, "body", staticmethod(body))
    outcome = go("  - odd\n")
    assert outcome.status == "aborted"
    assert message in outcome.chain[-1].text
    assert outcome.chain[-1].node == "m/sequence/odd"
    assert robot.held >= 1


class Lingers(Skill):
    """Waits in its end."""

    def run(self) -> SkillRun:
        try:
            while True:
                yield HOLD
        finally:
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(1000.0)


class Unmade(Skill):
    """Cannot be made."""

    def __init__(self, *given: Any) -> None:
        raise KeyError("calibration")


def test_a_skill_that_cannot_be_made_is_named_before_anything_moves(go: Any, robot: Any) -> None:
    with pytest.raises(GlotouchError, match="skill 'unmade' cannot be made: KeyError: 'calibration'"):
        go("  - find\n  - unmade\n")
    assert robot.now_s == 0.0


def test_impatient_ctrl_c_leaves_no_end_half_done(go: Any, robot: Any) -> None:
    """The third comes while the arm is held, the fourth while the skill is closed, which may take for ever."""
    cycle, hold = robot.cycle, robot.hold

    def pressed(command: object) -> Any:
        if round(robot.now_s, 6) == 0.1:
            os.kill(os.getpid(), signal.SIGINT)
            os.kill(os.getpid(), signal.SIGINT)
        return cycle(command)

    def held() -> None:
        os.kill(os.getpid(), signal.SIGINT)
        hold()

    robot.cycle, robot.hold = pressed, held
    before, began = signal.getsignal(signal.SIGINT), time.monotonic()
    outcome = go("  - lingers\n")
    assert outcome.chain[-1].reason.code == "interrupted"
    assert robot.held >= 1
    assert time.monotonic() - began < 20.0
    assert signal.getsignal(signal.SIGINT) is before


def test_failures_keep_their_kind(go: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Raises, "what", SkillFailed("odd", "as it happens"))
    assert go("  - raises\n").chain[-1].as_dict()["code"] == "odd"
