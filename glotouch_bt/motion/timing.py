"""When a path is travelled: speed-, acceleration- and jerk-limited profiles from ruckig, sampled at the control period.

Only ruckig's local, state-to-state solutions are used: no position limits (the library ignores them) and no
intermediate positions (the library would ask a web service).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import ruckig

from glotouch_bt.robot import Array, BackendError


@dataclass(frozen=True)
class Progress:
    """How far along a path, at the END of each control period; the last sample is at rest.

    Attributes:
        s: (n,) m.
        v: (n,) m/s.
        a: (n,) m/s2.
    """

    s: Array
    v: Array
    a: Array


@dataclass(frozen=True)
class Pace:
    """The limits a way is travelled under: m/s, m/s2, m/s3 (of a joint move, shares of the way instead of metres)."""

    speed: float
    acceleration: float
    jerk: float


EASED = (1.0, 1.0 - 1e-6, 1.0 - 1e-4)
"""Parts of the acceleration tried. Where two sorts of profile meet (speed times jerk is exactly the acceleration
squared, and the way just long enough) the library's root finding fails by rounding; a hair beside it does not."""


def _solve(dof: int, target: ruckig.InputParameter) -> ruckig.Trajectory:
    acceleration = list(target.max_acceleration)
    failure: Exception | None = None
    for part in EASED:
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


def _periods(duration_s: float, period_s: float) -> int:
    # A whole number of periods must not gain one from rounding.
    return max(1, int(np.ceil(duration_s / period_s - 1e-9)))


def rest_to_rest(length_m: float, speed: float, acceleration: float, jerk: float, period_s: float) -> Progress:
    """Fastest travel of `length_m` from rest to rest under limits (m/s, m/s2, m/s3).

    Raises:
        BackendError: Ruckig found no profile (a limit is not positive or not finite).
    """
    p = ruckig.InputParameter(1)
    p.current_position, p.target_position = [0.0], [length_m]
    p.max_velocity, p.max_acceleration, p.max_jerk = [speed], [acceleration], [jerk]
    trajectory = _solve(1, p)
    return _sample(trajectory, period_s, length_m)


def stop(s: float, v: float, a: float, acceleration: float, jerk: float, period_s: float) -> Progress:
    """Fastest halt from progress `s` with speed `v` and acceleration `a`, under the given deceleration and jerk."""
    p = ruckig.InputParameter(1)
    p.control_interface = ruckig.ControlInterface.Velocity
    p.current_position, p.current_velocity, p.current_acceleration = [s], [v], [a]
    p.target_velocity, p.target_acceleration = [0.0], [0.0]
    p.max_acceleration, p.max_jerk = [acceleration], [jerk]
    trajectory = _solve(1, p)
    return _sample(trajectory, period_s, trajectory.at_time(trajectory.duration)[0][0])


def between(s0: float, s1: float, pace: Pace, period_s: float) -> Progress:
    """Fastest travel from rest at `s0` to rest at `s1`, forwards or backwards along the way."""
    way = rest_to_rest(abs(s1 - s0), pace.speed, pace.acceleration, pace.jerk, period_s)
    sign = 1.0 if s1 >= s0 else -1.0
    s = s0 + sign * way.s
    s[-1] = s1
    return Progress(s, sign * way.v, sign * way.a)


def brake(progress: Progress, k: int, pace: Pace, period_s: float) -> Progress | None:
    """From period `k` of a travel under `pace` to rest under the same limits; None if it is at rest there.

    The rest of the travel ends at rest under these limits, so that the fastest halt ends before it does.
    """
    s, v, a = (float(x[k]) for x in (progress.s, progress.v, progress.a))
    if v == 0.0 and a == 0.0:
        return None
    return stop(s, v, a, pace.acceleration, pace.jerk, period_s)


def _sample(trajectory: ruckig.Trajectory, period_s: float, end: float) -> Progress:
    n = _periods(trajectory.duration, period_s)
    rows = np.array([trajectory.at_time(k * period_s) for k in range(1, n)]).reshape(-1, 3)
    rows = np.vstack([rows, [end, 0.0, 0.0]])
    return Progress(rows[:, 0].copy(), rows[:, 1].copy(), rows[:, 2].copy())


@dataclass(frozen=True)
class JointProfile:
    """A joint move at the END of each control period; the last sample is at rest.

    Attributes:
        start, way: (dof,) where it begins and what it travels, rad.
        share: Share of the way, 0 to 1.
        pace: Limits of the share.
        q, dq, ddq: (n, dof) rad, rad/s, rad/s2.
    """

    start: Array
    way: Array
    share: Progress
    pace: Pace
    q: Array
    dq: Array
    ddq: Array

    @classmethod
    def along(cls, start: Array, way: Array, share: Progress, pace: Pace) -> JointProfile:
        """Setpoints of a progress along the way."""
        q = start + share.s[:, None] * way
        if share.s[-1] == 1.0:
            q[-1] = start + way
        out = cls(start, way, share, pace, q, share.v[:, None] * way, share.a[:, None] * way)
        for array in (out.q, out.dq, out.ddq):
            array.setflags(write=False)
        return out


def joint_move(
    start: Array, end: Array, velocity: Array, acceleration: Array, jerk: Array, period_s: float
) -> JointProfile:
    """Straight line in joint space from rest to rest under per-joint limits (dof,), rad/s, rad/s2, rad/s3.

    One profile of the share of the way, 0 to 1, whose limits are the tightest joint's: the joints are exactly in phase,
    so the line that was checked is the line that is travelled (ruckig's own phase synchronisation silently gives up).

    Raises:
        BackendError: Ruckig found no profile.
    """
    way = end - start
    size = np.maximum(np.abs(way), 1e-12)
    v, a, j = (float((limit / size).min()) for limit in (velocity, acceleration, jerk))
    return JointProfile.along(start, way, rest_to_rest(1.0, v, a, j, period_s), Pace(v, a, j))
