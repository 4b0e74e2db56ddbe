"""Hard limits below the skills: contact wrench, and numerical stability of the simulation."""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco
import numpy as np
import numpy.typing as npt

from glotouch_backends.mujoco.model import STEP_S
from glotouch_bt.robot import Array, BackendError, Limits, SafetyStop

MAX_SAMPLES_OVER = 5
"""Consecutive samples (5 ms) beyond the stop limit that trip it; a single one may be an impact. Source: ours."""
MAX_SAMPLES_RISING = 2
"""Consecutive samples that trip it while the arm moves and the force rises steeply, or is beyond the limit. An impact
on a free object rises for one sample, by up to 16 N; an arm that presses on something fixed rises in every sample.
Source: measured in whole retrievals."""
CONTACT_STIFFNESS_N_M = 60e3
"""Stiffness of a rigid contact with the arm behind it: an arm that moves at v presses harder by at most this times v,
however steeply an impact rises. Source: measured, 54 N/mm."""
MIN_MOVING_M_S = 0.042
"""A steep rise counts only above this speed of P. Source: ours; contacts of guarded motions, at 40 mm/s at most, rise
as steeply as collisions, and end by themselves."""
SPEED_SAMPLES = 10
"""Samples over which the speed of P is measured."""
LEVER_M = 0.34
"""Lever of a force on the probe's tip. Source: as of the hard torque limit."""
MIN_RISING_SHARE = 0.25
"""Share of the stop limit below which no rise counts: a light object rattles below it. Source: as above."""


class HardLimitGuard:
    """Check the raw contact wrench after every step; once tripped it stays tripped.

    While the arm moves faster than any guarded motion, the force is extrapolated at its present rise, because the arm
    presses harder until it stands, but no faster than its speed allows. Against an object that jumps between closing
    jaws, a standing arm can do nothing.
    """

    def __init__(self, limits: Limits) -> None:
        self._max_N, self._max_Nm = limits.stop_force_N, limits.stop_torque_Nm
        self._ahead_s = limits.stop_ahead_s
        self._last_N = self._last_Nm = 0.0
        self._over = self._rising = 0
        self._places = np.zeros((SPEED_SAMPLES, 3))  # of P, the newest at `_seen - 1`
        self._seen = 0
        self.tripped: SafetyStop | None = None

    def check(self, contact: Sequence[float], position_B_P: Sequence[float], stamp_s: float) -> None:
        """Check one contact wrench (6,) with P at a position (3,)."""
        self._places[self._seen % SPEED_SAMPLES] = position_B_P
        self._seen += 1
        x, y, z, a, b, c = contact
        force, torque = math.sqrt(x * x + y * y + z * z), math.sqrt(a * a + b * b + c * c)
        rise_N, rise_Nm = force - self._last_N, torque - self._last_Nm
        self._last_N, self._last_Nm = force, torque
        share = max(force / self._max_N, torque / self._max_Nm)
        if share < MIN_RISING_SHARE:
            self._over = self._rising = 0
            return
        n = min(self._seen, SPEED_SAMPLES)
        oldest = self._places[(self._seen - n) % SPEED_SAMPLES].tolist()
        speed_m_s = math.dist(oldest, position_B_P) / (max(1, n - 1) * STEP_S)
        periods, max_rise_N = self._ahead_s / STEP_S, CONTACT_STIFFNESS_N_M * speed_m_s * self._ahead_s
        force_soon = force + min(periods * rise_N, max_rise_N)
        torque_soon = torque + min(periods * rise_Nm, LEVER_M * max_rise_N)
        soon = max(force_soon / self._max_N, torque_soon / self._max_Nm)
        self._over = self._over + 1 if share > 1.0 else 0
        self._rising = self._rising + 1 if speed_m_s > MIN_MOVING_M_S and soon > 1.0 else 0
        if self._over < MAX_SAMPLES_OVER and self._rising < MAX_SAMPLES_RISING:
            return
        if self._over >= MAX_SAMPLES_OVER:
            kind, force_soon, torque_soon = "", force, torque
        else:
            kind = "rising_"
        if force_soon / self._max_N >= torque_soon / self._max_Nm:
            self.tripped = SafetyStop(f"{kind}force_N", force_soon, self._max_N, stamp_s)
        else:
            self.tripped = SafetyStop(f"{kind}torque_Nm", torque_soon, self._max_Nm, stamp_s)

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
