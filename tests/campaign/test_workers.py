"""Worker processes: results, errors, lost processes, Ctrl-C, and a parent that is killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Callable
from pathlib import Path

import pytest

from glotouch_bt.campaign import TrialLost, WorkerLost, WorkerPool
from glotouch_bt.interrupts import repeat_lost_interrupts
from glotouch_bt.robot import BadInput, ParamError


def kill_this(number: int) -> None:
    os.kill(os.getpid(), number)


def hang() -> None:
    threading.Event().wait()


def leave(code: int) -> None:
    os._exit(code)


def refuse() -> None:
    raise ParamError("speed", 3, "less than 2")


def gone(pid: int) -> bool:
    """Return True if a process has ended, even if nobody waited for it."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


def wait_for(condition: Callable[[], bool], seconds: float = 30.0) -> None:
    over = threading.Event()
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "it does not happen"
        over.wait(0.02)


def test_a_dead_worker_is_one_lost_task_and_the_rest_goes_on() -> None:
    with WorkerPool(1) as pool:
        futures = [
            pool.submit(pow, 2, 3),
            pool.submit(kill_this, signal.SIGKILL),
            pool.submit(leave, 3),
            pool.submit(refuse),
            pool.submit(pow, 3, 3),
        ]
        assert futures[0].result() == 8
        with pytest.raises(WorkerLost, match=r"its process was killed \(SIGKILL\)"):
            futures[1].result()
        with pytest.raises(WorkerLost, match="its process ended with code 3"):
            futures[2].result()
        with pytest.raises(BadInput, match="speed = 3: must be less than 2"):
            futures[3].result()
        assert futures[4].result() == 27


def test_a_task_that_takes_too_long_is_killed_and_lost() -> None:
    with WorkerPool(1, limit_s=0.5) as pool:
        late = pool.submit(hang)
        with pytest.raises(TrialLost, match=r"it hung: no result after 0\.5 s"):
            late.result()


SCRIPT = """
import os, signal, sys, threading
from glotouch_bt.campaign import WorkerPool

def work(number):
    os.write(1, f"worker {os.getpid()}\\n".encode())  # whole, beside the other worker's
    threading.Event().wait(60)

if __name__ == "__main__":
    try:
        with WorkerPool(2) as pool:
            [future.result() for future in [pool.submit(work, n) for n in range(6)]]
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        print("interrupted", flush=True)
        sys.exit(130)
"""


@pytest.fixture
def parent(tmp_path: Path) -> subprocess.Popen[str]:
    """A process with two working workers and four tasks that wait; a group of its own, like a command in a terminal."""
    script = tmp_path / "parent.py"
    script.write_text(SCRIPT)
    pipe = subprocess.PIPE
    return subprocess.Popen([sys.executable, script], stdout=pipe, stderr=pipe, text=True, start_new_session=True)


def workers_of(parent: subprocess.Popen[str]) -> list[int]:
    assert parent.stdout is not None
    return [int(parent.stdout.readline().split()[1]) for _ in range(2)]


@pytest.mark.parametrize("times", [pytest.param(1, marks=pytest.mark.study), 5])
def test_ctrl_c_ends_all_without_a_traceback(parent: subprocess.Popen[str], times: int) -> None:
    """Nothing that waits begins: no third worker is heard of."""
    with parent:
        workers = workers_of(parent)
        for _ in range(times):
            os.killpg(parent.pid, signal.SIGINT)
            threading.Event().wait(0.05)
        out, err = parent.communicate(timeout=30)
    assert (parent.returncode, out, err) == (130, "interrupted\n", "")
    wait_for(lambda: all(map(gone, workers)))


def test_workers_end_with_a_killed_parent(parent: subprocess.Popen[str]) -> None:
    with parent:
        workers = workers_of(parent)
        parent.kill()
    wait_for(lambda: all(map(gone, workers)))


@pytest.mark.study
def test_five_times_ctrl_c_in_a_bench(tmp_path: Path) -> None:
    words = [
        sys.executable,
        "-m",
        "glotouch_bt.cli",
        "bench",
        "fuzz",
        "--trials",
        "100000",
        "--out",
        str(tmp_path / "o"),
    ]
    pipe = subprocess.PIPE
    with subprocess.Popen(words, stdout=pipe, stderr=pipe, text=True, start_new_session=True) as bench:
        assert bench.stderr is not None
        assert bench.stderr.readline().endswith(" bad\n"), "it is at work"
        for _ in range(5):
            os.killpg(bench.pid, signal.SIGINT)
            threading.Event().wait(0.05)
        out, err = bench.communicate(timeout=30)
    assert (bench.returncode, out) == (130, "")
    said = [line for line in err.splitlines() if not line.endswith(" bad")]
    assert said == ["glotouch: interrupted"]


def test_ctrl_c_that_python_swallows_is_raised_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Python ignores what is raised in the callback of a weak reference; the command still ends."""

    class Thing:
        pass

    def interrupted_callback(_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(sys, "unraisablehook", sys.unraisablehook)
    repeat_lost_interrupts()
    thing = Thing()
    reference = weakref.ref(thing, interrupted_callback)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # test runners may ignore it
    try:
        del thing
        with pytest.raises(KeyboardInterrupt):
            threading.Event().wait(10)
    finally:
        signal.signal(signal.SIGINT, before)
    assert reference() is None
