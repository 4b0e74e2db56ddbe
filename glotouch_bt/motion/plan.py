"""Complete plan of a motion before its first command: the setpoints of all control periods, and its stops.

Inverse kinematics is solved at knots at most 5 mm apart. A cubic spline q(s) over the path length joins them, with end
slopes from the Jacobian. So velocities and accelerations are exact derivatives: dq = q' v, ddq = q'' v^2 + q' a.
The null-space motion is a function of s too, so it starts and ends as smoothly as the path.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from glotouch_bt.motion.kinematics import Kinematics, known_pose
from glotouch_bt.motion.paths import Piece, quats_to_matrices
from glotouch_bt.motion.timing import ProfileLimits, Progress, between, brake
from glotouch_bt.robot import Array, JointSetpoint, MotionRefused

KNOT_SPACING_M = 0.005
"""Maximum distance of neighbouring knots along the path."""
_MAX_PREDICTION_ERROR_M = 1e-3
"""Maximum error before the Newton correction; a larger one means a singularity or the end of the reach."""


@dataclass(frozen=True)
class MotionPlan:
    """Setpoints of one smooth piece, one per control period.

    Attributes:
        piece: The path.
        progress: Path length, speed and acceleration per period.
        knots_q: (k, dof) solved postures along the path; clearance is checked at these.
        knots_s: (k,) their path coordinates, m.
        limits: Limits along the path.
        q, dq, ddq: (n, dof) setpoints.
        position_m, quat: (n, 3), (n, 4) poses of P in B.
    """

    piece: Piece
    progress: Progress
    knots_q: Array
    knots_s: Array
    spline: scipy.interpolate.CubicSpline
    limits: ProfileLimits
    q: Array
    dq: Array
    ddq: Array
    position_m: Array
    quat: Array

    def __len__(self) -> int:
        return len(self.q)

    def setpoint(self, k: int) -> JointSetpoint:
        """Return the setpoint of period `k`."""
        return JointSetpoint(self.q[k], self.dq[k], self.ddq[k], known_pose(self.position_m[k], self.quat[k]))

    def halt(self, k: int, acceleration: float, jerk: float, period_s: float) -> MotionPlan | None:
        """Plan the fastest stop on the path after period `k` under limits (m/s2, m/s3); None if already at rest."""
        progress = brake(self.progress, k, acceleration, jerk, period_s)
        return None if progress is None else self._timed(progress)

    def between(self, s0: float, s1: float, period_s: float, max_m_s: float = np.inf) -> MotionPlan:
        """Plan a move from rest to rest along this path, m, in either direction, at most at `max_m_s`."""
        return self._timed(between(s0, s1, self.limits.at_most(max_m_s), period_s))

    def _timed(self, progress: Progress) -> MotionPlan:
        return _along(self.piece, self.knots_s, self.knots_q, self.spline, self.limits, progress)


def plan_piece(
    kinematics: Kinematics,
    piece: Piece,
    q_start: Array,
    *,
    limits: ProfileLimits,
    period_s: float,
    posture_gain: float,
    what: str,
) -> MotionPlan:
    """Plan one smooth piece from rest at `q_start` (dof,) to rest.

    Args:
        kinematics: The arm.
        piece: The path; it must begin at the pose of P at `q_start`.
        q_start: (dof,) rad.
        limits: Limits along the path, m/s, m/s2, m/s3. On an arc the speed is lowered so that the centripetal
            acceleration stays below the limit.
        period_s: Control period.
        posture_gain: Null-space pull towards home, per metre; 0 gives the minimum joint motion.
        what: Name of the motion for the error message.

    Raises:
        MotionRefused: The path leaves the arm's reach, or a joint leaves its range or exceeds its speed limit.
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
    if piece.curvature_1_m > 0:
        limits = limits.at_most(float(np.sqrt(limits.acceleration / piece.curvature_1_m)))
    progress = between(0.0, length, limits, period_s)
    spline = scipy.interpolate.CubicSpline(s, q, bc_type=((1, tangents[0]), (1, tangents[-1])))
    plan = _along(piece, s, q, spline, limits, progress)
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
    """Return knots (k,) m, postures (k, dof) and tangents dq/ds (k, dof).

    Adams-Bashforth predictor with one Newton correction per knot.
    """
    n = max(2, int(np.ceil(piece.length_m / KNOT_SPACING_M)))
    s = np.linspace(0.0, piece.length_m, n + 1)
    h = float(s[1])
    position, quat = piece.sample(s)
    rotation, twist = quats_to_matrices(quat), piece.twist(s)
    q = np.zeros((n + 1, len(q_start)))
    slope = np.zeros_like(q)
    q[0] = q_start
    slope[0] = kinematics.path_step(position[0], rotation[0], q[0], twist[0], posture_gain)[1]
    # Heun's rule makes the first step second-order like the later ones.
    ahead = kinematics.path_step(position[1], rotation[1], q[0] + h * slope[0], twist[1], posture_gain)[1]
    guess = q[0] + 0.5 * h * (slope[0] + ahead)
    for k in range(1, n + 1):
        correction, slope[k], error = kinematics.path_step(position[k], rotation[k], guess, twist[k], posture_gain)
        # The first knot also corrects the offset of the start from the path.
        if not error < (_MAX_PREDICTION_ERROR_M if k > 1 else 5e-3):
            raise MotionRefused(
                what,
                f"the arm cannot follow the path beyond {s[k - 1] * 1e3:.0f} of {piece.length_m * 1e3:.0f} mm "
                f"(P at {np.array2string(position[k], precision=3)} m in B is out of reach or near a singularity)",
            )
        q[k] = guess + correction
        guess = q[k] + h * (1.5 * slope[k] - 0.5 * slope[k - 1])
    return s, q, slope


def _along(
    piece: Piece,
    knots_s: Array,
    knots_q: Array,
    spline: scipy.interpolate.CubicSpline,
    limits: ProfileLimits,
    progress: Progress,
) -> MotionPlan:
    v, a = progress.v[:, None], progress.a[:, None]
    q, first, second = (np.asarray(spline(progress.s, order), dtype=np.float64) for order in range(3))
    position, quat = piece.sample(progress.s)
    dq, ddq = first * v, second * v * v + first * a
    for array in (q, dq, ddq, position, quat):
        array.setflags(write=False)
    return MotionPlan(piece, progress, knots_q, knots_s, spline, limits, q, dq, ddq, position, quat)
