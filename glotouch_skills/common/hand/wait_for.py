"""Wait for slow requests (payload, tare) without blocking a tick."""

from __future__ import annotations

import numpy as np

from glotouch_bt.robot import HOLD, SetPayload, Tare, Ticket
from glotouch_bt.skill import Context, Failure, SkillRun

TIMEOUT_PERIODS = 500
"""Longest wait for a request, in control periods."""
REQUEST_FAILED = Failure(
    "request_failed",
    "the device did not zero the sensor or set the payload",
    advice="see the device's own log; the skill may be tried again",
)

WRIST_STATES = frozenset({"untared", "tared", "stale"})
"""Every state of the wrist sensor: precondition of skills that set its state whatever it was."""


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


def set_payload_and_tare(context: Context, mass_kg: float = 0.0, com_below_P_m: float = 0.0) -> SkillRun:
    """Set the payload (default: the empty hand), stand still for 0.2 s, and tare.

    Raises:
        SkillFailed: `request_failed`.
    """
    payload = SetPayload(mass_kg, np.array([0.0, 0.0, com_below_P_m]))
    yield from finish(context.requests.start(payload), "payload")
    yield from context.arm.hold(0.2)
    yield from finish(context.requests.start(Tare()), "tare")
