"""Wait for a slow request without blocking a tick."""

from __future__ import annotations

from glotouch_bt.robot import HOLD, Ticket
from glotouch_bt.skill import Failure, SkillRun

TIMEOUT_PERIODS = 500
"""Longest wait for a request, in control periods."""
REQUEST_FAILED = Failure(
    "request_failed",
    "the device did not zero the sensor or set the payload",
    advice="see the device's own log; the skill may be tried again",
)


def finish(ticket: Ticket, what: str) -> SkillRun:
    """Hold the arm until `ticket` is done.

    Raises:
        SkillFailed: `request_failed` if it fails or takes more than 500 control periods.
    """
    for _ in range(TIMEOUT_PERIODS):
        if ticket.done:
            break
        yield HOLD
    if not ticket.done or ticket.error:
        raise REQUEST_FAILED(f"{what} did not finish: {ticket.error or 'timed out'}", limit_periods=TIMEOUT_PERIODS)
