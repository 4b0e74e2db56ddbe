"""Detection of rest after a stop."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from glotouch_bt.robot import Observation


def settled(
    observations: Sequence[Observation], *, speed_m_s: float = 0.002, force_N: float = 0.1, torque_Nm: float = 0.02
) -> bool:
    """Return True if wrench and position are stable over all given blocks (paper III-A); False for fewer than two.

    The tool moves slower than `speed_m_s`, and the mean wrenches of both halves differ by at most `force_N` and
    `torque_Nm`.
    """
    if len(observations) < 2:
        return False
    stamps = np.concatenate([o.stamp_s for o in observations])
    positions = np.concatenate([o.position_B_P for o in observations])
    wrenches = np.concatenate([o.wrench_S for o in observations])
    span = float(stamps[-1] - stamps[0])
    if span <= 0 or float(np.max(np.linalg.norm(positions - positions[0], axis=1))) > speed_m_s * span:
        return False
    half = len(wrenches) // 2
    change = np.mean(wrenches[half:], axis=0) - np.mean(wrenches[:half], axis=0)
    return bool(np.linalg.norm(change[:3]) <= force_N and np.linalg.norm(change[3:]) <= torque_Nm)
