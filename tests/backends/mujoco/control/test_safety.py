"""The hard limit below the skills: when it trips on a sequence of samples, one a millisecond."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from glotouch_backends.mujoco.control import HardLimitGuard
from glotouch_bt.robot import Limits

STOP_N = Limits().stop_force_N


def tripped_after(forces_N: Sequence[float], *, speed_m_s: float = 0.2, torque_Nm: float = 0.0) -> int | None:
    """Return the number of samples until the guard trips, or None."""
    guard = HardLimitGuard(Limits())
    for i, force in enumerate(forces_N):
        guard.check((0.0, 0.6 * force, -0.8 * force, torque_Nm, 0.0, 0.0), (0.0, 0.0, 0.001 * i * speed_m_s), 0.001 * i)
        if guard.tripped is not None:
            return i + 1
    return None


@pytest.mark.parametrize("before", range(12))
def test_any_five_samples_in_a_row_trip_it(before: int) -> None:
    """Wherever they lie in a control period."""
    quiet = [STOP_N - 0.1] * (before + 2)
    assert tripped_after([*quiet, *[STOP_N + 0.1] * 5], speed_m_s=0.0) == before + 7
    assert tripped_after([*quiet, *[STOP_N + 0.1] * 4, *quiet], speed_m_s=0.0) is None


def test_a_standing_hand_may_be_pressed_steeply_but_not_too_hard() -> None:
    ramp = [0.0, 8.0, 16.0, 24.0, 26.0, 26.0, 26.0]
    assert tripped_after(ramp, speed_m_s=0.0) is None
    assert tripped_after(ramp) == 3


def test_an_impact_on_a_free_object_does_not_trip_it() -> None:
    """Measured: the largest impact of a whole retrieval."""
    assert tripped_after([0.2, 0.2, 0.2, 15.7, 16.1, 16.3, 16.2, 16.1, 15.7, 15.3, 14.8]) is None


def test_a_slow_hand_that_sets_the_probe_down_does_not_trip_it() -> None:
    """The probe meets its seat at 10 mm/s: an impact of some milliseconds; the arm presses little harder after it."""
    assert tripped_after([0.2, 6.0, 12.0, 14.0, 13.0, 11.0, 9.0], speed_m_s=0.02) is None


@pytest.mark.parametrize("rise_N", [2.4, 5.0, 9.0])
def test_an_arm_that_runs_into_something_fixed_is_stopped_early(rise_N: float) -> None:
    """2.4 N/ms: the shoulder leaves its setpoint at 45 mm/s on a probe that stands in its holder."""
    speed_m_s = 1e3 * rise_N / 54e3
    count = tripped_after([rise_N * i for i in range(40)], speed_m_s=speed_m_s)
    assert count is not None
    reached_N = rise_N * (count - 1)

    assert reached_N < 0.7 * Limits().hard_force_N


def test_the_torque_is_limited_too() -> None:
    assert tripped_after([0.0] * 10, speed_m_s=0.0, torque_Nm=Limits().stop_torque_Nm + 0.1) == 5
