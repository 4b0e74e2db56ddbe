"""The hard limit below the skills: when it trips on a sequence of samples, one a millisecond."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from glotouch_backends.mujoco.control import HardLimitGuard
from glotouch_bt.robot import Limits

STOP_N = Limits().stop_force_N
ALONG = np.array([0.0, 0.6, -0.8])
"""Direction of the force on the hand."""


def tripped_after(
    forces_N: Sequence[float],
    *,
    measured_m_s: float = 0.0,
    setpoint_m_s: float = 0.0,
    torque_Nm: float = 0.0,
    turning_rad_s: float = 0.0,
) -> int | None:
    """Return the number of samples until the guard trips, or None; speeds are against the force."""
    guard = HardLimitGuard(Limits())
    twists = np.zeros((2, 6))
    twists[:, :3] = -np.outer((measured_m_s, setpoint_m_s), ALONG)
    twists[0, 3] = turning_rad_s
    for i, force in enumerate(forces_N):
        guard.check([*(force * ALONG), torque_Nm, 0.0, 0.0], lambda: twists, 0.001 * i)
        if guard.tripped is not None:
            return i + 1
    return None


@pytest.mark.parametrize("before", range(12))
def test_any_five_samples_in_a_row_trip_it(before: int) -> None:
    """Wherever they lie in a control period."""
    quiet = [STOP_N - 0.1] * (before + 2)
    assert tripped_after([*quiet, *[STOP_N + 0.1] * 5]) == before + 7
    assert tripped_after([*quiet, *[STOP_N + 0.1] * 4, *quiet]) is None


def test_a_standing_hand_may_be_pressed_steeply_but_not_too_hard() -> None:
    """An object rocks between closing jaws: the arm can do nothing about it."""
    ramp = [0.0, 8.0, 16.0, 24.0, 26.0, 26.0, 26.0]
    assert tripped_after(ramp) is None
    assert tripped_after(ramp, measured_m_s=0.05) == 4


@pytest.mark.parametrize("speed_m_s", [-0.2, 0.0])
def test_a_hand_that_yields_or_slides_does_not_trip_it(speed_m_s: float) -> None:
    assert tripped_after([20.0] * 10, measured_m_s=speed_m_s, setpoint_m_s=speed_m_s) is None


def test_a_guarded_contact_does_not_trip_it() -> None:
    """The probe meets something rigid at 20 mm/s, and its guard ends the motion within 10 ms."""
    assert tripped_after([1.2 * i for i in range(10)], measured_m_s=0.02, setpoint_m_s=0.02) is None


@pytest.mark.parametrize("speed_m_s", [0.01, 0.02, 0.03, 0.06, 0.12])
@pytest.mark.parametrize("source", ["measured_m_s", "setpoint_m_s"])
def test_an_arm_that_presses_on_is_stopped_before_the_limit(speed_m_s: float, source: str) -> None:
    """A joint leaves its setpoint with the probe in its holder; 54 N/mm were measured."""
    rise_N = 54.0 * speed_m_s
    count = tripped_after([rise_N * i for i in range(80)], **{source: speed_m_s})
    assert count is not None
    braking_N = 54e3 * speed_m_s * min(0.0025, 0.025 * speed_m_s)  # the motors' torque bounds the deceleration

    assert rise_N * (count - 1) + braking_N < Limits().hard_force_N


@pytest.mark.parametrize("first_N", [0.0, 1.8, 3.5])
def test_what_is_stiffer_than_assumed_shows_in_the_rise(first_N: float) -> None:
    """The probe in its stand: 280 N/mm at 18 mm/s, wherever the samples fall."""
    count = tripped_after([first_N + 5.0 * i for i in range(12)], measured_m_s=0.018)
    assert count is not None
    assert first_N + 5.0 * (count - 1) < Limits().hard_force_N


def test_a_burst_of_one_sample_does_not_trip_it() -> None:
    assert tripped_after([2.0, 2.0, 27.0, 6.0, 2.0, 2.0], measured_m_s=0.01) is None


def test_a_hand_that_turns_into_a_contact_presses_too() -> None:
    """The power of the torque counts: 2.3 Nm at 0.4 rad/s with 9 N is an approach of 0.1 m/s."""
    forces_N = [0.0, *(7.5 + i for i in range(10))]
    assert tripped_after(forces_N, torque_Nm=2.3, turning_rad_s=-0.4) == 3
    assert tripped_after(forces_N, torque_Nm=2.3, turning_rad_s=0.4) is None


def test_a_heavy_object_can_be_lifted_fast() -> None:
    """1.5 kg at 0.15 m/s, with the jerk limit of 20 m/s3."""
    weights_N = [*np.linspace(0.0, 1.5 * 9.81, 200), *(1.5 * (9.81 + 0.02 * i) for i in range(50))]
    assert tripped_after(weights_N, measured_m_s=0.15, setpoint_m_s=0.15) is None


def test_the_motion_is_computed_only_while_something_presses() -> None:
    def never() -> np.ndarray:
        raise AssertionError

    HardLimitGuard(Limits()).check((1.0, 0.0, 0.0, 0.0, 0.0, 0.0), never, 0.0)


def test_the_torque_is_limited_too() -> None:
    assert tripped_after([0.0] * 10, torque_Nm=Limits().stop_torque_Nm + 0.1) == 5


def test_samples_that_are_passed_as_quiet_change_nothing() -> None:
    """Noise and rising presses, with and without the shortcut, trip at the same sample."""
    rng = np.random.default_rng(0)
    for _ in range(50):
        forces = np.concatenate([rng.uniform(0.0, 0.4 * STOP_N, 20), rng.uniform(0.2, 0.4) * STOP_N * np.arange(12)])
        stops = []
        for shortcut in (False, True):
            guard = HardLimitGuard(Limits())
            twists = np.zeros((2, 6))
            twists[:, :3] = -0.05 * ALONG
            for i, force in enumerate(forces):
                contact = [*(force * ALONG), 0.0, 0.0, 0.0]
                if not (shortcut and guard.is_quiet(-np.array(contact), np.zeros(6))):
                    guard.check(contact, lambda twists=twists: twists, 0.001 * i)
                if guard.tripped is not None:
                    break
            assert guard.tripped is not None
            stops.append((i, guard.tripped.value, guard.tripped.quantity))
        assert stops[0] == stops[1]
