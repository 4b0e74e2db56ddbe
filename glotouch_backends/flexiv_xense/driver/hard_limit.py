"""The hard limit on the contact wrench, checked at every sample, independent of the client.

The rule is that of the simulated robot. It is written twice because the driver runs in an environment of its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from .frames import Array, rotation

MAX_SAMPLES_OVER = 5
"""Consecutive samples beyond the limit that stop the arm (5 ms); a single one may be noise. Source: ours."""
MAX_SAMPLES_PRESSING = 2
"""Consecutive samples that stop a hand that presses on. Source: as in the simulated robot, like all
that follow."""
MAX_SHARE_SOON = 2.0
"""Extrapolated share of the limit that stops the arm at once."""
CONTACT_STIFFNESS_N_M = 60e3
"""Stiffness of the arm on something rigid."""
STOP_AHEAD_S = 0.008
"""Time of a stop, over which the force is extrapolated."""
MIN_PRESSING_SHARE = 0.25
"""Share of the limit below which a pressing hand is not judged."""
MAX_STEEPENING = 4.0
"""Mean rise of a contact over that of one sample; the weight of an object that is lifted hardly rises."""
REACTION_SAMPLES = 2
"""Samples for which a force goes on rising at its present rate, until the brakes act."""
SAMPLE_S = 0.001
"""Nominal time between samples."""
FREE_M_S = 0.015
"""Speed that adds nothing: guarded motions end such contacts themselves. A probe that snags on its way into the holder
at 10 mm/s meets 27.5 N. Source: as there."""
MIN_PRESSING_M_S = 0.002
"""A hand that presses on more slowly counts as standing."""


class HardLimit:
    """Decides at each sample whether the arm must stop.

    A hand that moves at v into what it touches presses harder by stiffness times v in every second, until it stands.
    v is the power that goes into the contact over the force, of the measured motion or of the setpoint's. What is
    stiffer than assumed shows in the force's rise, which is extrapolated over the reaction.

    Args:
        force_N, torque_Nm: Norms of the contact wrench in S at which the arm stops.
    """

    def __init__(self, force_N: float, torque_Nm: float) -> None:
        self._max_N, self._max_Nm = force_N, torque_Nm
        self._rise_s_m = CONTACT_STIFFNESS_N_M * STOP_AHEAD_S / force_N
        self._samples_ahead = STOP_AHEAD_S / SAMPLE_S
        self._over = self._pressing = 0
        self._last = 0.0

    def check(self, wrench_S: Sequence[float], power_W: Callable[[], float]) -> tuple[str, float, float] | None:
        """Return quantity, value and limit if the arm must stop.

        Args:
            wrench_S: (6,) contact wrench on the hand, N and Nm.
            power_W: Returns the power that the hand's motion puts into the contact; called only if needed.
        """
        force, torque = math.hypot(*wrench_S[:3]), math.hypot(*wrench_S[3:])
        share = max(force / self._max_N, torque / self._max_Nm)
        rise, self._last = share - self._last, share
        if share < MIN_PRESSING_SHARE:
            self._over = self._pressing = 0
            return None
        speed_m_s = max(0.0, power_W()) / max(force, MIN_PRESSING_SHARE * self._max_N)
        soon = share + min(
            self._rise_s_m * max(0.0, speed_m_s - FREE_M_S), self._samples_ahead * MAX_STEEPENING * max(0.0, rise)
        )
        on_braking = share + REACTION_SAMPLES * max(0.0, rise)
        self._over = self._over + 1 if share > 1.0 else 0
        pressing = max(soon, on_braking) > 1.0 and speed_m_s > MIN_PRESSING_M_S
        self._pressing = self._pressing + 1 if pressing else 0
        if self._over >= MAX_SAMPLES_OVER:
            kind, ahead = "", 1.0
        elif self._pressing >= (MAX_SAMPLES_PRESSING if soon < MAX_SHARE_SOON else 1):
            kind, ahead = "extrapolated_", max(soon, on_braking) / share
        else:
            return None
        if force / self._max_N >= torque / self._max_Nm:
            return f"{kind}force_N", ahead * force, self._max_N
        return f"{kind}torque_Nm", ahead * torque, self._max_Nm


def pressing_power_W(wrench_P: Sequence[float], pose: Sequence[float], twists_B: Sequence[Sequence[float]]) -> float:
    """Return the largest power that any of some motions puts into a contact.

    Args:
        wrench_P: (6,) wrench on the hand in P about P.
        pose: (7,) of P in B.
        twists_B: (6,) each, of P, linear m/s and angular rad/s, written in B.
    """
    from_P = rotation(pose[3:])
    wrench_B: Array = np.concatenate([from_P @ wrench_P[:3], from_P @ wrench_P[3:]])
    return float(-(np.asarray(twists_B) @ wrench_B).min())
