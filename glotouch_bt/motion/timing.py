"""Time profiles limited in speed, acceleration and jerk, computed with ruckig and sampled at the control period.

Only ruckig's local state-to-state solver is used: it ignores position limits, and way points need a web service.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import ruckig

from glotouch_bt.robot import Array, BackendError


@dataclass(frozen=True)
class Progress:
    """Progress along a path at the END of each control period; the last sample is at rest.

    Attributes:
        s: (n,) m.
        v: (n,) m/s.
        a: (n,) m/s2.
    """

    s: Array
    v: Array
    a: Array


SpeedSteps = tuple[tuple[float, float], ...]
"""Speed limits by place: pairs of a path coordinate, m, in ascending order, and the speed from there on, m/s."""


@dataclass(frozen=True)
class ProfileLimits:
    """Limits of a time profile: m/s, m/s2, m/s3 (for a joint move per s, s2, s3 of the fraction travelled).

    `speed_steps` replace the speed from their places on. The profile does not stop where the speed limit changes.
    """

    speed: float
    acceleration: float
    jerk: float
    speed_steps: SpeedSteps = ()

    def at_most(self, speed: float) -> ProfileLimits:
        """Return the same limits with every speed limited."""
        speed_steps = tuple((place, min(pace, speed)) for place, pace in self.speed_steps)
        return ProfileLimits(min(self.speed, speed), self.acceleration, self.jerk, speed_steps)

    def stretches(self, s0: float, s1: float) -> tuple[list[float], list[float]]:
        """Return the lengths and speed limits of the stretches between two coordinates, in order of travel."""
        low, high = min(s0, s1), max(s0, s1)
        places = [place for place, _ in self.speed_steps]
        marks = [low, *sorted({place for place in places if low < place < high}), high]
        speeds = [
            (self.speed, *(pace for _, pace in self.speed_steps))[bisect_right(places, mark)] for mark in marks[:-1]
        ]
        lengths = [b - a for a, b in pairwise(marks)]
        return (lengths, speeds) if s1 >= s0 else (lengths[::-1], speeds[::-1])


ACCELERATION_RETRIES = (1.0, 1.0 - 1e-6, 1.0 - 1e-4)
"""Fractions of the acceleration limit to try in turn. Ruckig's root finding fails by rounding where two profile types
meet: speed times jerk equals the acceleration squared. A slightly lower limit avoids it."""


def _solve(dof: int, target: ruckig.InputParameter) -> ruckig.Trajectory:
    acceleration = list(target.max_acceleration)
    failure: Exception | None = None
    for part in ACCELERATION_RETRIES:
        target.max_acceleration = [part * a for a in acceleration]
        trajectory = ruckig.Trajectory(dof)
        try:
            result = ruckig.Ruckig(dof).calculate(target, trajectory)
        except ruckig.RuckigError as e:
            failure = e
            continue
        if int(result) >= 0:
            return trajectory
        failure = None
    raise BackendError(f"ruckig found no profile for {target}") from failure


def rest_to_rest(length_m: float, speed: float, acceleration: float, jerk: float, period_s: float) -> Progress:
    """Return the fastest profile over `length_m` from rest to rest under limits (m/s, m/s2, m/s3).

    Raises:
        BackendError: Ruckig found no profile (a limit is not positive or not finite).
    """
    return between(0.0, length_m, ProfileLimits(speed, acceleration, jerk), period_s)


def _transfer_m(v0: float, v1: float, limits: ProfileLimits) -> float:
    """Return the least distance to change the speed from v0 to v1, without acceleration at both ends."""
    change, a, j = abs(v1 - v0), limits.acceleration, limits.jerk
    duration = change / a + a / j if change >= a * a / j else 2.0 * float(np.sqrt(change / j))
    return 0.5 * (v0 + v1) * duration


def _reachable(v0: float, v1: float, length: float, limits: ProfileLimits) -> float:
    """Return the speed nearest to v1 > v0 that can be reached from v0 within a length, by bisection."""
    if v1 <= v0 or _transfer_m(v0, v1, limits) <= length:
        return v1
    low, high = v0, v1
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _transfer_m(v0, middle, limits) <= length else (low, middle)
    return low


def _crossings(lengths: Sequence[float], speeds: Sequence[float], limits: ProfileLimits) -> list[float]:
    """Return the speed at each end of the stretches: the lower limit, or less where that cannot be reached."""
    out = [0.0, *(min(a, b) for a, b in pairwise(speeds)), 0.0]
    for k, length in enumerate(lengths):
        out[k + 1] = min(out[k + 1], _reachable(out[k], out[k + 1], length, limits))
    for k in range(len(lengths) - 1, -1, -1):
        out[k] = min(out[k], _reachable(out[k + 1], out[k], lengths[k], limits))
    return out


def stop(s: float, v: float, a: float, acceleration: float, jerk: float, period_s: float) -> Progress:
    """Return the fastest stop from progress `s`, speed `v` and acceleration `a` under limits (m/s2, m/s3)."""
    p = ruckig.InputParameter(1)
    p.control_interface = ruckig.ControlInterface.Velocity
    p.current_position, p.current_velocity, p.current_acceleration = [s], [v], [a]
    p.target_velocity, p.target_acceleration = [0.0], [0.0]
    p.max_acceleration, p.max_jerk = [acceleration], [jerk]
    trajectory = _solve(1, p)
    return _sample([trajectory], [trajectory.at_time(trajectory.duration)[0][0]], period_s)


def between(s0: float, s1: float, limits: ProfileLimits, period_s: float) -> Progress:
    """Return the fastest profile from rest at `s0` to rest at `s1`, forwards or backwards along the path.

    Raises:
        BackendError: Ruckig found no profile (a limit is not positive or not finite).
    """
    lengths, speeds = limits.stretches(s0, s1)
    crossings = _crossings(lengths, speeds, limits)
    parts: list[ruckig.Trajectory] = []
    for length, speed, begin, end in zip(lengths, speeds, crossings[:-1], crossings[1:], strict=True):
        p = ruckig.InputParameter(1)
        p.current_position, p.current_velocity = [0.0], [begin]
        p.target_position, p.target_velocity = [length], [end]
        p.max_velocity, p.max_acceleration, p.max_jerk = [speed], [limits.acceleration], [limits.jerk]
        parts.append(_solve(1, p))
    way = _sample(parts, lengths, period_s)
    sign = 1.0 if s1 >= s0 else -1.0
    s = s0 + sign * way.s
    s[-1] = s1
    return Progress(s, sign * way.v, sign * way.a)


def brake(progress: Progress, k: int, acceleration: float, jerk: float, period_s: float) -> Progress | None:
    """Return the fastest stop after period `k` of a profile; None if it is at rest there.

    Under the profile's own limits it ends before the profile does, which itself comes to rest under them.
    """
    s, v, a = (float(x[k]) for x in (progress.s, progress.v, progress.a))
    if v == 0.0 and a == 0.0:
        return None
    return stop(s, v, a, acceleration, jerk, period_s)


def _sample(parts: Sequence[ruckig.Trajectory], lengths: Sequence[float], period_s: float) -> Progress:
    """Sample trajectories over consecutive lengths, m, at the end of each period; the last sample is at rest."""
    ends = np.cumsum([part.duration for part in parts])
    begins, places = ends - [part.duration for part in parts], np.cumsum([0.0, *lengths])
    # The tolerance keeps rounding from adding a period to a whole number of periods.
    n = max(1, int(np.ceil(ends[-1] / period_s - 1e-9)))
    rows = np.zeros((n, 3))
    for k in range(1, n):
        i = min(int(np.searchsorted(ends, k * period_s)), len(parts) - 1)
        rows[k - 1] = np.ravel(parts[i].at_time(k * period_s - begins[i]))
        rows[k - 1, 0] += places[i]
    rows[-1] = places[-1], 0.0, 0.0
    return Progress(rows[:, 0].copy(), rows[:, 1].copy(), rows[:, 2].copy())


@dataclass(frozen=True)
class JointProfile:
    """Setpoints of a joint move at the END of each control period; the last sample is at rest.

    Attributes:
        start, way: (dof,) start and displacement, rad.
        share: Fraction travelled, 0 to 1.
        limits: Limits of the fraction.
        q, dq, ddq: (n, dof) rad, rad/s, rad/s2.
    """

    start: Array
    way: Array
    share: Progress
    limits: ProfileLimits
    q: Array
    dq: Array
    ddq: Array

    @classmethod
    def along(cls, start: Array, way: Array, share: Progress, limits: ProfileLimits) -> JointProfile:
        """Build the setpoints of a progress along the straight line from `start`."""
        q = start + share.s[:, None] * way
        if share.s[-1] == 1.0:
            q[-1] = start + way
        out = cls(start, way, share, limits, q, share.v[:, None] * way, share.a[:, None] * way)
        for array in (out.q, out.dq, out.ddq):
            array.setflags(write=False)
        return out


def joint_move(
    start: Array, end: Array, velocity: Array, acceleration: Array, jerk: Array, period_s: float
) -> JointProfile:
    """Return a straight joint-space move from rest to rest under per-joint limits (dof,), rad/s, rad/s2, rad/s3.

    One scalar profile under the tightest joint's limits keeps all joints exactly in phase, so the arm travels the line
    that was checked. Ruckig's own phase synchronisation can fail silently.

    Raises:
        BackendError: Ruckig found no profile.
    """
    way = end - start
    size = np.maximum(np.abs(way), 1e-12)
    v, a, j = (float((limit / size).min()) for limit in (velocity, acceleration, jerk))
    return JointProfile.along(start, way, rest_to_rest(1.0, v, a, j, period_s), ProfileLimits(v, a, j))
