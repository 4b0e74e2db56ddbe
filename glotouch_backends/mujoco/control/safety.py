"""Hard limits below the skills: contact wrench, and numerical stability of the simulation."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable

import mujoco
import numpy as np
import numpy.typing as npt

from glotouch_backends.mujoco.model import STEP_S
from glotouch_bt.compiled import compiled
from glotouch_bt.robot import Array, BackendError, Limits, SafetyStop

MAX_SAMPLES_OVER = 5
"""Consecutive samples (5 ms) beyond the stop limit that trip it; a single one may be an impact. Source: ours."""
MAX_SAMPLES_PRESSING = 2
"""Consecutive samples (2 ms) that trip it while the hand presses on. Source: ours, as above."""
MAX_SHARE_SOON = 2.0
"""Extrapolated share of the stop limit that trips it at once: 0.12 m/s at 7 N. Source: ours."""
CONTACT_STIFFNESS_N_M = 60e3
"""Stiffness of the arm on something rigid. Source: measured, 54 N/mm."""
MIN_PRESSING_SHARE = 0.25
"""Share of the stop limit below which a pressing hand is not judged. Source: measured in a nominal
retrieval of seed 9401; objects that the hand meets at 50 mm/s push it with 4 N."""
REACTION_SAMPLES = 2
"""Samples for which a force goes on rising at its present rate, until the brakes act. Source: ours; with 1, the
hand that presses the probe into its stand may pass the limit (tests/integration/test_force_limit.py), and with 3, a
slipped probe cannot be put back (tests/integration/test_recovery.py)."""
QUIET_SHARE = 0.99 * MIN_PRESSING_SHARE
"""Smaller samples are not judged, whatever the rounding."""
MAX_STEEPENING = 4.0
"""Mean rise of a contact over that of one sample. The weight of an object that is lifted takes power too, but hardly
rises. Source: ours."""
FREE_M_S = 0.015
"""Speed that adds nothing: guarded motions end such contacts themselves. A probe that snags on its way into the holder
at 10 mm/s meets 27.5 N. Source: measured in tests/integration/test_recovery.py."""
MIN_PRESSING_M_S = 0.002
"""A hand that presses on more slowly counts as standing. Source: ours; it gains 0.6 N in five samples."""


FORCE_2, TORQUE_2, OVER, PRESSING = range(4)
"""Entries of the guard's state: squares of the last force and torque, and the samples counted so far."""


@compiled("f8[::1]", "f8[::1]", "f8[::1]", "f8[::1]")
def _is_quiet(reading: Array, expected: Array, quiet_2: Array, state: Array) -> bool:
    """See `HardLimitGuard.is_quiet`; a quiet sample is noted in the guard's `state`."""
    x, y, z = reading[0] + expected[0], reading[1] + expected[1], reading[2] + expected[2]
    a, b, c = reading[3] + expected[3], reading[4] + expected[4], reading[5] + expected[5]
    force_2, torque_2 = x * x + y * y + z * z, a * a + b * b + c * c
    if not (force_2 < quiet_2[0] and torque_2 < quiet_2[1]):
        return False
    state[FORCE_2], state[TORQUE_2], state[OVER], state[PRESSING] = force_2, torque_2, 0.0, 0.0
    return True


@compiled("i4[:]", "f8[:, ::1]")
def _is_sane(warnings: npt.NDArray[np.int32], samples: Array) -> bool:
    """Return True if nothing warned and no square of a sample overflows."""
    total = 0.0
    for row in samples:
        for value in row:
            total += value * value
    return bool(np.isfinite(total) and not warnings.any())


class HardLimitGuard:
    """Check the raw contact wrench after every step; once tripped it stays tripped.

    A hand that moves at v into what it touches presses harder by stiffness times v in every second, until it stands.
    So the force is extrapolated over the time of a stop. v is the power that goes into the contact over the force: a
    hand that slides, yields, or stands while an object rocks between its jaws puts in none. It is taken of the
    measured motion, and of the setpoint's, which alone moves on when something rigid blocks the hand. What is stiffer
    than assumed shows in the force's rise, which is extrapolated over the reaction.

    Attributes:
        tripped: The stop, or None.
    """

    def __init__(self, limits: Limits) -> None:
        self._max_N, self._max_Nm = limits.stop_force_N, limits.stop_torque_Nm
        self._rise_s_m = CONTACT_STIFFNESS_N_M * limits.stop_ahead_s / self._max_N
        self._samples_ahead = limits.stop_ahead_s / STEP_S
        self._quiet_2: Array = np.array([(QUIET_SHARE * self._max_N) ** 2, (QUIET_SHARE * self._max_Nm) ** 2])
        self._state: Array = np.zeros(4)
        self.tripped: SafetyStop | None = None

    def is_quiet(self, reading: Array, expected: Array) -> bool:
        """Return True if a sample is too small to be judged; else it must be given to `check`.

        The wrenches (6,) are the sensor's reading and what it reads without contact, the latter with opposite sign.
        """
        return _is_quiet(reading, expected, self._quiet_2, self._state)

    def _share(self, force_2: float, torque_2: float) -> tuple[float, float, float]:
        """Return force N, torque Nm, and the larger share of its limit."""
        force, torque = math.sqrt(force_2), math.sqrt(torque_2)
        return force, torque, max(force / self._max_N, torque / self._max_Nm)

    def check(self, contact: Array, twists: Callable[[], Array], stamp_s: float) -> None:
        """Check one contact wrench (6,) in S, force N then torque Nm about its origin.

        `twists` returns motions (n, 6) of the hand at S in S, linear m/s then angular rad/s; called only if needed.
        """
        x, y, z, a, b, c = contact
        squares = x * x + y * y + z * z, a * a + b * b + c * c
        force, torque, share = self._share(*squares)
        state = self._state
        rise = share - self._share(state[FORCE_2], state[TORQUE_2])[2]
        state[FORCE_2], state[TORQUE_2] = squares
        if share < MIN_PRESSING_SHARE:
            state[OVER] = state[PRESSING] = 0.0
            return
        power_W = float((twists() @ np.negative(contact)).max())
        speed_m_s = max(0.0, power_W) / max(force, MIN_PRESSING_SHARE * self._max_N)
        soon = share + min(
            self._rise_s_m * max(0.0, speed_m_s - FREE_M_S), self._samples_ahead * MAX_STEEPENING * max(0.0, rise)
        )
        on_braking = share + REACTION_SAMPLES * max(0.0, rise)
        state[OVER] = state[OVER] + 1.0 if share > 1.0 else 0.0
        pressing = max(soon, on_braking) > 1.0 and speed_m_s > MIN_PRESSING_M_S
        state[PRESSING] = state[PRESSING] + 1.0 if pressing else 0.0
        if state[OVER] >= MAX_SAMPLES_OVER:
            kind, ahead = "", 1.0
        elif state[PRESSING] >= (MAX_SAMPLES_PRESSING if soon < MAX_SHARE_SOON else 1):
            kind, ahead = "extrapolated_", max(soon, on_braking) / share
        else:
            return
        if force / self._max_N >= torque / self._max_Nm:
            self.tripped = SafetyStop(f"{kind}force_N", ahead * force, self._max_N, stamp_s)
        else:
            self.tripped = SafetyStop(f"{kind}torque_Nm", ahead * torque, self._max_Nm, stamp_s)

    def stop(self) -> SafetyStop:
        """Return a new copy of the stop, to raise in every later cycle."""
        t = self.tripped
        assert t is not None
        return SafetyStop(t.quantity, t.value, t.limit, t.stamp_s)


def silence_mujoco() -> None:
    """Stop MuJoCo from printing warnings and writing MUJOCO_LOG.TXT; `check_sane` raises them as errors.

    Its profiler stops too: to read the clock at each stage is a twentieth of a step. The clock is a C callback that
    MuJoCo's Python module sets and cannot unset.
    """
    mujoco.set_mju_user_warning(lambda _: None)
    ctypes.c_void_p.in_dll(ctypes.CDLL(mujoco._functions.__file__), "mjcb_time").value = None


def check_sane(warnings: npt.NDArray[np.int32], samples: Array, time_s: float) -> None:
    """Refuse a simulation that has diverged or exceeded its buffers.

    Args:
        warnings: `data.warning.number`, the count of each of MuJoCo's warnings.
        samples: Sensor readings, one row a step. A square that overflows counts as not finite.
        time_s: For the message.

    Raises:
        BackendError: MuJoCo raised a warning, or a sample is not finite.
    """
    if _is_sane(warnings, samples):
        return
    if np.count_nonzero(warnings):
        names = [
            name for name, w in mujoco.mjtWarning.__members__.items() if int(w) < len(warnings) and warnings[int(w)]
        ]
        raise BackendError(f"the simulation became unstable at t={time_s:.3f} s ({', '.join(names)})")
    raise BackendError(f"the simulation gave readings that are not finite at t={time_s:.3f} s")
