"""Model of a gel pad: depth map and shift of the pad, from the object's true surface and the pad's force.

The physics engine presses a hard box against convex hulls: it knows the force, not the shape. Each frame is therefore
computed afterwards from the pose of the pad and the force on it:

1. Rays along z_pad against the exact mesh give `h` (n,), the depth to which each taxel of the UNDEFORMED gel, at
   the pad's simulated pose, overlaps the solid (negative: a gap).
2. The gel is a Winkler foundation: independent springs that stiffen towards the backing
   (K. L. Johnson, Contact Mechanics, 1985, section 4.3; the stiffening law keeps x below the gel's thickness):

       p(x) = k x / (1 - (x / X)^2),   x = max(0, h + s),   k = 0.2 N/mm3,   X = 1.6 mm

3. The shift `s` of the pad along z_pad is unknown. It is found such that the gel carries the pad's force:

       sum_i p(x_i) dA = F

   f(s) = sum p dA is zero for s <= -max(h), grows monotonically and without bound as s -> X - max(h), and is convex.
   The root therefore exists for every F > 0, and Newton's method that starts above it descends without overshoot.
   The deepest taxel alone carries at most F, which gives that start in closed form.
4. The map is x, clipped to the largest indentation that the gel can show.

Shift and aperture. Let q_L, q_R be the simulated distances of the two pad surfaces from the hand's mid-plane. The
simulated contact is soft too, by the solver's constants: the box sinks into the hull by an amount contained in h. A
real pad with the same force stands s further along z_pad: towards the object if s > 0 (the gel is softer than the
contact, or the hull bulges out of the true surface), away if s < 0. z_pad points to the mid-plane for both pads, so the
aperture that a gripper would report, UNDEFORMED gel to undeformed gel, is

    aperture = (q_L - s_L) + (q_R - s_R) = q_L + q_R - s_L - s_R

Accuracy: 0.001-0.018 mm RMS, and 0.03 mm of aperture, compared with a gel simulated inside the physics loop, which is
ten times slower and unstable at 1 ms (the project's feasibility study).

Frames: P pads' mid-point (z along the approach, y along the closing direction, left pad at +y_P). A pad frame has its
origin at the centre of the gel's undeformed surface, z_pad out of the gel INTO the object, y_pad along +z_P.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from glotouch_backends.mujoco.sensing.rays import SurfaceRays
from glotouch_bt.robot import Array, ParamError, Pose

Side = Literal["left", "right"]

STIFFNESS_N_MM3 = 0.2
"""Winkler modulus of the gel. Source: assumption of the feasibility study, not a vendor figure; over 1.6 mm of gel it
is a confined modulus of 0.32 MPa."""

BOTTOM_M = 0.0016
"""Indentation at which the stiffening spring becomes rigid. Source: ours, just above the 1.5 mm that the gel can
show."""

RAY_TRAVEL_M = 0.010
"""Distance of the ray origins behind the undeformed surface. Source: ours, deeper than any contact, less than a
finger's thickness."""

_ROTATION_P_PAD: dict[Side, Array] = {
    # columns are x_pad, y_pad, z_pad written in P
    "left": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "right": np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]),
}


def pad_pose_P(side: Side, distance_m: float) -> Pose:
    """Return the pad frame in P.

    Left: at +y_P, z_pad = -y_P, x_pad = +x_P. Right: at -y_P, z_pad = +y_P, x_pad = -x_P. y_pad = +z_P for both.

    Args:
        side: "left" or "right".
        distance_m: Distance of the undeformed gel surface from the mid-plane (half the aperture if centred).
    """
    sign = 1.0 if side == "left" else -1.0
    return Pose.from_matrix([0.0, sign * distance_m, 0.0], _ROTATION_P_PAD[side])


def pad_poses_P(distance_m: tuple[float, float], shear_m: Array | None = None) -> tuple[Pose, Pose]:
    """Return the frames of the left and the right pad in P.

    Args:
        distance_m: (left, right) distance of each undeformed gel surface from the plane y_P = 0.
        shear_m: (2, 2) shift of the left and the right gel's surface along x_P and z_P; the imprints shift with it.
    """
    left_P, right_P = pad_pose_P("left", distance_m[0]), pad_pose_P("right", distance_m[1])
    if shear_m is None:
        return left_P, right_P
    (lx, lz), (rx, rz) = shear_m.tolist()
    return Pose(np.array([-lx, 0.0, -lz])) @ left_P, Pose(np.array([-rx, 0.0, -rz])) @ right_P


@dataclass(frozen=True)
class PairPress:
    """Depth maps and shifts of both pads.

    Attributes:
        left_m, right_m: (rows, cols) indentation, layout as in `robot.TactileFrame`.
        left_shift_m, right_shift_m: Shift of each pad along its z_pad; see the module's text.
    """

    left_m: Array
    right_m: Array
    left_shift_m: float
    right_shift_m: float


class GelSensor:
    """Gel of one finger; both fingers have the same.

    Args:
        window_m: (width along x_P, length along z_P) of the gel.
        shape: (rows, cols) of the map; rows along +z_P, columns along +x_P.
        depth_m: Largest indentation shown; below 1.6 mm.
        stiffness_N_mm3: Winkler modulus.
        bottom_m: Indentation at which the gel becomes rigid.
        reach_m: If no surface in front of the window is nearer than this, the force acts outside the window and the map
            is empty. Source: hulls bulge by at most 3 mm, 95 % by less than 1 mm.

    Attributes:
        taxels_P: (rows, cols, 3) taxel centres on the mid-plane y_P = 0, in P.

    Raises:
        ParamError: A size, count or stiffness that is not positive, or `depth_m` not below 1.6 mm.
    """

    def __init__(
        self,
        window_m: tuple[float, float],
        shape: tuple[int, int],
        depth_m: float,
        stiffness_N_mm3: float = STIFFNESS_N_MM3,
        reach_m: float = 0.002,
        bottom_m: float = BOTTOM_M,
    ) -> None:
        for name, value in (
            ("window_m", min(window_m)),
            ("shape", min(shape)),
            ("stiffness_N_mm3", stiffness_N_mm3),
            ("reach_m", reach_m),
            ("bottom_m", bottom_m),
        ):
            if not (math.isfinite(value) and value > 0):
                raise ParamError(f"gel.{name}", value, "finite and positive")
        if not 0 < depth_m < BOTTOM_M:
            raise ParamError("gel.depth_m", depth_m, f"positive and below {BOTTOM_M} m, where the gel is rigid")
        rows, cols = shape
        self.shape, self.window_m, self.depth_m, self.reach_m = shape, window_m, depth_m, reach_m
        self._area_m2 = window_m[0] * window_m[1] / (rows * cols)
        self._stiffness_N_m3, self._bottom_m = stiffness_N_mm3 * 1e9, bottom_m
        x = (np.arange(cols) + 0.5) / cols * window_m[0] - 0.5 * window_m[0]
        z = (np.arange(rows) + 0.5) / rows * window_m[1] - 0.5 * window_m[1]
        self.taxels_P: Array = np.zeros((rows, cols, 3))
        self.taxels_P[..., 0], self.taxels_P[..., 2] = x, z[:, None]
        self.taxels_P.setflags(write=False)
        self._half_diagonal_m = 0.5 * math.hypot(*window_m)
        # ray origins in each pad frame, in the map's order: x_pad is x_P on the left and its opposite on the right
        flat = self.taxels_P.reshape(-1, 3)
        back = np.full(len(flat), -RAY_TRAVEL_M)
        self._origins_pad: dict[Side, Array] = {
            "left": np.stack([flat[:, 0], flat[:, 2], back], axis=1),
            "right": np.stack([-flat[:, 0], flat[:, 2], back], axis=1),
        }

    def overlap(self, side: Side, surfaces: Sequence[tuple[SurfaceRays, Pose]]) -> Array:
        """Return the depth of each taxel of the undeformed gel inside the nearest solid.

        Args:
            side: Which pad; it decides the order of the columns.
            surfaces: Each object's rays and `pose_O_pad`, the pad frame in that object's mesh frame.

        Returns:
            (rows, cols) in m: positive inside, negative a gap, -inf nothing in front.
        """
        origins_pad = self._origins_pad[side]
        overlap = np.full(len(origins_pad), -np.inf)
        for rays, pose_O_pad in surfaces:
            axis = pose_O_pad.rotation[:, 2]
            to_centre = rays.centre_O_m - pose_O_pad.position_m
            along = float(to_centre @ axis)
            aside_squared = float(to_centre @ to_centre) - along * along
            if aside_squared > (rays.radius_m + self._half_diagonal_m) ** 2:
                continue
            if not -RAY_TRAVEL_M - rays.radius_m < along < self.reach_m + self._bottom_m + rays.radius_m:
                continue
            distance = rays.heights(pose_O_pad.apply(origins_pad), axis)
            np.maximum(overlap, RAY_TRAVEL_M - distance, out=overlap)
        return overlap.reshape(self.shape)

    def press(self, side: Side, surfaces: Sequence[tuple[SurfaceRays, Pose]], force_N: float) -> tuple[Array, float]:
        """Return depth map and shift of one pad that presses with a given force.

        Args:
            side: Which pad.
            surfaces: Each object's rays and `pose_O_pad`; objects out of reach cost nothing.
            force_N: Normal force on the pad's face; zero, negative or NaN means no contact.

        Returns:
            (rows, cols) indentation in m within 0..`depth_m`, and the shift in m. All zeros and 0.0 if there is no
            force or nothing within reach.
        """
        if not force_N > 0.0:
            return np.zeros(self.shape), 0.0
        overlap = self.overlap(side, surfaces)
        if overlap.max() < -self.reach_m:
            return np.zeros(self.shape), 0.0
        shift = self.shift(overlap, force_N)
        return np.clip(overlap + shift, 0.0, self.depth_m), shift

    def press_pair(
        self,
        surfaces: Sequence[tuple[SurfaceRays, Pose]],
        distance_m: tuple[float, float],
        force_N: tuple[float, float],
        shear_m: Array | None = None,
    ) -> PairPress:
        """Press both pads against the same objects.

        Args:
            surfaces: Each object's rays and `pose_O_P`, the hand frame P in that object's mesh frame.
            distance_m, shear_m: See `pad_poses_P`.
            force_N: (left, right) normal force on each pad's face.
        """
        left_P, right_P = pad_poses_P(distance_m, shear_m)
        left, left_shift = self.press("left", [(r, p @ left_P) for r, p in surfaces], force_N[0])
        right, right_shift = self.press("right", [(r, p @ right_P) for r, p in surfaces], force_N[1])
        return PairPress(left, right, left_shift, right_shift)

    def shift(self, overlap: Array, force_N: float) -> float:
        """Return the shift s with sum p(max(0, overlap + s)) dA = force_N; see the module's text.

        Args:
            overlap: Any shape, m; at least one finite value.
            force_N: Positive.

        Returns:
            The shift in m; the force is correct to a relative 1e-9.
        """
        load = force_N / (self._stiffness_N_m3 * self._area_m2)  # m: sum of x / (1 - (x/X)^2) over the taxels
        top = float(overlap.max())
        # deepest taxel alone: x / (1 - (x/X)^2) = load, a quadratic in x with one positive root
        bottom = self._bottom_m
        ratio = 2.0 * load / bottom
        deepest = bottom * ratio / (1.0 + math.sqrt(1.0 + ratio * ratio))
        below_top = overlap[overlap > top - deepest] - top  # no other taxel can touch
        for _ in range(60):
            x = below_top + deepest
            x = x[x > 0.0]
            rest = 1.0 - (x / bottom) ** 2
            excess = float((x / rest).sum()) - load
            slope = float(((2.0 - rest) / (rest * rest)).sum())
            deepest -= excess / slope
            if abs(excess) <= 1e-9 * load:
                break
        return deepest - top
