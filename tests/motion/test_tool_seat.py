"""The displacement of the tool in the hand follows from two measurements."""

from __future__ import annotations

import numpy as np

from glotouch_bt.motion.tool_seat import MAX_DISPLACEMENT_M, ToolSeat


def test_the_first_measurement_is_no_displacement() -> None:
    seat = ToolSeat()
    np.testing.assert_array_equal(seat.displacement_B_m, np.zeros(3))
    seat.measured(np.array([4e-4, -1e-3]))
    np.testing.assert_array_equal(seat.displacement_B_m, np.zeros(3))


def test_later_measurements_are_compared_with_the_first() -> None:
    seat = ToolSeat()
    for tip in ([4e-4, -1e-3], [1e-4, -1e-3], [2e-4, -5e-4]):
        seat.measured(np.array(tip))
    np.testing.assert_allclose(seat.displacement_B_m, [-2e-4, 5e-4, 0.0])


def test_a_large_displacement_is_cut_in_its_direction() -> None:
    seat = ToolSeat()
    seat.measured(np.zeros(2))
    seat.measured(np.array([-0.006, 0.008]))
    np.testing.assert_allclose(seat.displacement_B_m, [-0.6 * MAX_DISPLACEMENT_M, 0.8 * MAX_DISPLACEMENT_M, 0.0])


def test_a_released_tool_has_no_displacement_until_it_is_measured_again() -> None:
    seat = ToolSeat()
    seat.measured(np.zeros(2))
    seat.measured(np.array([5e-4, 0.0]))
    seat.released()
    np.testing.assert_array_equal(seat.displacement_B_m, np.zeros(3))
    seat.measured(np.array([5e-4, 0.0]))
    np.testing.assert_allclose(seat.displacement_B_m, [5e-4, 0.0, 0.0])


def test_the_state_is_restored() -> None:
    seat, other = ToolSeat(), ToolSeat()
    seat.measured(np.zeros(2))
    seat.measured(np.array([5e-4, 1e-4]))
    other.restore(seat.state())
    np.testing.assert_array_equal(other.displacement_B_m, seat.displacement_B_m)
    other.restore(ToolSeat().state())
    np.testing.assert_array_equal(other.displacement_B_m, np.zeros(3))
