"""Standard streams that survive a reader that has gone: a closed pipe (`| head`) or terminal must not end a mission.

Text for a closed pipe, a hung-up terminal or a stream that was never open is dropped. Any other refusal of stdout (a
full disk) is reported when the command has ended.
"""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, TextIO

from glotouch_bt.json_text import json_text

GONE = (errno.EPIPE, errno.EIO)
"""Errors of a pipe without a reader, and of a terminal that was hung up."""


class TolerantStream:
    """A text stream that never raises, whatever its encoding. All but writing is the wrapped stream's own.

    Args:
        stream: Stream to write to; None discards everything.

    Attributes:
        lost: The error of a stream that still exists but refused the text, or None.
    """

    def __init__(self, stream: TextIO | None) -> None:
        self._stream = stream if stream is not None else open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
        self.lost: OSError | None = None

    def write(self, text: str) -> int:
        """Write text; escape the characters that the encoding lacks."""
        encoding = self._stream.encoding or "utf-8"
        with self._errors_noted():
            self._stream.write(text.encode(encoding, "backslashreplace").decode(encoding))
        return len(text)

    def flush(self) -> None:
        """Flush the stream."""
        with self._errors_noted():
            self._stream.flush()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    @contextmanager
    def _errors_noted(self) -> Iterator[None]:
        try:
            yield
        except OSError as e:
            if e.errno not in GONE:
                self.lost = e
            with suppress(OSError, ValueError):  # discard the rest, and the text still buffered
                nowhere = os.open(os.devnull, os.O_WRONLY)
                os.dup2(nowhere, self._stream.fileno())
                os.close(nowhere)


@contextmanager
def tolerant_streams() -> Iterator[TolerantStream]:
    """Replace stdout (yielded) and stderr by tolerant streams while the block runs."""
    before = sys.stdout, sys.stderr
    out, err = TolerantStream(sys.stdout), TolerantStream(sys.stderr)
    sys.stdout, sys.stderr = out, err
    try:
        yield out
    finally:
        out.flush()
        err.flush()
        sys.stdout, sys.stderr = before


def print_json(data: object) -> None:
    """Print JSON on stdout."""
    sys.stdout.write(json_text(data, default=str))
