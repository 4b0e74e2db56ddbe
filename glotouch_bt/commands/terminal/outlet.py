"""What is printed while nobody may be listening: a reader that has gone takes no mission with it.

What is written to a closed pipe (`| head`), to a terminal that was hung up or to a stream that was never open goes
nowhere. A stdout that cannot take its result (a full disk) is told when the command has ended.
"""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, TextIO

GONE = (errno.EPIPE, errno.EIO)
"""A pipe without a reader; a terminal that was hung up."""


class Outlet:
    """A text stream that never raises, whatever its encoding; everything but writing is the stream's own.

    Args:
        stream: Where to; None: nowhere.

    Attributes:
        lost: What was refused by something that still is there, or None.
    """

    def __init__(self, stream: TextIO | None) -> None:
        self._stream = stream if stream is not None else open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
        self.lost: OSError | None = None

    def write(self, text: str) -> int:
        """Pass on what can be."""
        encoding = self._stream.encoding or "utf-8"
        with self._heeded():
            self._stream.write(text.encode(encoding, "backslashreplace").decode(encoding))
        return len(text)

    def flush(self) -> None:
        """Pass on what can be."""
        with self._heeded():
            self._stream.flush()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    @contextmanager
    def _heeded(self) -> Iterator[None]:
        try:
            yield
        except OSError as e:
            if e.errno not in GONE:
                self.lost = e
            with suppress(OSError, ValueError):  # from now on nowhere, with what the stream still holds
                nowhere = os.open(os.devnull, os.O_WRONLY)
                os.dup2(nowhere, self._stream.fileno())
                os.close(nowhere)


@contextmanager
def outlets() -> Iterator[Outlet]:
    """stdout (given) and stderr that never raise, while the block runs."""
    before = sys.stdout, sys.stderr
    out, err = Outlet(sys.stdout), Outlet(sys.stderr)
    sys.stdout, sys.stderr = out, err
    try:
        yield out
    finally:
        out.flush()
        err.flush()
        sys.stdout, sys.stderr = before
