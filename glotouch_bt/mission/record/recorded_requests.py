"""Slow requests (tare, payload) with their beginning and end on the record: a replay sees no device finish them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

from glotouch_bt.mission.record.mcap_json import to_json
from glotouch_bt.robot import Request, Ticket
from glotouch_bt.skill import RobotRequests

REQUEST, REQUEST_DONE = "request", "request_done"


class Events(Protocol):
    """Where the events go."""

    def event(self, kind: str, stamp_s: float, data: Mapping[str, object]) -> None:
        """One event."""
        ...


class RecordedRequests:
    """Passes requests on to a robot; events say when each was started and when it was first seen to be done.

    Args:
        requests: The robot.
        events: Where the events go.
        now_s: The robot's clock.

    Attributes:
        count: Requests so far.
    """

    def __init__(self, requests: RobotRequests, events: Events, now_s: Callable[[], float]) -> None:
        self._requests, self._events, self._now_s = requests, events, now_s
        self.count = 0

    def start(self, request: Request) -> Ticket:
        """Begin a request; see `Robot.start`."""
        number, self.count = self.count, self.count + 1
        asked = {"number": number, "request": type(request).__name__, "values": to_json(request)}
        self._events.event(REQUEST, self._now_s(), asked)
        ticket = self._requests.start(request)
        return _JournaledTicket(ticket, lambda error: self._done(number, error))

    def _done(self, number: int, error: str | None) -> None:
        self._events.event(REQUEST_DONE, self._now_s(), {"number": number, "error": error})


class _JournaledTicket:
    def __init__(self, ticket: Ticket, on_done: Callable[[str | None], None]) -> None:
        self._ticket, self._on_done = ticket, on_done
        self._told = False

    @property
    def done(self) -> bool:
        """As the robot says."""
        done = self._ticket.done
        if done and not self._told:
            self._told = True
            self._on_done(self._ticket.error)
        return done

    @property
    def error(self) -> str | None:
        """As the robot says."""
        return self._ticket.error
