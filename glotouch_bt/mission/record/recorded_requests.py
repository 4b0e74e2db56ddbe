"""Record start and end of slow requests (tare, payload), because a replay has no device to finish them."""

from __future__ import annotations

from collections.abc import Callable

from glotouch_bt.mission.record.mcap_json import to_json
from glotouch_bt.robot import Request, Ticket
from glotouch_bt.skill import Journal, RobotRequests

REQUEST, REQUEST_DONE = "request", "request_done"


class RecordedRequests:
    """Forward requests to a robot; record when each one starts and when it is first seen to be done.

    Args:
        requests: The robot.
        journal: Receives the events.
        now_s: Returns the robot clock.

    Attributes:
        count: Requests so far.
    """

    def __init__(self, requests: RobotRequests, journal: Journal, now_s: Callable[[], float]) -> None:
        self._requests, self._journal, self._now_s = requests, journal, now_s
        self.count = 0

    def start(self, request: Request) -> Ticket:
        """Start a request; see `Robot.start`."""
        number, self.count = self.count, self.count + 1
        asked = {"number": number, "request": type(request).__name__, "values": to_json(request)}
        self._journal.event(REQUEST, self._now_s(), asked)
        ticket = self._requests.start(request)
        return _RecordedTicket(ticket, lambda error: self._done(number, error))

    def _done(self, number: int, error: str | None) -> None:
        self._journal.event(REQUEST_DONE, self._now_s(), {"number": number, "error": error})


class _RecordedTicket:
    def __init__(self, ticket: Ticket, on_done: Callable[[str | None], None]) -> None:
        self._ticket, self._on_done = ticket, on_done
        self._reported = False

    @property
    def done(self) -> bool:
        """True once the robot has done it."""
        done = self._ticket.done
        if done and not self._reported:
            self._reported = True
            self._on_done(self._ticket.error)
        return done

    @property
    def error(self) -> str | None:
        """The robot's error, if it failed."""
        return self._ticket.error
