"""Standard streams of a command: escape sequences are shown, not executed, and a closed pipe is no error.

A closed pipe (`| head`) or terminal must not end a mission. Text for it, or for a stream that was never open, is
dropped. Any other refusal of stdout (a full disk) is reported when the command has ended.
"""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, TextIO

from glotouch_bt.escaped_text import json_text, visible

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


RESET = "\x1b[0m"
"""Ends all styles. colorama, which a dependency imports, writes just this when the program ends; it does no harm."""


class EscapedStream:
    """A text stream that shows control characters instead of sending them. All but writing is the inner stream's own.

    Args:
        styled: The stream to write to.

    Attributes:
        styled: The same stream, for programs that colour their own text and escape what is not theirs.
    """

    def __init__(self, styled: TolerantStream) -> None:
        self.styled = styled

    @property
    def rich_proxied_file(self) -> TolerantStream:
        """The stream that rich writes to; `terminal.console` escapes its text before it is coloured."""
        return self.styled

    def write(self, text: str) -> int:
        """Write text; show control characters as escapes."""
        self.styled.write(text if text == RESET else visible(text))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.styled, name)


@contextmanager
def tolerant_streams() -> Iterator[TolerantStream]:
    """Replace stdout (yielded) and stderr by tolerant, escaped streams while the block runs."""
    before = sys.stdout, sys.stderr
    out, err = TolerantStream(sys.stdout), TolerantStream(sys.stderr)
    sys.stdout, sys.stderr = EscapedStream(out), EscapedStream(err)
    try:
        yield out
    finally:
        out.flush()
        err.flush()
        sys.stdout, sys.stderr = before


@contextmanager
def styled_streams() -> Iterator[None]:
    """Let a trusted program write to the terminal as it likes while the block runs."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (getattr(stream, "styled", stream) for stream in before)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


def print_json(data: object) -> None:
    """Print JSON on stdout."""
    sys.stdout.write(json_text(data, default=str))
