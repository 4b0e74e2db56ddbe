"""After a stop: has the wrist come to rest, and which way does what it touches push?"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from glotouch_bt.perception.touch.detection.baseline import Baseline
from glotouch_bt.robot import Array, Observation, ParamError


def reaction_direction(wrench_S: Array, baseline: Baseline, R_B_S: Array) -> Array:
    """Unit direction (3,) in B of the mean contact force over a settled block of wrenches (n, 6).

    Taken in the hold after a stop it is free of the impact's inertia (paper III-B, the direction r).

    Raises:
        ParamError: The mean force is no larger than its own uncertainty: there is no contact to speak of.
    """
    w = np.asarray(wrench_S, dtype=np.float64)
    mean = np.mean(w[:, :3], axis=0) - baseline.median[:3]
    norm = float(np.linalg.norm(mean))
    least = 3.0 * float(np.linalg.norm(baseline.sd[:3])) / math.sqrt(len(w))
    if norm <= max(least, 1e-9):
        raise ParamError("wrench_S", norm, f"a mean force above {least:.3g} N, else it has no direction")
    return np.asarray(R_B_S @ (mean / norm))


def settled(
    observations: Sequence[Observation],
    *,
    speed_m_s: float = 0.002,
    force_N: float = 0.1,
    torque_Nm: float = 0.02,
) -> bool:
    """True once wrench and twist have returned to a stable interval (paper III-A): judged over all given blocks.

    The tool must have moved slower than `speed_m_s`, and the mean wrench of the first and the last half may differ by
    no more than `force_N` and `torque_Nm` (means, so that white noise does not count). Fewer than two blocks: False.
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
