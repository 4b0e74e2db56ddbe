"""Worker processes of a campaign: a lost process is one lost task, Ctrl-C ends them all, none outlives its parent."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import time
from collections.abc import Callable
from concurrent.futures import Executor, Future
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from queue import SimpleQueue
from types import TracebackType
from typing import Any, ParamSpec, TypeVar

from glotouch_bt.interrupts import repeat_lost_interrupts
from glotouch_bt.robot import BadInput, GlotouchError

P = ParamSpec("P")
T = TypeVar("T")
Call = tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any]]

GRACE_S = 10.0
"""Wall time in which an interrupted worker may end its task safely; after that it is killed."""
LIMIT_S = 1800.0
"""Wall time after which a task counts as hanging. Source: ours, about thirty times the wall time of a mission."""
STEP_S = 0.1
"""Wall time between two looks at ending workers."""


class TrialLost(GlotouchError):
    """An attempt at a trial ended without a result, for a reason that need not be the trial's: it is tried again."""


class Claimed(GlotouchError):
    """Another process holds the folder of the trial."""


class WorkerLost(TrialLost):
    """The process of a task died before the task had a result."""

    def __init__(self, code: int | None) -> None:
        if code is not None and code < 0:
            how = f"was killed ({signal.Signals(-code).name})"
        else:
            how = f"ended with code {code}"
        super().__init__(f"its process {how}")
        self.code = code

    def __reduce__(self) -> tuple[type[WorkerLost], tuple[int | None]]:
        return WorkerLost, (self.code,)


class WorkerPool(Executor):
    """An executor with a fixed number of fresh processes (spawned: MuJoCo and threads do not survive a fork).

    A worker that dies gives `WorkerLost` to its own task only and is replaced. Workers are process groups of their own,
    so that Ctrl-C reaches this process alone: it raises KeyboardInterrupt, and the pool then interrupts the workers and
    cancels what waits; the next Ctrl-C kills them. Use it as a context manager.

    Args:
        workers: Number of processes.
        limit_s: Wall time of a task, after which its process is killed.
    """

    def __init__(self, workers: int, limit_s: float = LIMIT_S) -> None:
        self._waiting: SimpleQueue[tuple[Future[Any], Call] | None] = SimpleQueue()
        self._slots = [_Slot(self._waiting, limit_s) for _ in range(workers)]
        self._interrupted = self._hurried = False
        self._handler_before: Any = None
        for slot in self._slots:
            slot.start()

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """See `Executor`."""
        future: Future[T] = Future()
        self._waiting.put((future, (fn, args, kwargs)))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the workers, after all tasks or at once (`cancel_futures`); see `Executor`."""
        if cancel_futures:
            self._cancel_waiting()
        for _ in self._slots:
            self._waiting.put(None)
        if cancel_futures:
            self._end_running()
        for slot in self._slots if wait else ():
            slot.join()

    def __enter__(self) -> WorkerPool:
        if threading.current_thread() is threading.main_thread():
            self._handler_before = signal.signal(signal.SIGINT, self._on_interrupt)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._interrupted = kind is not None and issubclass(kind, KeyboardInterrupt)
        self.shutdown(cancel_futures=kind is not None)
        if self._handler_before is not None and not self._interrupted:
            signal.signal(signal.SIGINT, self._handler_before)

    def _on_interrupt(self, number: int, frame: object) -> None:
        if self._interrupted:
            self._hurried = True
            return
        raise KeyboardInterrupt

    def _cancel_waiting(self) -> None:
        while not self._waiting.empty():
            if (item := self._waiting.get()) is not None:
                item[0].cancel()

    def _end_running(self) -> None:
        """Interrupt the workers, so that a mission holds its arm; kill those that are not done in time."""
        for slot in self._slots:
            slot.process.signal(signal.SIGINT)
        deadline = time.perf_counter() + GRACE_S
        while not self._hurried and time.perf_counter() < deadline:
            alive = [slot for slot in self._slots if slot.is_alive()]
            if not alive:
                return
            alive[0].join(STEP_S)
        for slot in self._slots:
            slot.process.signal(signal.SIGKILL)


class _Slot(threading.Thread):
    """A thread that hands tasks to one process."""

    def __init__(self, waiting: SimpleQueue[tuple[Future[Any], Call] | None], limit_s: float) -> None:
        super().__init__(name="worker slot", daemon=True)
        self._waiting = waiting
        self.process = TaskProcess(limit_s)

    def run(self) -> None:
        while (item := self._waiting.get()) is not None:
            future, call = item
            if not future.set_running_or_notify_cancel():
                continue
            try:
                future.set_result(self.process.result_of(call))
            except BaseException as e:
                future.set_exception(e)
        self.process.close()


class TaskProcess:
    """A process that does one task after another for one thread; it is replaced when it dies or is killed.

    Attributes:
        limit_s: Wall time of a task, after which the process is killed.
    """

    def __init__(self, limit_s: float = LIMIT_S) -> None:
        self.limit_s = limit_s
        self._process: BaseProcess | None = None
        self._pipe: Connection | None = None
        self._ready = False

    def close(self) -> None:
        """End the process."""
        if self._pipe is not None and self._process is not None:
            self._pipe.close()
            self._process.join()

    def signal(self, number: int) -> None:
        """Send a signal to the process and its children."""
        process = self._process
        if process is None or process.pid is None:
            return
        with contextlib.suppress(OSError):
            os.kill(process.pid, number)
        if number == signal.SIGKILL:
            with contextlib.suppress(OSError):
                os.killpg(process.pid, number)

    def result_of(self, call: Call) -> Any:
        """Do a task and return its result.

        Raises:
            TrialLost: The process died, or the task took too long.
            GlotouchError, RuntimeError: The error of the task.
        """
        pipe, process = self._started()
        try:
            if not self._ready:
                self._ready = pipe.recv()  # the limit does not count the start of the process
            pipe.send(call)
            if not wait([pipe, process.sentinel], self.limit_s):
                self.signal(signal.SIGKILL)
                self._ended()
                raise TrialLost(f"it hung: no result after {self.limit_s:g} s")
            succeeded, result = pipe.recv()
        except (EOFError, OSError) as e:
            raise WorkerLost(self._ended()) from e
        if succeeded:
            return result
        raise result

    def _started(self) -> tuple[Connection, BaseProcess]:
        if self._process is not None and not self._process.is_alive():  # killed while it had nothing to do
            self._ended()
        if self._process is None or self._pipe is None:
            # A process inherits the mask of the thread that starts it: it starts with Ctrl-C blocked.
            before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            context = get_context("spawn")
            self._pipe, theirs = context.Pipe()
            self._process = context.Process(target=serve, args=(theirs,))
            self._process.start()
            theirs.close()
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        return self._pipe, self._process

    def _ended(self) -> int | None:
        """Wait for the end of the process; return its exit code."""
        assert self._process is not None
        assert self._pipe is not None
        self._process.join()
        code = self._process.exitcode
        self._pipe.close()
        self._process = self._pipe = None
        self._ready = False
        return code


def serve(pipe: Connection) -> None:
    """Run in a worker: do one task after another until the pipe is closed or the parent is gone."""
    os.setsid()
    repeat_lost_interrupts()
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        pipe.send(True)
        while True:
            try:
                function, args, kwargs = pipe.recv()
            except EOFError:
                return
            pipe.send(_answer(function, args, kwargs))
    except KeyboardInterrupt:
        os._exit(130)


def _answer(function: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any]) -> tuple[bool, Any]:
    """Return (True, result) or (False, error); an error is sent as a class that any process can read."""
    try:
        return True, function(*args, **kwargs)
    except BadInput as e:
        return False, BadInput(str(e))
    except (TrialLost, Claimed) as e:
        return False, e
    except GlotouchError as e:
        return False, GlotouchError(str(e))
    except Exception as e:
        return False, RuntimeError(f"{type(e).__name__}: {e}")


def _end_with_parent() -> None:
    """Kill this process and its children when the parent is gone, however it ended."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os.killpg(0, signal.SIGKILL)
