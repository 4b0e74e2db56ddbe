"""An executor on a dask cluster: each worker of dask runs trials in a process of its own beside it.

dask.distributed is an optional dependency: `pip install glotouch-bt[cluster]`. Its workers need the same code, and the
folders of the trials at the same paths.
"""

from __future__ import annotations

import atexit
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable
from concurrent.futures import Executor, Future
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any, ParamSpec, TypeVar

from glotouch_bt.campaign.workers import LIMIT_S, TaskProcess, TrialLost
from glotouch_bt.robot import BadInput, GlotouchError

P = ParamSpec("P")
T = TypeVar("T")
LOCAL = "local"
"""Address that stands for a cluster on this machine, started for the command."""
CONNECT_S = 20.0
"""Wall time to wait for the scheduler at the start."""
RECONNECT_S = 600.0
"""Wall time to wait for a scheduler that was lost. Source: ours; a batch queue restarts a job within minutes."""
_thread = threading.local()


class ClusterLost(GlotouchError):
    """The scheduler was lost with what it knew about the task."""


class ClusterPool(Executor):
    """An executor on dask.distributed.

    When the scheduler is lost, its tasks end with `ClusterLost`; the next `submit` waits for a scheduler at the same
    address.

    Args:
        address: Address of the scheduler, such as tcp://host:8786, or `LOCAL`.
        workers: Number of workers of a local cluster.
        limit_s: Wall time of a task, after which its process is killed.

    Raises:
        BadInput: dask.distributed is not installed, or no scheduler answers.
    """

    def __init__(self, address: str, workers: int, limit_s: float = LIMIT_S) -> None:
        try:
            import distributed
        except ImportError as e:
            raise BadInput("--cluster: needs dask.distributed; pip install 'glotouch-bt[cluster]'") from e
        self._distributed = distributed
        self._limit_s = limit_s
        self._numbers = iter(range(2**62))
        self._cluster: Any = None
        self._address = address
        if address == LOCAL:
            self._cluster = distributed.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                host="127.0.0.1",
                dashboard_address=None,
                silence_logs="CRITICAL",
            )
            self._address = self._cluster.scheduler_address
        try:
            self._client = self._connected(CONNECT_S)
        except (OSError, ValueError) as e:
            raise BadInput(f"--cluster {address}: no scheduler answers there ({e})") from e

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """See `Executor`.

        Raises:
            GlotouchError: The scheduler was lost and does not come back.
        """
        if self._client.status != "running":
            self._reconnect()
        result: Future[T] = Future()
        call = partial(_run_beside, os.getcwd(), self._limit_s, (fn, args, kwargs))
        key = f"trial-{os.getpid()}-{next(self._numbers)}"
        theirs = self._client.submit(call, key=key, pure=False)
        theirs.add_done_callback(partial(_pass_on, result))
        return result

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Leave the cluster, and end a local one. Trials that a remote cluster runs already end by themselves."""
        self._client.close()
        if self._cluster is not None:
            self._cluster.close()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.shutdown(cancel_futures=kind is not None)

    def _connected(self, timeout_s: float) -> Any:
        return self._distributed.Client(self._address, timeout=timeout_s, set_as_default=False)

    def _reconnect(self) -> None:
        self._client.close()
        deadline = time.perf_counter() + RECONNECT_S
        while True:
            try:
                self._client = self._connected(CONNECT_S)
                return
            except (OSError, ValueError) as e:
                if time.perf_counter() > deadline:
                    raise GlotouchError(
                        f"the scheduler at {self._address} was lost; start it again and continue with --resume"
                    ) from e


def _pass_on(result: Future[Any], theirs: Any) -> None:
    """Give the end of a task of dask to our future, unless that was cancelled."""
    if not result.set_running_or_notify_cancel():
        return
    if theirs.status == "finished":
        result.set_result(theirs.result())
    elif theirs.status == "error":
        result.set_exception(_error_of(theirs))
    else:  # cancelled or lost
        result.set_exception(ClusterLost("the scheduler was lost"))


def _error_of(theirs: Any) -> BaseException:
    error: BaseException = theirs.exception()
    if type(error).__name__ == "KilledWorker":
        return TrialLost("its worker died")
    return error


def _run_beside(folder: str, limit_s: float, call: tuple[Any, Any, Any]) -> Any:
    """Run in a worker of dask: do a task in a process of its own.

    Raises:
        BadInput: This machine does not have the folder.
        TrialLost, GlotouchError: As `TaskProcess.result_of`.
    """
    if not Path(folder).is_dir():
        raise BadInput(f"a worker of the cluster has no folder {folder}: all machines need it at the same path")
    process: TaskProcess | None = getattr(_thread, "process", None)
    if process is None:
        # dask's workers are daemons, which may not start processes; ours ends when its parent is gone.
        multiprocessing.current_process()._config["daemon"] = False  # type: ignore[attr-defined]
        process = _thread.process = TaskProcess()
        # A worker that leaves would wait for its child, which waits for work.
        atexit.register(process.signal, signal.SIGKILL)
    process.limit_s = limit_s
    return process.result_of((_in_folder, (folder, call), {}))


def _in_folder(folder: str, call: tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any]]) -> Any:
    os.chdir(folder)
    function, args, kwargs = call
    return function(*args, **kwargs)
