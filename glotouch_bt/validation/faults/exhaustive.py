"""`bench faults --exhaustive`: fail the n-th robot call, n = 0, 1, ... up to the mission's last call.

The mission runs once. At every call the process forks for each kind of fault. In the child this call fails and the run
ends; the parent waits for the child's result and continues unfaulted. Every call thus fails in its exact state, and the
run before it is simulated only once.
"""

from __future__ import annotations

import gc
import os
import signal
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from glotouch_bt.campaign import write_summary
from glotouch_bt.faults import CATALOGUE, Duration, FaultInjector, FaultPlan, FaultSpec, ListeningRecord, Repeat, When
from glotouch_bt.mission import Mission, load_mission, split_settings
from glotouch_bt.mission.execution import Outcome, run_mission
from glotouch_bt.mission.read import load_conditions
from glotouch_bt.mission.record import NullRecord
from glotouch_bt.mission.spec import Place
from glotouch_bt.robot import Backend, BadInput, Command, Observation, Request, Robot, Ticket, load_backend

KINDS = ("robot_fault", "exception")
HUNG_S = 30
"""Wall time after which a child that only has to end counts as hanging, s."""
HANGS = f"hangs: it did not end within {HUNG_S} s"
TRIES = 2
"""Number of tries of a hanging child: it may have been forked while another thread held a lock."""
PROGRESS_EVERY = 100


@dataclass(frozen=True)
class Exhaustive:
    """Settings of the study.

    Attributes:
        mission: Path or shipped name of a short mission.
        settings: Its parameters.
        backend: Registered name.
        seed: Seed of the run.
        stride: Fail every n-th call only.
        out: Folder for summary.json.
    """

    mission: str
    settings: Mapping[str, str]
    backend: str
    seed: int
    stride: int
    out: Path


class _Forking(FaultInjector):
    """A fault injector that forks at each robot call; in the child that call and all later ones fail.

    Args:
        robot: The device.
        seed: Seed of the run.
        stride: Fork at every n-th call only.
        ended: Called in the parent with (fault, call, problems) for each child.
    """

    def __init__(self, robot: Robot, seed: int, stride: int, ended: Callable[[str, int, str], None]) -> None:
        super().__init__(robot, FaultPlan("none", ()), seed)
        self._stride, self._ended = stride, ended
        self.calls = 0
        self.failing: tuple[str, int] | None = None
        self._write_to = -1

    def observe(self) -> Observation:
        """See `FaultInjector`."""
        self._fork()
        return super().observe()

    def cycle(self, command: Command) -> Observation:
        """See `FaultInjector`."""
        self._fork()
        return super().cycle(command)

    def start(self, request: Request) -> Ticket:
        """See `FaultInjector`."""
        self._fork()
        return super().start(request)

    def tell(self, problems: str) -> None:
        """Send the problems to the parent and end this child process."""
        os.write(self._write_to, problems.encode())
        os._exit(0)

    def _fork(self) -> None:
        if self.failing is not None:
            return
        call, self.calls = self.calls, self.calls + 1
        if call % self._stride:
            return
        for name in KINDS:
            problems = HANGS
            for _ in range(TRIES):
                found = self._child(name, call)
                if found is None:  # this is the child
                    self.failing = name, call
                    self.add_fault(_fault(name))
                    return
                if (problems := found) != HANGS:
                    break
            self._ended(name, call, problems)

    def _child(self, name: str, call: int) -> str | None:
        """Fork; return the child's problems in the parent, None in the child."""
        read_from, write_to = os.pipe()
        pid = os.fork()
        if pid == 0:
            os.close(read_from)
            self._write_to = write_to
            signal.signal(signal.SIGALRM, signal.SIG_DFL)
            signal.alarm(HUNG_S)
            return None
        os.close(write_to)
        with os.fdopen(read_from, "rb") as pipe:
            told = pipe.read().decode()
        _, status = os.waitpid(pid, 0)
        if os.WIFSIGNALED(status):
            number = os.WTERMSIG(status)
            return HANGS if number == signal.SIGALRM else f"the process died of {signal.Signals(number).name}"
        return told if os.WEXITSTATUS(status) == 0 else f"the process ended with code {os.WEXITSTATUS(status)}"


def _fault(name: str) -> FaultSpec:
    kind = CATALOGUE[name]
    return FaultSpec(name, kind, kind.effect.Params(), When(), Duration(until="ever"), Repeat(), Place("exhaustive"))


def run_exhaustive(study: Exhaustive, on_progress: Callable[[int, str], None] | None = None) -> dict[str, Any]:
    """Fail every call in turn; every run must end with a reason and the arm held.

    Args:
        study: Settings.
        on_progress: Called from time to time with (call, fault).

    Returns:
        Number of calls and end of the unfaulted run, number of tries, and the calls with problems.

    Raises:
        BadInput: The mission or the backend cannot be used.
    """
    mission, backend = load_mission(study.mission, study.settings), load_backend(study.backend)
    bad: list[dict[str, Any]] = []
    tried = 0

    def ended(name: str, call: int, problems: str) -> None:
        nonlocal tried
        tried += 1
        if problems:
            bad.append({"fault": name, "call": call, "what": problems})
        if on_progress is not None and tried % PROGRESS_EVERY == 1:
            on_progress(call, name)

    injector, outcome = _run(study, mission, backend, ended)
    summary = {
        "mission": study.mission,
        "backend": study.backend,
        "seed": study.seed,
        "calls": injector.calls,
        "unfaulted": outcome.status,
        "robot_s": round(outcome.end_s - outcome.start_s, 2),
        "tried": tried,
        "stride": study.stride,
        "kinds": list(KINDS),
        "bad": bad,
    }
    return write_summary(study.out, summary)


def _run(
    study: Exhaustive, mission: Mission, backend: Backend, ended: Callable[[str, int, str], None]
) -> tuple[_Forking, Outcome]:
    """Run unfaulted. Children exit inside and never return from here."""
    options = split_settings(mission, study.settings)
    device = backend.open(mission.world, load_conditions("ideal"), study.seed, options)
    if device.paced:
        device.close()
        raise BadInput(f"{study.backend}: its clock is the wall's; only a simulation in this process can be forked")
    injector = _Forking(device, study.seed, study.stride, ended)
    gc.collect()
    gc.freeze()  # keeps the children's garbage collector from copying pages
    outcome: Outcome | None = None
    try:
        try:
            with injector:
                outcome = run_mission(mission, injector, ListeningRecord(NullRecord(), injector))
            if isinstance(outcome.error, KeyboardInterrupt) and injector.failing is None:
                raise outcome.error
        except Exception as e:
            if injector.failing is None:
                raise
            injector.tell(_judged(injector, None, e))
        if injector.failing is not None:
            injector.tell(_judged(injector, outcome, None))
    except BaseException:
        if injector.failing is not None:
            os._exit(1)  # a child never continues as its parent
        raise
    finally:
        gc.unfreeze()
    assert outcome is not None
    return injector, outcome


def _judged(injector: _Forking, outcome: Outcome | None, error: Exception | None) -> str:
    """Return the problems of a run after a failed call; empty if none."""
    assert injector.failing is not None
    problems: list[str] = []
    if injector.proofs()[0].changes == 0:
        problems.append("the call did not fail")
    if outcome is None:
        if injector.failing[1] > 0 or "injected" not in str(
            error
        ):  # before the first tick the error reaches the caller
            problems.append(f"raised {type(error).__name__}: {error}")
    else:
        if outcome.status != "aborted":
            problems.append(f"status {outcome.status}")
        if not outcome.reasons or "injected" not in outcome.reasons[-1]:
            problems.append(f"reasons {outcome.reasons}")
        elif not outcome.chain[-1].node:
            problems.append("no node named")
    if not injector.held:
        problems.append("the arm was not held")
    return "; ".join(problems)
