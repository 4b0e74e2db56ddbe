"""Slow requests under way: tare and payload, advanced by the robot once a period."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from glotouch_bt.robot import Array, SetPayload, Tare

PAYLOAD_S = 0.05  # what switching the payload takes


@dataclass
class PendingTicket:
    """A `Ticket` the robot completes."""

    done: bool = False
    error: str | None = None


@dataclass
class PendingTare:
    """Collects samples until its duration has passed."""

    request: Tare
    periods: int
    ticket: PendingTicket = field(default_factory=PendingTicket)
    total: Array = field(default_factory=lambda: np.zeros(6))
    samples: int = 0

    def add(self, block: Array) -> bool:
        """Take a block (n, 6) of untared samples; True when there are enough."""
        self.total += block.sum(axis=0)
        self.samples += len(block)
        self.periods -= 1
        return self.periods <= 0

    @property
    def mean(self) -> Array:
        """(6,) of all samples so far."""
        return self.total / self.samples


@dataclass
class PendingPayload:
    """Waits until the controller has switched."""

    request: SetPayload
    periods: int
    ticket: PendingTicket = field(default_factory=PendingTicket)
