"""At which yaws and heights an object fits between open jaws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from glotouch_bt.perception.recognition import TargetModel
from glotouch_bt.perception.recognition.model import mirrored
from glotouch_bt.robot import Array, Gripper


@dataclass(frozen=True)
class JawFit:
    """The jaws against one object, over the middle of its footprint.

    Attributes:
        yaw_deg: (n,) yaw of the jaws' width against the object, half a turn.
        z_m: (k,) height of the pads' middle, from the lowest one.
        opening_m: (n, k) opening that lets the fingers down to that height; NaN if a pad would meet nothing.
        stroke_m: Largest opening.
        palm_m: Height of the hand's body above the floor when the fingertips touch it: no taller object is held low.
    """

    yaw_deg: Array
    z_m: Array
    opening_m: Array
    stroke_m: float
    palm_m: float

    @property
    def fits(self) -> npt.NDArray[np.bool_]:
        """(n, k) True where the object fits."""
        return np.asarray(self.opening_m <= self.stroke_m)  # NaN is False

    def in_words(self) -> str:
        """Return the yaws and the widths that fit, for a person."""
        yaws = np.asarray(self.fits.any(axis=1))
        if not yaws.any():
            if not np.isfinite(self.opening_m).any():
                return "the pads meet nothing"
            return f"too wide: {np.nanmin(self.opening_m) * 1e3:.0f} mm, the jaws open {self.stroke_m * 1e3:.0f} mm"
        widths = self.opening_m[self.fits] * 1e3
        at = "every yaw" if yaws.all() else f"{yaws.mean():.0%} of yaws: {_runs(self.yaw_deg, yaws)} deg"
        return f"{at}, {widths.min():.0f} to {widths.max():.0f} mm"


def jaw_fit(model: TargetModel, gripper: Gripper) -> JawFit:
    """Return the fit of an object from the tables of its model: every 5 degrees, every 2.7 mm of height.

    A finger that goes down to some height passes everything above it, down to the fingertip below the pads' middle.
    """
    half, middle = len(model.phi_rad) // 2, len(model.l_m) // 2
    step = float(model.z_m[1] - model.z_m[0]) if len(model.z_m) > 1 else 1.0
    below = int(np.ceil(gripper.fingertip_below_P_m / step))
    sides = []
    for reach in (model.reach_m, mirrored(model.reach_m)):
        column = np.where(np.isfinite(reach[:half, middle]), reach[:half, middle], -np.inf)
        above = np.maximum.accumulate(column[:, ::-1], axis=1)[:, ::-1]
        sides.append(above[:, np.maximum(np.arange(above.shape[1]) - below, 0)])
    opening = np.where(np.isfinite(model.width_m[:half, middle]), sides[0] + sides[1], np.nan)
    low = model.z_m >= gripper.fingertip_below_P_m
    body_m = max(box.centre_m[2] + box.half_m[2] for box in gripper.body) if gripper.body else -np.inf
    palm = float(gripper.pose_E_P.position_m[2]) - body_m + gripper.fingertip_below_P_m
    yaws = np.rad2deg(np.asarray(model.phi_rad[:half], dtype=np.float64))
    return JawFit(yaws, model.z_m[low], np.asarray(opening[:, low], dtype=np.float64), gripper.stroke_m, palm)


def _runs(yaw_deg: Array, good: npt.NDArray[np.bool_]) -> str:
    """Return the runs of good yaws, around half a turn: `20-70, 110-160`."""
    n, step = len(good), round(float(yaw_deg[1] - yaw_deg[0]))
    starts = [i for i in range(n) if good[i] and not good[i - 1]]
    runs: list[str] = []
    for start in starts:
        length = next(k for k in range(1, n + 1) if not good[(start + k) % n])
        first = round(float(yaw_deg[start]))
        last = first + (length - 1) * step
        runs += [f"{first}-{last}"] if last < n * step else [f"{first}-{n * step}", f"0-{last - n * step}"]
    return ", ".join(runs)
