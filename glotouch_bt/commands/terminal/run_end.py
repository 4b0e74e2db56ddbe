"""The end of a run or of a resumed run: what is printed, and the exit code."""

from __future__ import annotations

import traceback
from typing import TYPE_CHECKING

from glotouch_bt.commands.shared import print_json, showing_tracebacks
from glotouch_bt.commands.terminal.console import print_error, print_result

if TYPE_CHECKING:
    from glotouch_bt.runs import RunResult


def print_end(done: RunResult, json_: bool) -> int:
    """Print a run's result on stdout and its errors on stderr.

    Args:
        done: The finished run.
        json_: Print only result.json with the run's folder on stdout.

    Returns:
        The exit code.
    """
    if json_:
        print_json({**done.result, "folder": str(done.folder)})
    else:
        print_result(done)
    for refused in done.unwritten:
        print_error(refused)
    if done.warning:
        print_error(done.warning)
    if done.outcome.error is not None:
        if showing_tracebacks():
            traceback.print_exception(done.outcome.error)
        print_error(f"{done.outcome.reasons[-1]}\nglotouch resume {done.folder}   continues from the last checkpoint")
    elif done.exit_code and json_:
        print_error(" <- ".join(done.outcome.reasons))
    return done.exit_code
