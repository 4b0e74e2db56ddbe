"""Real-time priority for a process that must wake every millisecond."""

from __future__ import annotations

import os

DRIVER_PRIORITY, DEVICES_PRIORITY = 20, 21
"""FIFO priorities. Simulated devices precede the driver, as real ones do. Far below the kernel's own (50)."""


def request_realtime(level: int) -> bool:
    """Request FIFO priority `level` for the calling thread and its children; return False if the system refuses.

    Without it a loaded machine wakes the process milliseconds late, and samples are missing. Linux grants it to root,
    and to others by an `rtprio` line in /etc/security/limits.conf.
    """
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(level))
    except (AttributeError, OSError):
        return False
    return True
