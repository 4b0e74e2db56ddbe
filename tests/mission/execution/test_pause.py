"""Pausing and stopping a mission from outside: nothing is noticed, no clock runs, everything is on record."""

from __future__ import annotations

import contextlib
import os
import pty
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from glotouch_bt.mission.execution.control import Control, Preempted, TimedPauses
from glotouch_bt.mission.execution.runner import Outcome, run_mission
from glotouch_bt.mission.record.run_summary import NullRecord
from glotouch_bt.motion import Arm
from glotouch_bt.robot import Command, Observation, Robot, World
from glotouch_bt.robot.fake import FakeRobot
from glotouch_bt.runs.operator import operated
from glotouch_bt.skill import Skill, SkillFailed, SkillRun
from glotouch_bt.validation.pause import EveryNthTick
from tests.support.examples import examples


class Events(NullRecord):
    """Keeps events and the commands of each cycle."""

    def __init__(self) -> None:
        self.events: list[tuple[str, float, Any]] = []
        self.commands: list[Command] = []

    def event(self, kind: str, stamp_s: float, data: Any) -> None:
        self.events.append((kind, stamp_s, data))

    def block(self, observation: Observation, command: Command) -> None:
        self.commands.append(command)

    def kinds(self) -> list[str]:
        return [k for k, *_ in self.events]


class AtTick(Control):
    """Pauses once: from a tick on, for a while."""

    def __init__(self, tick: int, pause_s: float) -> None:
        super().__init__()
        self._tick, self._pause_s, self._until_s = tick, pause_s, float("inf")

    def wants_pause(self, ticks: int, now_s: float) -> bool:
        if ticks >= self._tick and self._until_s == float("inf"):
            self._until_s = now_s + self._pause_s
        return ticks >= self._tick and now_s < self._until_s


def test_a_paused_tree_is_not_ticked_and_goes_on_where_it_was(go: Any, log: list[str]) -> None:
    record = Events()
    outcome = go("  - act: {script: RRRRRRRRRRRRRRRRRRRRS}\n", record, control=AtTick(5, 3.0))
    assert outcome.status == "success"
    assert outcome.ticks == 21
    assert log == ["actR"] * 20 + ["actS"], "each letter once"
    assert record.kinds() == ["pause", "paused", "resumed"]
    asked, stood, resumed = (t for _, t, _ in record.events)
    assert stood - asked < 0.05
    assert resumed - asked == pytest.approx(3.0, abs=0.02)
    assert outcome.paused_s == pytest.approx(3.0, abs=0.03)
    assert record.events[1][2]["where"] == "at rest"


def test_no_clock_runs_in_a_pause(go: Any) -> None:
    """0.3 s of work pass a timeout of 0.5 s and a mission's 0.6 s, however long the pause."""
    tree = "  - timeout: {seconds: 0.5, do: {act: {script: " + "R" * 30 + "S}}}\n"
    outcome = go(tree, control=AtTick(10, 100.0), timeout_s=0.6)
    assert outcome.status == "success"
    late = "  - timeout: {seconds: 0.2, do: {act: {script: " + "R" * 30 + "S}}}\n"
    outcome = go(late, control=AtTick(10, 100.0))
    assert outcome.status == "failure"
    assert outcome.end_s - outcome.start_s == pytest.approx(100.2, abs=0.05)


def test_a_paused_mission_can_be_stopped(go: Any, robot: Any) -> None:
    control = Control()
    control.pause()
    cycles = [0]
    cycle = robot.cycle

    def later(command: object) -> Any:
        cycles[0] += 1
        if cycles[0] == 100:
            control.stop("enough")
        return cycle(command)

    robot.cycle = later
    outcome = go("  - act: {script: " + "R" * 500 + "}\n", control=control)
    assert isinstance(outcome.error, Preempted)
    assert outcome.ticks <= 2


def test_pause_and_stop_from_another_thread(go: Any, robot: Any, log: list[str]) -> None:
    control, record = Control(), Events()
    reached, cycle = threading.Event(), robot.cycle

    def slow(command: object) -> Any:
        if robot.now_s >= 0.1:
            reached.set()
            operator.join()
        return cycle(command)

    def operate() -> None:
        reached.wait(10.0)
        control.pause()
        control.resume()
        control.toggle()
        control.stop("from a thread")

    operator = threading.Thread(target=operate)
    operator.start()
    robot.cycle = slow
    outcome = go("  - act: {script: " + "R" * 500 + "}\n", record, control=control)
    assert outcome.status == "aborted"
    last = outcome.chain[-1].as_dict()
    assert (last["code"], last["message"]) == ("preempted", "from a thread")
    assert last["node"] == "m/sequence/act"
    assert log[-1] == "act!", "the running skill was closed"
    assert robot.held >= 1


@pytest.fixture
def hangup() -> Iterator[Callable[[signal.Handlers], object]]:
    """Set what SIGHUP does at first: a program inherits it, under `nohup` as ignored."""
    before = signal.getsignal(signal.SIGHUP)
    yield lambda action: signal.signal(signal.SIGHUP, action)
    signal.signal(signal.SIGHUP, before)


def test_a_run_under_nohup_outlives_its_terminal(hangup: Callable[[signal.Handlers], object]) -> None:
    hangup(signal.SIG_IGN)
    with operated(Control()):
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN


@pytest.mark.parametrize("number", [signal.SIGUSR1, signal.SIGTERM, signal.SIGHUP])
def test_signals_reach_the_mission(
    go: Any, robot: Any, number: signal.Signals, hangup: Callable[[signal.Handlers], object]
) -> None:
    hangup(signal.SIG_DFL)
    before, record, cycle = signal.getsignal(number), Events(), robot.cycle

    def signalled(command: object) -> Any:
        if round(robot.now_s, 6) in (0.1, 0.5):
            os.kill(os.getpid(), number)
        return cycle(command)

    robot.cycle = signalled
    with operated(Control()) as control:
        outcome = go("  - act: {script: " + "R" * 30 + "S}\n", record, control=control)
    assert signal.getsignal(number) is before
    if number == signal.SIGUSR1:
        assert outcome.status == "success"
        assert record.kinds() == ["pause", "paused", "resumed"]
    else:
        assert outcome.chain[-1].as_dict()["code"] == "preempted"


def test_keys_pause_in_the_foreground_and_the_shell_has_its_own_in_the_background() -> None:
    """A program on a terminal of its own: `p` reaches it; while another group has the terminal, nothing is read."""
    pid, terminal = pty.fork()
    if pid == 0:  # in the child, a session leader with the terminal
        os.execv(sys.executable, [sys.executable, "-c", OPERATED])
    said = ""
    with contextlib.suppress(OSError):  # how a terminal ends
        while not said.endswith("over"):
            said += os.read(terminal, 1024).decode()
            if said.endswith(("pause me", "leave me")):
                os.write(terminal, b"p")
    _, status = os.waitpid(pid, 0)
    os.close(terminal)
    assert (said.split()[-1], os.waitstatus_to_exitcode(status)) == ("over", 0), said


OPERATED = """
import os, signal, sys, termios, time
from glotouch_bt.runs.operator import operated
from glotouch_bt.mission.execution import Control

def say(word):
    sys.stdout.write(word)
    sys.stdout.flush()

def wait(for_it):
    end = time.monotonic() + 10.0
    while not for_it() and time.monotonic() < end:
        time.sleep(0.02)
    assert for_it()

control, lines = Control(), termios.ICANON
with operated(control):
    wait(lambda: not termios.tcgetattr(0)[3] & lines)
    say("pause me")
    wait(lambda: control.paused)
    other = os.fork()
    if other == 0:
        time.sleep(30.0)
        os._exit(0)
    os.setpgid(other, other)
    signal.signal(signal.SIGTTOU, signal.SIG_IGN)
    os.tcsetpgrp(0, other)  # as when a shell takes the terminal, and sets it as it likes it
    said = termios.tcgetattr(0)
    said[3] |= lines
    termios.tcsetattr(0, termios.TCSANOW, said)
    time.sleep(0.3)
    say("leave me")
    time.sleep(0.3)
    assert control.paused
    assert termios.tcgetattr(0)[3] & lines
    termios.tcflush(0, termios.TCIFLUSH)
    os.tcsetpgrp(0, os.getpgrp())
    wait(lambda: not termios.tcgetattr(0)[3] & lines)
    os.kill(other, signal.SIGKILL)
assert termios.tcgetattr(0)[3] & lines
say(" over")
"""


def test_timed_pauses_repeat_recorded_ones(go: Any, robot: Any) -> None:
    record = Events()
    go("  - act: {script: " + "R" * 280 + "S}\n", record, control=EveryNthTick(50, 0.33))
    begun = [t for k, t, _ in record.events if k == "pause"]
    ended = [t for k, t, _ in record.events if k == "resumed"]
    assert len(begun) == len(ended) == 5
    robot.now_s = 0.0
    again = Events()
    go("  - act: {script: " + "R" * 280 + "S}\n", again, control=TimedPauses(zip(begun, ended, strict=True)))
    assert again.events == record.events


class Sway(Skill):
    """To and fro, with a hold at each end; the setpoints are those of an unpaused run."""

    def run(self) -> SkillRun:
        arm = self.context.arm
        for k in range(4):
            yield from arm.shift((0.0, 0.05 * (-1) ** k, 0.0), 0.1, check=False)
            blocks = yield from arm.hold(0.1)
            assert len(blocks) == 10


class Squeezes(Skill):
    """Closes the jaws; while they move a pause waits."""

    def run(self) -> SkillRun:
        state = yield from self.context.arm.jaws(0.0, speed_m_s=0.05, force_N=10.0)
        if abs(state.aperture_m - 0.04) > 1e-6:
            raise SkillFailed("not_closed", "the jaws did not reach the thing")
        yield from self.context.arm.hold(0.2)


@pytest.fixture
def on_fake(load: Callable[..., Any], registry: dict[str, type[Skill]]) -> Iterator[Callable[..., Any]]:
    registry.update(sway=Sway, squeezes=Squeezes)

    def run(tree: str, robot: FakeRobot, control: Control | None) -> tuple[Outcome, Events]:
        def arm(robot: Robot, world: World) -> Arm:
            return Arm(robot.description, robot.limits, world, robot.period_s)

        record = Events()
        return run_mission(load(tree), robot, record, make_arm=arm, control=control), record

    yield run
    for name in ("sway", "squeezes"):
        registry.pop(name)


@settings(max_examples=examples(8, 20), deadline=None, suppress_health_check=list(HealthCheck))
@given(every=st.integers(3, 120), pause_s=st.floats(0.01, 0.7))
def test_a_skill_never_notices(on_fake: Any, every: int, pause_s: float) -> None:
    robot = FakeRobot()
    outcome, record = on_fake("  - sway\n", robot, EveryNthTick(every, pause_s))
    assert outcome.status == "success", outcome.reasons
    places = np.array([c.motion.pose_B_P.position_m for c in record.commands if c.motion is not None])
    begin = places[0]
    assert np.abs(places[:, [0, 2]] - begin[[0, 2]]).max() < 1e-6
    assert places[:, 1].max() - begin[1] == pytest.approx(0.05, abs=1e-4)
    np.testing.assert_allclose(places[-1], begin, atol=1e-4)
    assert outcome.guards == {}
    # no setpoint jumps, paused or not: the tool's acceleration by second differences, zero while it holds
    q, track = None, []
    for command in record.commands[1:]:
        q = q if command.motion is None else command.motion.pose_B_P.position_m
        track.append(begin if q is None else q)
    speed = np.diff(np.array(track), axis=0) / 0.01
    assert np.linalg.norm(np.diff(speed, axis=0), axis=1).max() / 0.01 < 1.05
    kinds = record.kinds()
    assert kinds.count("pause") - kinds.count("resumed") in (0, 1)


@pytest.mark.parametrize("tick", range(1, 110, 9))
def test_closing_jaws_are_not_paused_closed_ones_are(on_fake: Any, tick: int) -> None:
    robot = FakeRobot(grip_width_m=0.04)
    outcome, record = on_fake("  - squeezes\n", robot, AtTick(tick, 20.0))
    assert outcome.status == "success", outcome.reasons
    assert [c.gripper.force_N for c in robot.commands if c.gripper is not None] == [10.0]
    (where,) = [d["where"] for k, _, d in record.events if k == "paused"]
    assert where == "at rest"
    (stood,) = [t for k, t, _ in record.events if k == "paused"]
    assert tick < 5 or stood > 0.9, "the jaws close in 0.9 s"


@pytest.mark.parametrize("style", ["hold", "retreat", "finish"])
def test_each_style_on_record(on_fake: Any, style: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Sway, "PAUSE", style)
    outcome, record = on_fake("  - sway\n", FakeRobot(), AtTick(20, 0.5))
    assert outcome.status == "success"
    (paused,) = [d for k, _, d in record.events if k == "paused"]
    assert paused == {"where": "at rest" if style == "finish" else "on the way", "style": style}


def test_a_stop_in_a_motion_brakes_and_rises(on_fake: Any) -> None:
    control = Control()

    class Stops(FakeRobot):
        def cycle(self, command: Command) -> Observation:
            if self.cycles == 30:
                control.stop("the operator wants lunch")
            return super().cycle(command)

    robot = Stops()
    outcome, record = on_fake("  - sway\n", robot, control)
    assert outcome.chain[-1].as_dict()["code"] == "preempted"
    assert "raised" in outcome.safe_stop or "above the container" in outcome.safe_stop
    assert record.kinds()[-1] == "ending"
    assert not record.commands[-1].motion or not record.commands[-1].motion.dq.any()


def test_a_stop_with_something_in_the_jaws_stays_where_it_is(on_fake: Any) -> None:
    control = Control()

    class Stops(FakeRobot):
        def cycle(self, command: Command) -> Observation:
            if self.cycles == 105:
                control.stop()
            return super().cycle(command)

    robot = Stops(grip_width_m=0.04)
    outcome, _ = on_fake("  - squeezes\n", robot, control)
    assert outcome.safe_stop == "stopped and held: the jaws hold something"
    assert all(c.motion is None for c in robot.commands)
