"""Readings of one control period: a block of samples, not a single one.

Frames: B arm base, E flange, S wrist force sensor (S = E: same origin, same axes), P pads' mid-point. SI units.

P: z along the approach (away from the flange; down when the hand points down), y along the closing direction with the
LEFT pad at +y and the right pad at -y, x = y cross z along the width of the fingers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from glotouch_bt.robot.geometry import Array, Pose

ImageArray = npt.NDArray[np.uint8]
SAMPLED = ("stamp_s", "q", "dq", "position_B_P", "quat_B_P", "wrench_S")
"""Fields of an `Observation` with one row a sample."""


@dataclass(frozen=True, slots=True)
class GripperState:
    """Last report of the gripper about its jaws.

    Attributes:
        stamp_s: Robot clock when the value was measured; the report is late by the gripper's latency.
        aperture_m: Distance between the two pad surfaces, undeformed gel to undeformed gel; 0 is closed.
        force_N: Closing force of one jaw, >= 0.
        moving: True while the jaws move.
    """

    stamp_s: float
    aperture_m: float
    force_N: float
    moving: bool


@dataclass(frozen=True, slots=True)
class TactileFrame:
    """One pair of gel depth maps taken together.

    Both maps share one layout: row 0 is nearest the flange and rows run along +z_P (down, towards the fingertip);
    columns run along +x_P for BOTH pads. Positive is indented, 0 is untouched gel.

    Attributes:
        stamp_s: Robot clock when the frame was taken.
        left_m: (rows, cols) indentation of the pad at +y_P; NaN for a dead taxel.
        right_m: (rows, cols) indentation of the pad at -y_P.
    """

    stamp_s: float
    left_m: Array
    right_m: Array


@dataclass(frozen=True, slots=True)
class GelImages:
    """One pair of colour images of the gels' surfaces taken together, laid out as a `TactileFrame`.

    The pixel pitch follows from the shape and the gel window (`Gripper.image_pitch_m`).

    Attributes:
        stamp_s: Robot clock when the images were taken.
        left: (rows, cols, 3) uint8 red, green, blue of the pad at +y_P.
        right: The same of the pad at -y_P.
    """

    stamp_s: float
    left: ImageArray
    right: ImageArray


@dataclass(frozen=True, slots=True)
class Observation:
    """All samples of one control period, oldest first (n = 10 at 1 kHz sensing and 100 Hz control).

    Attributes:
        stamp_s: (n,) robot clock at which each sample ARRIVED; strictly increasing across blocks.
        q: (n, dof) joint positions, rad.
        dq: (n, dof) joint velocities, rad/s.
        position_B_P: (n, 3) pads' mid-point in B, m.
        quat_B_P: (n, 4) orientation of P in B, w x y z.
        wrench_S: (n, 6) force N then torque Nm that the hand FEELS from environment and gravity, written in S about S's
            origin, minus the last tare. Pressing a down-pointing tool onto the floor gives +z_B force.
        gripper: Last report of the jaws.
        tactile: A NEW pair of depth maps, if one arrived this period and was requested; else None.
        images: The pair of gel images that an earlier command requested, in the period in which it arrives; else None.
    """

    stamp_s: Array
    q: Array
    dq: Array
    position_B_P: Array
    quat_B_P: Array
    wrench_S: Array
    gripper: GripperState
    tactile: TactileFrame | None = None
    images: GelImages | None = None

    @property
    def now_s(self) -> float:
        """Robot clock at the newest sample."""
        return float(self.stamp_s[-1])

    @property
    def pose_B_P(self) -> Pose:
        """Pose of P at the newest sample."""
        return Pose(self.position_B_P[-1], self.quat_B_P[-1])
