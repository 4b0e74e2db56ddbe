"""What can go wrong in the driver, as values the client can turn into its own errors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from .messages import ArmEvent


class DeviceFault(Exception):
    """A device does not work.

    Args:
        kind: connect (did not come up), fault (the arm's own fault), state (reduced, recovery, stopped by a person),
            link (lost), stale (repeats old readings), vendor (a call failed), world (a simulation failed).
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


class CommandRefused(Exception):
    """A command breaks a rule; nothing was sent."""

    def __init__(self, name: str, value: object, rule: str) -> None:
        super().__init__(f"{name} = {value!r}: must be {rule}")
        self.name, self.value, self.rule = name, value, rule


@contextmanager
def vendor_call(what: str, kind: str = "vendor") -> Iterator[None]:
    """Map whatever a vendor's call raises (their interfaces raise bare Exceptions too), chained."""
    try:
        yield
    except (DeviceFault, CommandRefused):
        raise
    except Exception as e:
        raise DeviceFault(kind, f"{what} failed: {type(e).__name__}: {e}") from e
