"""A whole motion worked out before its first command: setpoints of every control period, and how to break off.

Joint positions are solved at knots at most 5 mm apart along the path and joined by a cubic spline q(s) in the path
length (twice continuously differentiable, end slopes from the Jacobian), so each setpoint's velocity and acceleration
are exact derivatives of what is commanded: dq = q' v, ddq = q'' v^2 + q' a. Because the null space is a function of s
as well, a posture pull starts and ends as softly as the motion itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from glotouch_bt.motion.kinematics import Kinematics, known_pose
from glotouch_bt.motion.paths import Piece, quats_to_matrices
from glotouch_bt.motion.timing import Pace, Progress, between, brake, rest_to_rest, stop
from glotouch_bt.robot import Array, JointSetpoint, MotionRefused

KNOT_SPACING_M = 0.005
# Further from the path than this before correction, the arm does not follow any more (a singularity, or out of reach).
_LOST_M = 1e-3


@dataclass(frozen=True)
class Plan:
    """Setpoints of one smooth piece, one per control period.

    Attributes:
        piece: The path.
        progress: Path length, speed and acceleration per period.
        knots_q: (k, dof) solved postures along the path; what clearance is checked at.
        knots_s: (k,) where they are, m.
        pace: The limits along the path.
        q, dq, ddq: (n, dof) setpoints.
        position_m, quat: (n, 3), (n, 4) poses of P in B.
    """

    piece: Piece
    progress: Progress
    knots_q: Array
    knots_s: Array
    spline: CubicSpline
    pace: Pace
    q: Array
    dq: Array
    ddq: Array
    position_m: Array
    quat: Array

    def __len__(self) -> int:
        return len(self.q)

    def setpoint(self, k: int) -> JointSetpoint:
        """Setpoint of the k-th period."""
        return JointSetpoint(self.q[k], self.dq[k], self.ddq[k], known_pose(self.position_m[k], self.quat[k]))

    def halt(self, k: int, acceleration: float, jerk: float, period_s: float) -> Plan | None:
        """What to command after period `k` to come to rest on the path as fast as the limits (m/s2, m/s3) allow.

        None when the plan is at rest there.
        """
        p = self.progress
        if p.v[k] == 0.0 and p.a[k] == 0.0:
            return None
        return self._timed(stop(p.s[k], p.v[k], p.a[k], acceleration, jerk, period_s))

    def brake(self, k: int, period_s: float) -> Plan | None:
        """What to command after period `k` to come to rest on the path as softly as it is travelled; None at rest."""
        progress = brake(self.progress, k, self.pace, period_s)
        return None if progress is None else self._timed(progress)

    def between(self, s0: float, s1: float, period_s: float, max_m_s: float = np.inf) -> Plan:
        """From rest to rest along this path, m, forwards or backwards, at its own pace or at most `max_m_s`."""
        pace = Pace(min(self.pace.speed, max_m_s), self.pace.acceleration, self.pace.jerk)
        return self._timed(between(s0, s1, pace, period_s))

    def _timed(self, progress: Progress) -> Plan:
        return _along(self.piece, self.knots_s, self.knots_q, self.spline, self.pace, progress)


def plan_piece(
    kinematics: Kinematics,
    piece: Piece,
    q_start: Array,
    *,
    speed_m_s: float,
    acceleration_m_s2: float,
    jerk_m_s3: float,
    period_s: float,
    posture_gain: float,
    what: str,
) -> Plan:
    """Plan one smooth piece from rest at `q_start` (dof,) to rest.

    Args:
        kinematics: The arm.
        piece: The path; it must begin where P is at `q_start`.
        q_start: (dof,) rad.
        speed_m_s, acceleration_m_s2, jerk_m_s3: Limits along the path. In an arc the speed is lowered so that the
            centripetal acceleration stays below the limit as well.
        period_s: Control period.
        posture_gain: Null-space pull towards home, per metre; 0 gives the smallest joint motion.
        what: Named in the error.

    Raises:
        MotionRefused: The path leaves the arm's reach, a joint its range, or a joint's speed its limit.
    """
    length = piece.length_m
    s, q, tangents = _knots(kinematics, piece, q_start, posture_gain, what)
    out = (q < kinematics.lower) | (q > kinematics.upper)
    if out.any():
        k, i = (int(v) for v in np.argwhere(out)[0])
        joint = kinematics.description.joints[i]
        raise MotionRefused(
            what,
            f"{joint.name} would leave its range (to {q[k, i]:.3f} rad, valid "
            f"{joint.lower_rad:.3f}..{joint.upper_rad:.3f}) {s[k] * 1e3:.0f} mm along the path",
        )
    if piece.bend_1_m > 0:
        speed_m_s = min(speed_m_s, float(np.sqrt(acceleration_m_s2 / piece.bend_1_m)))
    progress = rest_to_rest(length, speed_m_s, acceleration_m_s2, jerk_m_s3, period_s)
    spline = CubicSpline(s, q, bc_type=((1, tangents[0]), (1, tangents[-1])))
    pace = Pace(speed_m_s, acceleration_m_s2, jerk_m_s3)
    plan = _along(piece, s, q, spline, pace, progress)
    share = np.abs(plan.dq) / kinematics.velocity
    k, i = divmod(int(np.argmax(share)), share.shape[1])
    if share[k, i] > 1.0:
        joint = kinematics.description.joints[i]
        raise MotionRefused(
            what,
            f"{joint.name} would turn at {abs(plan.dq[k, i]):.2f} rad/s (limit {joint.velocity_rad_s:.2f}) "
            f"{progress.s[k] * 1e3:.0f} mm along the path; go slower",
        )
    return plan


def _knots(
    kinematics: Kinematics, piece: Piece, q_start: Array, posture_gain: float, what: str
) -> tuple[Array, Array, Array]:
    """Knots (k,) m, postures (k, dof) and tangents dq/ds (k, dof): Adams-Bashforth predictor, one Newton correction."""
    n = max(2, int(np.ceil(piece.length_m / KNOT_SPACING_M)))
    s = np.linspace(0.0, piece.length_m, n + 1)
    h = float(s[1])
    position, quat = piece.sample(s)
    rotation, twist = quats_to_matrices(quat), piece.twist(s)
    q = np.zeros((n + 1, len(q_start)))
    slope = np.zeros_like(q)
    q[0] = q_start
    slope[0] = kinematics.flow(position[0], rotation[0], q[0], twist[0], posture_gain)[1]
    # Heun's rule gives the first step the second order that the later ones have.
    ahead = kinematics.flow(position[1], rotation[1], q[0] + h * slope[0], twist[1], posture_gain)[1]
    guess = q[0] + 0.5 * h * (slope[0] + ahead)
    for k in range(1, n + 1):
        correction, slope[k], error = kinematics.flow(position[k], rotation[k], guess, twist[k], posture_gain)
        # At the first knot the start's own small offset from the path is taken out.
        if not error < (_LOST_M if k > 1 else 5e-3):
            raise MotionRefused(
                what,
                f"the arm cannot follow the path beyond {s[k - 1] * 1e3:.0f} of {piece.length_m * 1e3:.0f} mm "
                f"(P at {np.array2string(position[k], precision=3)} m in B is out of reach or near a singularity)",
            )
        q[k] = guess + correction
        guess = q[k] + h * (1.5 * slope[k] - 0.5 * slope[k - 1])
    return s, q, slope


def _along(piece: Piece, knots_s: Array, knots_q: Array, spline: CubicSpline, pace: Pace, progress: Progress) -> Plan:
    v, a = progress.v[:, None], progress.a[:, None]
    q, first, second = (np.asarray(spline(progress.s, order), dtype=np.float64) for order in range(3))
    position, quat = piece.sample(progress.s)
    dq, ddq = first * v, second * v * v + first * a
    for array in (q, dq, ddq, position, quat):
        array.setflags(write=False)
    return Plan(piece, progress, knots_q, knots_s, spline, pace, q, dq, ddq, position, quat)
