"""One trial: its folder, all that its row depends on, and the work, done in a process that holds the folder's claim."""

from __future__ import annotations

import errno
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from glotouch_bt.campaign.identity import code_versions, described_request, difference, plain
from glotouch_bt.campaign.trial_folder import TrialFolder, claimed
from glotouch_bt.campaign.workers import TrialLost
from glotouch_bt.robot import BadInput
from glotouch_bt.runs import RunFolder, RunRequest, RunResult, holds_run, launch

Row = dict[str, Any]
OnRow = Callable[[Any, int, int], object]
"""Called with (row, trials done, trials in all) after each trial."""
REFUSALS = {errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.ESTALE, errno.EROFS}
"""Errors of a disk that is full or gone, which say nothing about the trial."""


def silent(row: Any, done: int, total: int) -> None:
    """Show nothing."""


@dataclass(frozen=True)
class Trial:
    """Work whose failure is a result, not an exception. It can be pickled.

    Attributes:
        folder: Folder of the trial.
        identity: All that the row depends on, as plain JSON data.
        run: Does the work and returns the row. A `BadInput` that it raises before it has made a run in the folder
            means a wrong request and ends the campaign; later, it is an error like any other.
        failed: Returns the row that stands for an error of `run`, or for a trial that was lost too often (`TrialLost`).
    """

    folder: Path
    identity: Mapping[str, Any]
    run: Callable[[], Row]
    failed: Callable[[Exception], Row]

    @classmethod
    def of(cls, request: RunRequest, run: Callable[[], Row], failed: Callable[[Exception], Row]) -> Trial:
        """Return the trial of a run in the folder of its request.

        Raises:
            BadInput: The request itself is wrong.
        """
        assert request.out is not None
        return cls(request.out, plain(described_request(request)), run, failed)


def perform(trial: Trial) -> Row:
    """Run a trial in this process and keep its row in the trial's folder; a finished trial is not run again.

    Raises:
        BadInput: The request itself is wrong, so that no trial can be run; or this process has other code.
        Claimed: Another process runs this trial.
        TrialLost: The disk is full or gone.
        KeyboardInterrupt: The work was interrupted.
    """
    made_by = trial.identity.get("code")
    if made_by is not None and made_by != code_versions():
        raise BadInput(f"this worker has other code than the command: {difference(made_by, code_versions())}")
    try:
        with claimed(trial.folder) as claimed_before:
            return _claimed_row(trial, claimed_before)
    except Exception as e:
        if (lost := _lost_on_disk(e)) is not None:
            raise lost from e
        raise


def _claimed_row(trial: Trial, claimed_before: bool) -> Row:
    folder = TrialFolder(trial.folder)
    row = folder.read(trial.identity)
    if row is not None:
        return row
    if claimed_before or holds_run(trial.folder):
        RunFolder(trial.folder).clear()  # a killed or interrupted trial left a run or parts of one
    try:
        row = trial.run()
    except TrialLost:
        raise
    except Exception as e:
        # A wrong request makes no run. After a run, its record is the input, and the trial has failed.
        wrong_request = isinstance(e, BadInput) and not holds_run(trial.folder)
        if wrong_request or _lost_on_disk(e) is not None:
            raise
        row = trial.failed(e)
    return folder.write(trial.identity, row)


def fail(trial: Trial, error: Exception) -> Row:
    """Keep and return the row of a trial that was lost too often.

    Raises:
        Claimed: Another process runs this trial after all.
    """
    folder = TrialFolder(trial.folder)
    with claimed(trial.folder):
        return folder.read(trial.identity) or folder.write(trial.identity, trial.failed(error))


def _lost_on_disk(error: BaseException | None) -> TrialLost | None:
    """Return the loss that an error of the disk means, or None for any other error."""
    while error is not None:
        if isinstance(error, OSError) and error.errno in REFUSALS:
            return TrialLost(f"its files could not be written ({error.strerror})")
        error = error.__cause__
    return None


def launch_trial(request: RunRequest, **given: Any) -> RunResult:
    """Launch a run of a campaign; arguments as for `launch`.

    Raises:
        KeyboardInterrupt: The run was interrupted: it is no trial.
        TrialLost: A file of the run could not be written.
        BadInput, BackendError: As `launch`.
    """
    done = launch(request, **given)
    if isinstance(done.outcome.error, KeyboardInterrupt):
        raise done.outcome.error
    if done.unwritten:
        raise TrialLost("; ".join(done.unwritten))
    return done


def crashed(error: Exception) -> dict[str, Any]:
    """Return the columns of a trial that raised or that was lost."""
    if isinstance(error, TrialLost):
        return {"status": "lost", "exit_code": -1, "cause": f"lost: {error}"}
    return {"status": "traceback", "exit_code": -1, "cause": f"traceback {type(error).__name__}: {error}"}
