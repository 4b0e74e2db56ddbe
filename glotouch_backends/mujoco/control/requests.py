"""Pending tare and payload requests, advanced by the robot once a period."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from glotouch_bt.robot import Array, PendingTicket, SetPayload, Tare

PAYLOAD_S = 0.05
"""Duration of a payload request. Source: ours."""


@dataclass
class PendingTare:
    """Average of samples until the duration has passed."""

    request: Tare
    periods: int
    ticket: PendingTicket = field(default_factory=PendingTicket)
    total: Array = field(default_factory=lambda: np.zeros(6))
    samples: int = 0

    def add(self, block: Array) -> bool:
        """Add a block (n, 6) of untared samples; return True when there are enough."""
        self.total += block.sum(axis=0)
        self.samples += len(block)
        self.periods -= 1
        return self.periods <= 0

    @property
    def mean(self) -> Array:
        """Mean (6,) of all samples so far."""
        return self.total / self.samples


@dataclass
class PendingPayload:
    """Payload that the controller is switching to."""

    request: SetPayload
    periods: int
    ticket: PendingTicket = field(default_factory=PendingTicket)
