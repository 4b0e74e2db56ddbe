"""The end of a run on the terminal, and the exit code it gives; the same whether it was begun or gone on with."""

from __future__ import annotations

import json
import sys
import traceback

from glotouch_bt.commands.terminal import console
from glotouch_bt.commands.terminal.errors import showing_tracebacks
from glotouch_bt.run import RunResult


def tell_end(done: RunResult, json_: bool) -> int:
    """Print a run's result on stdout and what went wrong on stderr.

    Args:
        done: The run.
        json_: Only result.json and the run's folder on stdout.

    Returns:
        The exit code.
    """
    if json_:
        sys.stdout.write(json.dumps({**done.result, "folder": str(done.folder)}, indent=2, allow_nan=False) + "\n")
    else:
        console.print_result(done)
    for refused in done.unwritten:
        console.print_error(refused)
    if done.warning:
        console.print_error(done.warning)
    if done.outcome.error is not None:
        if showing_tracebacks():
            traceback.print_exception(done.outcome.error)
        console.print_error(
            f"{done.outcome.reasons[-1]}\nglotouch resume {done.folder}   goes on from the last checkpoint"
        )
    elif done.exit_code and json_:
        console.print_error(" <- ".join(done.outcome.reasons))
    return done.exit_code
