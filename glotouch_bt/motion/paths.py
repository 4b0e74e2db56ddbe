"""Geometric paths of P in B, without timing: a length and a pose at each path coordinate.

The length of a piece is the distance travelled by P, or its rotation times a 0.1 m lever if that is larger. So a
rotation in place has a length, and 0.1 m/s means at most 1 rad/s.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np
import numpy.typing as npt

from glotouch_bt.robot import Array, ParamError, Pose

TURN_LEVER_M = 0.1
"""Path length per radian of rotation."""


class Path(Protocol):
    """A path of P made of smooth pieces; the arm comes to rest between pieces."""

    @property
    def length_m(self) -> float:
        """Length of the path, m."""
        ...

    @property
    def pieces(self) -> tuple[Piece, ...]:
        """The smooth pieces, in order."""
        ...

    def pose(self, s: float) -> Pose:
        """Return the pose of P in B at `s` metres from the start, clamped to the ends."""
        ...


class Piece(Path, Protocol):
    """A path with a continuous tangent."""

    @property
    def pieces(self) -> tuple[Piece, ...]:
        """A tuple with this path; empty if its length is zero."""
        return (self,) if self.length_m > 1e-9 else ()

    def pose(self, s: float) -> Pose:
        """Return the pose of P in B at `s` metres from the start, clamped to the ends."""
        position, quat = self.sample(np.array([s]))
        return Pose(position[0], quat[0])

    @property
    def curvature_1_m(self) -> float:
        """Curvature, 1/m: the centripetal acceleration at speed v is v^2 times this."""
        ...

    def sample(self, s: Array) -> tuple[Array, Array]:
        """Return positions (n, 3) m and unit quaternions (n, 4) w x y z of P in B at `s` (n,) m."""
        ...

    def twist(self, s: Array) -> Array:
        """Return linear and angular change (n, 6) of P per metre of path, in B, at `s` (n,) m."""
        ...


def _rotation_vector(rotation: Array) -> Array:
    """Return the rotation vector (3,) of a matrix, angle in [0, pi]; the quaternion keeps it accurate near pi."""
    q = Pose.from_matrix(np.zeros(3), rotation).quat
    n = float(np.linalg.norm(q[1:]))
    return np.zeros(3) if n < 1e-15 else q[1:] * (2.0 * float(np.arctan2(n, q[0])) / n)


def _turn_quat(vector: Array, share: Array, quat: Array) -> Array:
    """Return the quaternions (n, 4) of exp(share * vector) applied in B after `quat` (4,)."""
    angle = float(np.linalg.norm(vector))
    axis = vector / angle if angle > 0 else vector
    half = 0.5 * angle * share
    w, xyz = np.cos(half), np.sin(half)[:, None] * axis
    out = np.zeros((len(share), 4))
    out[:, 0] = w * quat[0] - xyz @ quat[1:]
    out[:, 1:] = w[:, None] * quat[1:] + quat[0] * xyz + np.cross(xyz, quat[1:])
    return out


def quats_to_matrices(quat: Array) -> Array:
    """Convert unit quaternions (n, 4) w x y z to rotation matrices (n, 3, 3)."""
    w, x, y, z = quat.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.ascontiguousarray(np.moveaxis(np.array(rows), 2, 0))


@dataclass(frozen=True)
class Line(Piece):
    """Straight line between two poses with a constant rotation rate about one axis.

    Attributes:
        start, end: Poses of P in B.
    """

    start: Pose
    end: Pose

    @cached_property
    def _shift(self) -> Array:
        return np.asarray(self.end.position_m - self.start.position_m, dtype=np.float64)

    @cached_property
    def _rotation(self) -> Array:
        return _rotation_vector(self.end.rotation @ self.start.rotation.T)

    @cached_property
    def length_m(self) -> float:
        """Length; see the module's text for turns."""
        return max(float(np.linalg.norm(self._shift)), TURN_LEVER_M * float(np.linalg.norm(self._rotation)))

    @property
    def curvature_1_m(self) -> float:
        """Curvature of a straight line: 0."""
        return 0.0

    def sample(self, s: Array) -> tuple[Array, Array]:
        """Positions (n, 3) and quaternions (n, 4) in B at `s` (n,) m."""
        share = np.clip(s / max(self.length_m, 1e-12), 0.0, 1.0)
        return self.start.position_m + share[:, None] * self._shift, _turn_quat(self._rotation, share, self.start.quat)

    def twist(self, s: Array) -> Array:
        """(n, 6) change per metre in B."""
        one = np.concatenate([self._shift, self._rotation]) / max(self.length_m, 1e-12)
        return np.broadcast_to(one, (len(s), 6))


@dataclass(frozen=True)
class Arc(Piece):
    """Circular arc about an axis.

    Attributes:
        start: Pose of P in B at the start.
        centre_B: (3,) any point of the axis, m.
        axis: (3,) direction of the axis in B.
        angle: Signed angle about the axis, rad, right-handed; more than 2 pi is allowed.
        turn: Rotate the hand with the arc; otherwise keep its orientation.
    """

    start: Pose
    centre_B: npt.ArrayLike
    axis: npt.ArrayLike
    angle: float
    turn: bool = False
    _c: Array = field(init=False, repr=False, compare=False)
    _n: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        centre, axis = np.asarray(self.centre_B, dtype=np.float64), np.asarray(self.axis, dtype=np.float64)
        if centre.shape != (3,) or axis.shape != (3,) or not np.isfinite(np.concatenate([centre, axis])).all():
            raise ParamError("arc", (self.centre_B, self.axis), "a finite centre (3,) and axis (3,)")
        length = float(np.linalg.norm(axis))
        if length < 1e-9 or not np.isfinite(self.angle):
            raise ParamError("arc", (self.axis, self.angle), "an axis that is not zero and a finite angle")
        object.__setattr__(self, "_n", axis / length)
        object.__setattr__(self, "_c", centre)

    @cached_property
    def _basis(self) -> tuple[Array, Array, Array]:
        arm = self.start.position_m - self._c
        along = self._n * float(self._n @ arm)
        return self._c + along, arm - along, np.cross(self._n, arm)

    @cached_property
    def radius_m(self) -> float:
        """Distance of P from the axis."""
        return float(np.linalg.norm(self._basis[1]))

    @cached_property
    def length_m(self) -> float:
        """Length; see the module's text for turns."""
        lever = max(self.radius_m, TURN_LEVER_M) if self.turn else self.radius_m
        return abs(self.angle) * lever

    @property
    def curvature_1_m(self) -> float:
        """Curvature with respect to `length_m`: the centripetal acceleration at speed v is v^2 times this."""
        if self.length_m <= 1e-9:
            return 0.0
        return self.radius_m * (self.angle / self.length_m) ** 2

    def sample(self, s: Array) -> tuple[Array, Array]:
        """Positions (n, 3) and quaternions (n, 4) in B at `s` (n,) m."""
        share = np.clip(s / max(self.length_m, 1e-12), 0.0, 1.0)
        foot, u, v = self._basis
        a = (self.angle * share)[:, None]
        turn = self._n * self.angle if self.turn else np.zeros(3)
        return foot + np.cos(a) * u + np.sin(a) * v, _turn_quat(turn, share, self.start.quat)

    def twist(self, s: Array) -> Array:
        """(n, 6) change per metre in B."""
        _, u, v = self._basis
        rate = self.angle / max(self.length_m, 1e-12)
        a = (rate * np.clip(s, 0.0, self.length_m))[:, None]
        out = np.zeros((len(s), 6))
        out[:, :3] = rate * (np.cos(a) * v - np.sin(a) * u)
        if self.turn:
            out[:, 3:] = rate * self._n
        return out


@dataclass(frozen=True)
class Polyline:
    """Straight lines through several poses; the arm comes to rest at each corner.

    Attributes:
        poses: At least two poses of P in B.
    """

    poses: Sequence[Pose]

    def __post_init__(self) -> None:
        if len(self.poses) < 2:
            raise ParamError("polyline.poses", len(self.poses), "at least two poses")
        object.__setattr__(self, "poses", tuple(self.poses))

    @cached_property
    def pieces(self) -> tuple[Piece, ...]:
        """The lines of non-zero length."""
        return tuple(p for a, b in zip(self.poses[:-1], self.poses[1:], strict=True) for p in Line(a, b).pieces)

    @cached_property
    def length_m(self) -> float:
        """Sum of the lines' lengths."""
        return float(sum(p.length_m for p in self.pieces))

    def pose(self, s: float) -> Pose:
        """Pose of P in B at `s` metres."""
        for piece in self.pieces:
            if s <= piece.length_m:
                return piece.pose(s)
            s -= piece.length_m
        return self.poses[-1]
