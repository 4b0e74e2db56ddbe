"""Progress of a campaign on stderr: a live table on a terminal, one line a trial elsewhere."""

from __future__ import annotations

import sys
import time
from collections import deque
from collections.abc import Callable
from types import TracebackType
from typing import Any

from rich.live import Live
from rich.markup import escape
from rich.table import Table

from glotouch_bt.commands.terminal.console import EscapingConsole

LAST = 8
"""Number of trials in the live table."""


class CampaignProgress:
    """Shows each trial, and how the campaign goes; call it with (row, trials done, trials in all).

    Args:
        describe_row: Returns the line of a row.
        succeeded: Returns True for a row that counts as a success; None: no rate of success is shown.
    """

    def __init__(self, describe_row: Callable[[Any], str], succeeded: Callable[[Any], bool] | None = None) -> None:
        self._describe_row, self._succeeded = describe_row, succeeded
        self._began = time.perf_counter()
        self._rows = self._good = 0
        self._last: deque[tuple[int, str]] = deque(maxlen=LAST)
        self._live: Live | None = None

    def __enter__(self) -> CampaignProgress:
        console = EscapingConsole(stderr=True)
        if console.is_terminal:
            # Other writers are not redirected: rich would execute their escape sequences.
            self._live = Live(
                console=console, transient=True, auto_refresh=False, redirect_stdout=False, redirect_stderr=False
            )
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._live is not None:
            self._live.stop()

    def __call__(self, row: Any, done: int, total: int) -> None:
        """Show a row that this command has made, after `done - 1` others of `total`."""
        self._rows += 1
        self._good += self._succeeded is not None and self._succeeded(row)
        line = self._describe_row(row)
        if self._live is None:
            sys.stderr.write(f"[{done}/{total}{self._rest(done, total)}] {line}\n")
            return
        self._last.append((done, line))
        table = Table(title=self.state(done, total), title_justify="left", show_edge=False, show_header=False)
        for number, text in self._last:
            table.add_row(str(number), escape(text))
        self._live.update(table, refresh=True)

    def state(self, done: int, total: int) -> str:
        """Return trials done, rate, expected rest, and the rate of success with its interval, in words."""
        from glotouch_bt.bench import wilson

        took_s = time.perf_counter() - self._began
        parts = [f"{done} of {total} trials", f"{60 * self._rows / took_s:.1f} a minute"]
        parts.append(self._rest(done, total).removeprefix(", ") or "done")
        if self._succeeded is not None:
            r = wilson(self._good, self._rows)
            parts.append(f"success {r['rate']:.0%} ({r['lo']:.0%} .. {r['hi']:.0%}) of {r['n']} in this command")
        return ", ".join(parts)

    def _rest(self, done: int, total: int) -> str:
        """Return the expected rest, from the mean time of the trials of this command; empty at the end."""
        rest_s = (time.perf_counter() - self._began) / self._rows * (total - done)
        if rest_s < 1.0:
            return ""
        hours, minutes = divmod(int(rest_s / 60.0 + 0.5), 60)
        if hours:
            return f", {hours} h {minutes:02d} min left"
        return f", {minutes} min left" if rest_s >= 90.0 else f", {rest_s:.0f} s left"
