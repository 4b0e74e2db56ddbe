"""The simulated arm's motion generator against dense sampling; its kinematics against the planner's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glotouch_backends.flexiv_xense.simulated.kinematics import rotation_between
from glotouch_backends.flexiv_xense.simulated.trajectory import STREAM_S, Trajectory, cubic_extremes, shortest
from glotouch_backends.mujoco.model.compile import STEP_S
from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.motion import Kinematics as Planner
from glotouch_bt.robot import Pose
from tests.backends.flexiv_xense.simulated_rig import vendor

speeds = st.floats(-1.0, 1.0)


@given(st.floats(-0.5, 0.5), speeds, speeds, st.floats(0.01, 2.0))
@settings(max_examples=200, deadline=None)
def test_extremes_of_a_cubic(delta: float, v0: float, v1: float, time_s: float) -> None:
    s = np.linspace(0.0, 1.0, 2001)
    a, b = v0 * time_s, v1 * time_s
    c2, c3 = 3 * delta - 2 * a - b, -2 * delta + a + b
    velocity = (a + 2 * c2 * s + 3 * c3 * s * s) / time_s
    acceleration = (2 * c2 + 6 * c3 * s) / time_s**2
    fastest, hardest = cubic_extremes(np.array([delta]), np.array([v0]), np.array([v1]), time_s)
    assert fastest[0] == pytest.approx(np.abs(velocity).max(), rel=1e-3, abs=1e-9)
    assert hardest[0] == pytest.approx(np.abs(acceleration).max(), rel=1e-3, abs=1e-9)


def steps(t: Trajectory, n: int) -> np.ndarray:
    """Return the positions (n + 1, dof) at the end of each step, the present one first."""
    out = [t.q.copy()]
    for _ in range(n):
        t.advance()
        out.append(t.q.copy())
    return np.array(out)


def test_a_motion_ends_with_its_velocity_and_keeps_it() -> None:
    t = Trajectory(np.zeros(2))
    t.go(np.array([0.01, -0.02]), np.array([0.1, 0.0]), 0.05)
    track = steps(t, 100)
    np.testing.assert_allclose(track[50], [0.01, -0.02], atol=1e-12)
    np.testing.assert_allclose(track[100], [0.01 + 0.1 * 0.05, -0.02], atol=1e-12)
    assert not t.at_rest


def test_braking_is_uniform() -> None:
    """From (0.4, -0.2) rad/s with 2 rad/s2: 0.2 s, both joints in proportion."""
    t = Trajectory(np.zeros(2))
    t.go(np.array([0.004, -0.002]), np.array([0.4, -0.2]), 0.01)
    steps(t, 10)
    start = t.q.copy()
    t.brake(2.0)
    track = steps(t, 300) - start
    np.testing.assert_allclose(track[-1], [0.04, -0.02], atol=1e-9)
    np.testing.assert_allclose(track[:, 1], -0.5 * track[:, 0], atol=1e-12)
    time = STEP_S * np.arange(201)
    np.testing.assert_allclose(track[:201, 0], 0.4 * time - time**2, atol=1e-9)
    assert t.at_rest


@given(st.floats(-0.3, 0.3), st.floats(0.2, 2.0), st.floats(0.5, 10.0))
@settings(max_examples=30, deadline=None)
def test_the_shortest_time_obeys_the_limits(delta: float, max_vel: float, max_acc: float) -> None:
    zero = np.zeros(1)

    def fits(time_s: float) -> bool:
        fastest, hardest = cubic_extremes(np.array([delta]), zero, zero, time_s)
        return bool(fastest[0] <= max_vel and hardest[0] <= max_acc)

    time_s = shortest(fits)
    assert fits(time_s)
    needed = max(1.5 * abs(delta) / max_vel, np.sqrt(6 * abs(delta) / max_acc), STREAM_S)
    assert needed <= time_s <= 1.021 * needed


def test_kinematics_agree_with_the_planners() -> None:
    ours, planner = vendor().world.arm.kinematics, Planner(RIZON4_XENSE)
    rng = np.random.default_rng(1)
    for _ in range(20):
        q = np.array(RIZON4_XENSE.home_q) + rng.uniform(-0.5, 0.5, 7)
        position, rotation, jacobian = ours.at(q)
        pose = planner.fk(q)
        np.testing.assert_allclose(position, pose.position_m, atol=1e-9)
        np.testing.assert_allclose(rotation, pose.rotation, atol=1e-9)
        np.testing.assert_allclose(jacobian, planner.jacobian(q), atol=1e-9)


def test_inverse_kinematics_reaches_the_pose_and_pulls_to_the_posture() -> None:
    k, home = vendor().world.arm.kinematics, np.array(RIZON4_XENSE.home_q)
    position, rotation, _ = k.at(home)
    goal = Pose.from_matrix(position + np.array([0.05, -0.08, 0.03]), rotation)
    away = home + np.array([0.3, 0.0, -0.3, 0.0, 0.2, 0.0, 0.0])
    found = k.solve(goal, away, home, 10.0)
    assert found is not None
    reached, turned, _ = k.at(found[0])
    np.testing.assert_allclose(reached, goal.position_m, atol=1e-7)
    assert np.abs(rotation_between(goal.rotation, turned)).max() < 1e-7
    assert np.linalg.norm(found[0] - home) < np.linalg.norm(away - home)
    assert k.solve(Pose(np.array([3.0, 0.0, 0.0])), home, home, 0.01) is None
