"""Signs, frames and units in cases computed by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glotouch_backends.flexiv_xense.client.chain import Chain
from glotouch_backends.flexiv_xense.driver.frames import depth_map_m, gel_image, payload_on_tool, wrench_map
from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.robot import Pose
from glotouch_bt.robot.fake import forward

HALF = float(np.sqrt(0.5))
OURS = (0.0, 0.0, 0.2, 1.0, 0.0, 0.0, 0.0)


def test_a_tool_pressed_on_the_floor_feels_minus_z_of_P_and_so_of_S() -> None:
    # Pointing down, z_P is -z_B; the floor pushes up, +z_B. No lever, no torque.
    assert np.allclose(wrench_map(OURS) @ [0, 0, -5.0, 0, 0, 0], [0, 0, -5.0, 0, 0, 0])


def test_a_push_on_the_side_of_P_turns_about_S() -> None:
    # 10 N along +x at 0.2 m along z: (0, 0, 0.2) x (10, 0, 0) = (0, 2, 0).
    assert np.allclose(wrench_map(OURS) @ [10.0, 0, 0, 0, 0, 0], [10.0, 0, 0, 0, 2.0, 0])
    # 10 N along +y: (0, 0, 0.2) x (0, 10, 0) = (-2, 0, 0).
    assert np.allclose(wrench_map(OURS) @ [0, 10.0, 0, 0, 0, 0], [0, 10.0, 0, -2.0, 0, 0])


def test_a_push_on_the_tip_has_its_whole_lever() -> None:
    # A ball 0.13 m beyond P, 10 N along +x: about P the torque is 1.3 along +y; about S, 0.33 m away, 3.3.
    assert np.allclose(wrench_map(OURS) @ [10.0, 0, 0, 0, 1.3, 0], [10.0, 0, 0, 0, 3.3, 0])


def test_a_turned_tool() -> None:
    # P is S turned by +90 deg about z and shifted by (0.1, 0, 0): x_P = y_S, y_P = -x_S.
    m = wrench_map((0.1, 0.0, 0.0, HALF, 0.0, 0.0, HALF))
    assert np.allclose(m @ [1.0, 0, 0, 0, 0, 0], [0, 1.0, 0, 0, 0, 0.1])  # (0.1,0,0) x (0,1,0) = (0,0,0.1)
    assert np.allclose(m @ [0, 1.0, 0, 0, 0, 0], [-1.0, 0, 0, 0, 0, 0])
    assert np.allclose(m @ [0, 0, 0, 0, 2.0, 0], [0, 0, 0, -2.0, 0, 0])


@given(st.lists(st.floats(-1, 1), min_size=13, max_size=13))
def test_a_wrench_does_the_same_work_in_both_frames(v: list[float]) -> None:
    """Power of a wrench on a twist does not depend on the frame it is written in (Modern Robotics 3.4)."""
    quat = np.array([*v[:3], 1.5])
    pose = Pose(np.array(v[3:6]), quat / np.linalg.norm(quat))
    wrench_P, spin_S, speed_S = np.array(v[:6]), np.array(v[6:9]), np.array(v[9:12])
    wrench_S = wrench_map((*pose.position_m, *pose.quat)) @ wrench_P
    # The same rigid motion seen at P: v_P = v_S + w x p.
    r = pose.rotation.T
    speed_P, spin_P = r @ (speed_S + np.cross(spin_S, pose.position_m)), r @ spin_S
    assert wrench_P[:3] @ speed_P + wrench_P[3:] @ spin_P == pytest.approx(
        wrench_S[:3] @ speed_S + wrench_S[3:] @ spin_S, abs=1e-9
    )


def test_hand_and_probe_balance() -> None:
    # 0.8 kg at 0.08 m and 0.2 kg at 0.03 m beyond P (0.23 m): 1 kg at 0.8 * 0.08 + 0.2 * 0.23 = 0.11 m.
    mass, com = payload_on_tool(0.8, (0.0, 0.0, 0.08), 0.2, (0.0, 0.0, 0.03), OURS)
    assert mass == pytest.approx(1.0)
    assert com == pytest.approx([0.0, 0.0, 0.11])


def test_a_depth_map_in_millimetres_becomes_metres_by_cells() -> None:
    image = np.array([[1.0, 3.0, 0.0, 0.0], [1.0, 3.0, 0.0, 8.0]])
    assert np.allclose(depth_map_m(image, (1, 2), False), [[0.002, 0.002]])
    assert np.allclose(depth_map_m(image, (2, 2), False), [[0.002, 0.0], [0.002, 0.004]])
    assert np.allclose(depth_map_m(image, (2, 2), True), [[0.0, 0.002], [0.004, 0.002]])


def test_a_vendors_image_becomes_red_green_blue_by_cells() -> None:
    blue, green, red = (np.full((2, 4), v) for v in (10, 20, 30))
    red[:, 2:] = 31
    green[0] = 30
    image = np.stack([blue, green, red], axis=-1).astype(np.uint8)
    assert gel_image(image, (1, 2), False).tolist() == [[[30, 25, 10], [31, 25, 10]]]
    assert gel_image(image, (2, 2), True).tolist() == [[[31, 30, 10], [30, 30, 10]], [[31, 20, 10], [30, 20, 10]]]
    assert gel_image(np.zeros((5, 7, 3), np.uint8), (2, 3), False).shape == (2, 3, 3)


def test_dead_pixels_are_left_out() -> None:
    image = np.array([[1.0, np.nan, np.nan, np.nan]])
    got = depth_map_m(image, (1, 2), False)
    assert got[0, 0] == pytest.approx(0.001)
    assert np.isnan(got[0, 1])


def test_an_image_that_does_not_divide_evenly_still_has_the_shape() -> None:
    assert depth_map_m(np.ones((702, 401)), (35, 20), False) == pytest.approx(np.full((35, 20), 1e-3))


@given(st.lists(st.floats(-1.5, 1.5), min_size=7, max_size=7), st.lists(st.floats(-1, 1), min_size=7, max_size=7))
def test_the_chain_agrees_with_a_finite_difference(q: list[float], dq: list[float]) -> None:
    at, rate, step = np.array(q), np.array(dq), 1e-6
    pose, twist = Chain(RIZON4_XENSE).pose_and_twist(at, rate)
    here, ahead = forward(RIZON4_XENSE, at), forward(RIZON4_XENSE, at + step * rate)
    assert np.allclose(pose.position_m, here.position_m, atol=1e-12)
    assert np.allclose(pose.rotation, here.rotation, atol=1e-12)
    assert np.allclose(twist[:3], (ahead.position_m - here.position_m) / step, atol=1e-5)
    turn = (ahead.rotation @ here.rotation.T - np.eye(3)) / step
    assert np.allclose(twist[3:], [turn[2, 1], turn[0, 2], turn[1, 0]], atol=1e-5)


def test_the_vendors_own_kinematics_at_two_postures() -> None:
    """Flange poses computed from flexiv_description: q = 0 and the vendor's home."""
    to_P = np.array([0.0, 0.0, 0.2])
    zero, _ = Chain(RIZON4_XENSE).pose_and_twist(np.zeros(7), np.zeros(7))
    flange = zero.position_m - zero.rotation @ to_P
    assert flange == pytest.approx([0.096, -0.113, 1.255], abs=1e-3)
    home, _ = Chain(RIZON4_XENSE).pose_and_twist(np.deg2rad([0, -40, 0, 90, 0, 40, 0]), np.zeros(7))
    flange = home.position_m - home.rotation @ to_P
    assert flange == pytest.approx([0.687, -0.113, 0.3266], abs=1e-3)
    assert abs(home.quat @ [0.0, 0.0, 1.0, 0.0]) == pytest.approx(1.0, abs=1e-6)
