"""Errors of the driver, with the data from which the client makes its own errors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from .messages import ArmEvent, Failed


class DeviceFault(Exception):
    """A device failed.

    Args:
        kind: connect (did not come up), fault (the arm reports a fault), state (reduced, recovery, stopped by a
            person), link (lost), stale (old readings), vendor (a call failed), world (a simulation failed), input (the
            world of a simulation cannot be built).
        message: What happened and what was expected.
        events: The arm's event log.
        age_s, limit_s: For a stale reading.
    """

    def __init__(
        self, kind: str, message: str, events: Sequence[ArmEvent] = (), *, age_s: float = 0.0, limit_s: float = 0.0
    ) -> None:
        super().__init__(message)
        self.kind, self.message, self.events = kind, message, tuple(events)
        self.age_s, self.limit_s = age_s, limit_s

    def answer(self, number: int) -> Failed:
        """Return the message that reports this fault as the answer to a request."""
        cause = "" if self.__cause__ is None else f"{type(self.__cause__).__name__}: {self.__cause__}"
        return Failed(
            number=number,
            kind=self.kind,
            message=self.message,
            cause=cause,
            events=self.events,
            age_s=self.age_s,
            limit_s=self.limit_s,
        )


class CommandRefused(Exception):
    """A command is invalid; nothing was sent."""

    def __init__(self, name: str, value: object, rule: str) -> None:
        super().__init__(f"{name} = {value!r}: must be {rule}")
        self.name, self.value, self.rule = name, value, rule


@contextmanager
def vendor_call(what: str, kind: str = "vendor") -> Iterator[None]:
    """Convert any exception of a vendor's call (they raise bare Exceptions too) to a DeviceFault, chained."""
    try:
        yield
    except (DeviceFault, CommandRefused):
        raise
    except Exception as e:
        raise DeviceFault(kind, f"{what} failed: {type(e).__name__}: {e}") from e
