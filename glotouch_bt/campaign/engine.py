"""Run the trials of a campaign on an executor. The folders of the trials are the truth: executors only start trials."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future
from contextlib import suppress
from queue import Empty, SimpleQueue
from time import perf_counter
from typing import Protocol

from glotouch_bt.campaign.cluster import ClusterLost
from glotouch_bt.campaign.settings import Shard
from glotouch_bt.campaign.trial import OnRow, Row, Trial, fail, perform, silent
from glotouch_bt.campaign.trial_folder import TrialFolder
from glotouch_bt.campaign.workers import Claimed, TrialLost
from glotouch_bt.robot import GlotouchError

ATTEMPTS = 3
"""Attempts at a trial; if all are lost, it counts as failed."""
POLL_S = 0.5
"""Wall time between two looks at trials that other commands run."""
WRITE_S = 10.0
"""Wall time between two tables of a campaign under way. Source: ours; a table of 1,000 rows takes about 10 ms."""


class CampaignFolder(Protocol):
    """A campaign whose folder can be prepared; see `Campaign`."""

    @property
    def shard(self) -> Shard | None:
        """The share of the trials that is run."""

    def open(self) -> None:
        """Prepare the folder."""


class ShardDone(GlotouchError):
    """The trials of this shard are done, but not those of all shards."""


def run_trials(
    executor: Executor,
    trials: Sequence[Trial],
    campaign: CampaignFolder,
    on_row: OnRow = silent,
    *,
    whole: bool = False,
    write: Callable[[list[Row]], object] | None = None,
    before: int = 0,
    after: int = 0,
) -> list[Row]:
    """Run the trials that their folders do not hold yet; return the rows of all, in the order of the trials.

    A trial is attempted up to `ATTEMPTS` times if its process dies, hangs, or cannot write; then its row is that of a
    failure. Trials that another command runs in the same folders are waited for.

    Args:
        executor: A `WorkerPool` or a `ClusterPool`.
        trials: The trials.
        campaign: The campaign, which is opened before its first trials; of them, its shard is run.
        on_row: Called with (row, rows so far, trials) after each trial; not for those that were done before.
        whole: Every shard needs the rows of all these trials; the shards share the work.
        write: Called with the rows so far, in order: now and then, and at the end, also after an error.
        before, after: Trials of the campaign done before these (0 opens it), and still to come, for `on_row`.

    Raises:
        BadInput: A folder holds a trial or a campaign that was made otherwise (nothing was run), or a request is
            wrong.
        ShardDone: All trials of the shard are done, but not all trials.
    """
    if before == 0:
        campaign.open()
    state = _State(executor, trials, None if whole else campaign.shard)
    total = before + state.total + after
    written = perf_counter()
    try:
        for row in state.rows_to_come():
            on_row(row, before + state.done, total)
            if write is not None and perf_counter() - written > WRITE_S:
                write(state.rows())
                written = perf_counter()
    except BaseException:
        state.cancel()
        raise
    finally:
        state.look_again()
        if write is not None:
            write(state.rows())
    rows = state.rows()
    if len(rows) < len(trials):
        raise ShardDone(f"{state.done} trials of this shard are done; {len(rows)} of {len(trials)} of all shards")
    return rows


class _State:
    """The rows so far, and the futures of the running trials."""

    def __init__(self, executor: Executor, trials: Sequence[Trial], shard: Shard | None) -> None:
        self._executor = executor
        self._trials = trials
        self._rows: dict[int, Row] = {}
        self._futures: dict[Future[Row], int] = {}
        self._ended: SimpleQueue[Future[Row]] = SimpleQueue()
        self._elsewhere: list[int] = []
        self._lost: dict[int, list[str]] = {}
        self._mine = [n for n in range(len(trials)) if shard is None or shard.takes(n)]
        self.look_again()
        self.total = len(self._mine)
        """Number of trials to be done by this command."""
        self.done = sum(n in self._rows for n in self._mine)
        """Number of those that are done."""

    def rows(self) -> list[Row]:
        """Return the rows so far, in the order of the trials."""
        return [self._rows[n] for n in sorted(self._rows)]

    def look_again(self) -> None:
        """Read the rows that others, or earlier commands, have written."""
        for n, trial in enumerate(self._trials):
            if n not in self._rows and (row := TrialFolder(trial.folder).read(trial.identity)) is not None:
                self._rows[n] = row

    def cancel(self) -> None:
        """Cancel the trials that have not started."""
        for future in self._futures:
            future.cancel()

    def rows_to_come(self) -> Iterator[Row]:
        """Start every trial that is not done, and yield each row."""
        for n in self._mine:
            if n not in self._rows:
                self._start(n)
        while self._futures or self._elsewhere:
            try:
                future = self._ended.get(timeout=POLL_S if self._elsewhere else None)
            except Empty:
                elsewhere, self._elsewhere = self._elsewhere, []
                for n in elsewhere:
                    self._start(n)
                continue
            n = self._futures.pop(future)
            row = self._outcome(n, future)
            if row is not None:
                self._rows[n] = row
                self.done += 1
                yield row

    def _start(self, n: int) -> None:
        future = self._executor.submit(perform, self._trials[n])
        self._futures[future] = n
        future.add_done_callback(self._ended.put)

    def _outcome(self, n: int, future: Future[Row]) -> Row | None:
        """Return the row of an ended attempt, or None if there will be another one."""
        trial = self._trials[n]
        try:
            return future.result()
        except Claimed:
            self._elsewhere.append(n)
        except ClusterLost:
            self._start(n)
        except TrialLost as e:
            folder = TrialFolder(trial.folder)
            lost = self._lost[n] = [*(self._lost.get(n) or folder.lost()), str(e)]
            folder.note_lost(lost)
            if len(lost) < ATTEMPTS:
                self._start(n)
                return None
            with suppress(Claimed):
                return _failed(trial, e)
            self._elsewhere.append(n)
        return None


def _failed(trial: Trial, error: TrialLost) -> Row:
    """Return the row of a lost trial, even if the disk does not take it."""
    try:
        return fail(trial, error)
    except Claimed:
        raise
    except GlotouchError:
        return trial.failed(error)
