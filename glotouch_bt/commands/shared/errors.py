"""Turn every error of a command into one message on stderr and an exit code.

0 done; 1 the mission failed; 2 bad input; 3 a safety stop, backend failure or internal error; 130 Ctrl-C.
"""

from __future__ import annotations

import functools
import sys
import traceback
from collections.abc import Callable
from typing import ParamSpec

import typer

from glotouch_bt.commands.shared.output import tolerant_streams

P = ParamSpec("P")
_debug: list[bool] = []


def set_debug() -> None:
    """Show the traceback of every error from now on."""
    _debug.append(True)


def showing_tracebacks() -> bool:
    """Return True after `set_debug`."""
    return bool(_debug)


def guarded(command: Callable[P, int | None]) -> Callable[P, None]:
    """Make a command print one message on stderr and exit with a code on every error."""

    @functools.wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        from glotouch_bt.robot import BadInput, GlotouchError, MissionFailed

        with tolerant_streams() as stdout:
            try:
                code = command(*args, **kwargs) or 0
            except KeyboardInterrupt:
                code = _fail(130, "interrupted")
            except BadInput as e:
                code = _fail(2, str(e))
            except MissionFailed as e:
                code = _fail(1, str(e))
            except GlotouchError as e:
                code = _fail(3, str(e))
            except Exception as e:
                code = _fail(3, f"internal error: {type(e).__name__}: {e} (--debug shows where)")
            stdout.flush()
            if stdout.lost is not None:
                refused = _fail(3, f"stdout could not be written ({stdout.lost.strerror})")
                code = code or refused
        if code:
            raise typer.Exit(code)

    return run


def _fail(code: int, message: str) -> int:
    if showing_tracebacks():
        traceback.print_exc()
    sys.stderr.write(f"glotouch: {message}\n")
    return code
