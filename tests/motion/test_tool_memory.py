"""Memory of the held tool: space that it felt to be free, and its displacement in the hand."""

from __future__ import annotations

import numpy as np

from glotouch_bt.motion.tool_memory import CLEAR_OF_TOUCH_M, MAX_DISPLACEMENT_M, STEP_M, FeltSpace, ToolSeat

LOW, HIGH = 0.018, 0.13


def path(x0: float, x1: float, z: float = LOW) -> np.ndarray:
    x = np.linspace(x0, x1, 401)
    return np.column_stack([x, 0.0 * x, z + 0.0 * x])


def test_columns_follow_the_path_at_a_low_height_only() -> None:
    felt = FeltSpace()
    felt.add(path(0.0, 0.2))
    felt.add(path(0.3, 0.4, HIGH))
    columns = felt.columns(LOW + 0.001)
    x = np.sort(columns[:, 0])
    assert x[0] == 0.0
    assert np.diff(x).max() <= STEP_M + 1e-3
    assert x[-1] <= 0.2
    assert len(felt.columns(HIGH)) > len(columns)


def test_columns_keep_away_from_every_touch_whenever_it_was() -> None:
    felt = FeltSpace()
    felt.add(path(0.0, 0.1), np.array([0.106, 0.0, 0.018]))
    felt.add(path(0.1, 0.0))
    assert len(felt.columns(LOW)) > 0
    assert felt.columns(LOW)[:, 0].max() <= 0.106 - CLEAR_OF_TOUCH_M


def test_places_are_covered_by_tool_and_hand() -> None:
    felt = FeltSpace()
    places = np.array([[0.05, 0.004], [0.08, 0.0]])
    assert felt.free_down_to(places, 0.005) == np.inf
    felt.add(path(0.0, 0.07))
    assert felt.free_down_to(places, 0.005) == np.inf
    felt.add_hand(np.array([[0.081, 0.0]]), 0.03)
    assert felt.free_down_to(places, 0.005) == 0.03
    felt.add_hand(np.array([[0.08, 0.001]]), 0.02)
    assert felt.free_down_to(places, 0.005) == 0.02
    assert felt.free_down_to(places[:1], 0.005) == 0.0
    assert felt.columns(1.0)[:, 0].max() <= 0.07, "where the fingers were, the ball may not fit"


def test_the_record_is_kept_and_forgotten() -> None:
    felt, other = FeltSpace(), FeltSpace()
    felt.add(path(0.0, 0.1), np.array([0.2, 0.0]))
    other.restore(felt.state())
    np.testing.assert_array_equal(other.columns(LOW), felt.columns(LOW))
    felt.forget()
    assert len(felt.columns(LOW)) == 0
    assert len(other.columns(LOW)) > 0


def test_what_the_jaws_handled_is_forgotten() -> None:
    felt = FeltSpace()
    felt.add(path(0.0, 0.3))
    felt.add_hand(np.array([[0.05, 0.02]]), 0.03)
    assert felt.free_down_to(np.array([[0.05, 0.0], [0.25, 0.0], [0.05, 0.02]]), 0.005) == 0.03
    felt.forget_near(np.array([0.0, 0.0, 0.1]))
    assert felt.free_down_to(np.array([[0.05, 0.0]]), 0.005) == np.inf
    assert felt.free_down_to(np.array([[0.05, 0.02]]), 0.005) == np.inf
    assert felt.free_down_to(np.array([[0.25, 0.0]]), 0.005) == 0.0


def test_small_motions_of_what_stands_near_add_up() -> None:
    felt, other = FeltSpace(), FeltSpace()
    felt.add(path(0.0, 0.3))
    near, far = np.array([[0.05, 0.0]]), np.array([[0.25, 0.0]])
    felt.moved_a_little(near[0], 0.4)
    felt.moved_a_little(far[0], 0.9)
    other.restore(felt.state())
    for record in (felt, other):
        record.moved_a_little(near[0], 0.4)
        assert record.free_down_to(near, 0.005) == 0.0
        record.moved_a_little(near[0] + 0.01, 0.4)
        assert record.free_down_to(near, 0.005) == np.inf
        assert record.free_down_to(far, 0.005) == 0.0
        record.add(path(0.0, 0.1))
        record.moved_a_little(near[0], 0.9)
        assert record.free_down_to(near, 0.005) == 0.0, "what was felt anew counts anew"


def test_what_a_fingertip_met_is_kept_until_jaws_close_near_it() -> None:
    felt, other = FeltSpace(), FeltSpace()
    places = np.array([[0.0, 0.0], [0.005, 0.0], [0.010, 0.0], [0.015, 0.0]])
    assert felt.met_below(places, 0.0) is None
    felt.add_met(places, 0.04)
    felt.forget_free_near(places[0])
    other.restore(felt.state())
    for record in (felt, other):
        assert record.met_below(places, 0.02) == 0.04
        assert record.met_below(places, 0.05) is None, "it stays above"
        assert record.met_below(places + np.array([0.0, 0.003]), 0.02) == 0.04
        assert record.met_below(places + np.array([0.016, 0.0]), 0.02) is None, "it covers less than half of them"
    felt.forget_near(np.array([0.1, 0.0]))
    assert felt.met_below(places, 0.02) is None


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
    np.testing.assert_array_equal(seat.tip_B_m, [5e-4, 0.0, 0.0])
    seat.released()
    np.testing.assert_array_equal(seat.tip_B_m, np.zeros(3))
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
