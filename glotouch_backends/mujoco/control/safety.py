"""Hard limits below the skills: contact wrench, and numerical stability of the simulation."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import numpy.typing as npt

from glotouch_bt.robot import Array, BackendError, Limits, SafetyStop

CHUNK = 5
"""Samples in a check; the limit trips when all of them are beyond it. Source: ours."""


class HardLimitGuard:
    """Check every chunk of raw wrench samples; once tripped it stays tripped."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._scale = np.array([1.0 / limits.hard_force_N] * 3 + [1.0 / limits.hard_torque_Nm] * 3)
        self.tripped: SafetyStop | None = None

    def check(self, contact: Array, stamp_s: float) -> bool:
        """Check a chunk (n, 6) of contact wrenches that ends at `stamp_s`; return True if a limit trips now."""
        scaled = (contact * self._scale).ravel()
        if scaled @ scaled < 1.0:  # no sample can be beyond a limit
            return False
        squared = contact * contact
        force2, torque2 = float(squared[:, :3].sum(axis=1).min()), float(squared[:, 3:].sum(axis=1).min())
        limits = self._limits
        if force2 > limits.hard_force_N**2:
            self.tripped = SafetyStop("force_N", force2**0.5, limits.hard_force_N, stamp_s)
        elif torque2 > limits.hard_torque_Nm**2:
            self.tripped = SafetyStop("torque_Nm", torque2**0.5, limits.hard_torque_Nm, stamp_s)
        else:
            return False
        return True

    def stop(self) -> SafetyStop:
        """Return a new copy of the stop, to raise in every later cycle."""
        t = self.tripped
        assert t is not None
        return SafetyStop(t.quantity, t.value, t.limit, t.stamp_s)


def silence_mujoco() -> None:
    """Stop MuJoCo from printing warnings and writing MUJOCO_LOG.TXT; `check_sane` raises them as errors."""
    mujoco.set_mju_user_warning(lambda _: None)


def check_sane(warnings: npt.NDArray[np.int32], samples: Array, time_s: float) -> None:
    """Refuse a simulation that has diverged or exceeded its buffers.

    Args:
        warnings: `data.warning.number`, the count of each of MuJoCo's warnings.
        samples: Sensor readings of any shape. A square that overflows counts as not finite.
        time_s: For the message.

    Raises:
        BackendError: MuJoCo raised a warning, or a sample is not finite.
    """
    if np.count_nonzero(warnings):
        names = [
            name for name, w in mujoco.mjtWarning.__members__.items() if int(w) < len(warnings) and warnings[int(w)]
        ]
        raise BackendError(f"the simulation became unstable at t={time_s:.3f} s ({', '.join(names)})")
    flat = samples.ravel()
    if not math.isfinite(flat @ flat):
        raise BackendError(f"the simulation gave readings that are not finite at t={time_s:.3f} s")
