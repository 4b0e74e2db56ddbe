"""The driver's hard limit: the same decisions as the simulated robot's, and the power of a pressing hand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from glotouch_backends.flexiv_xense.driver.frames import twist_between
from glotouch_backends.flexiv_xense.driver.hard_limit import HardLimit, pressing_power_W
from glotouch_backends.mujoco.control import HardLimitGuard
from glotouch_bt.robot import Limits


@pytest.mark.parametrize("seed", range(20))
def test_it_decides_as_the_simulated_robot_does(seed: int) -> None:
    rng = np.random.default_rng(seed)
    limits = Limits()
    guard, driver = HardLimitGuard(limits), HardLimit(limits.stop_force_N, limits.stop_torque_Nm)
    for i in range(2000):
        if i % 40 == 0:
            speed, twist = rng.uniform(0.0, 0.9), np.r_[rng.normal(0.0, 0.02, 3), rng.normal(0.0, 0.1, 3)]
            force, torque = rng.normal(0.0, 6.0, 3), rng.normal(0.0, 1.5, 3)
        wrench = np.r_[force, torque] * (1.0 + speed * np.sin(0.3 * i)) + rng.normal(0.0, 0.1, 6)
        guard.check(wrench.tolist(), lambda t=twist: t[None], 0.001 * i)
        stop = driver.check(wrench.tolist(), lambda w=wrench, t=twist: float(-w @ t))
        assert (stop is None) == (guard.tripped is None)
        if stop is not None and guard.tripped is not None:
            t = guard.tripped
            assert stop == pytest.approx((t.quantity, t.value, t.limit))
            return
    pytest.fail("never tripped")


@pytest.mark.parametrize("seed", range(5))
def test_the_twist_between_two_poses(seed: int) -> None:
    """Against scipy's rotation vectors; the quaternion's sign does not matter."""
    rng = np.random.default_rng(seed)
    first, turn = Rotation.random(random_state=seed), Rotation.from_rotvec(rng.normal(0.0, 1e-3, 3))
    before, after = rng.normal(size=7), rng.normal(size=7)
    before[3:] = first.as_quat(scalar_first=True)
    after[3:] = -(turn * first).as_quat(scalar_first=True)
    twist = twist_between(before, after, 0.005)
    assert np.allclose(twist[:3], (after[:3] - before[:3]) / 0.005)
    assert np.allclose(twist[3:], turn.as_rotvec() / 0.005, atol=1e-6)


def test_a_hand_that_moves_into_the_force_puts_power_in() -> None:
    """P is turned by half a turn about x, so that a push up is -z in P."""
    pose = [0.5, 0.0, 0.3, 0.0, 1.0, 0.0, 0.0]
    down, up = [0.0, 0.0, -0.1, 0.0, 0.0, 0.0], [0.0, 0.0, 0.1, 0.0, 0.0, 0.0]
    assert pressing_power_W([0.0, 0.0, -10.0, 0.0, 0.0, 0.0], pose, [up, down]) == pytest.approx(1.0)
    assert pressing_power_W([0.0, 0.0, -10.0, 0.0, 0.0, 0.0], pose, [up]) == pytest.approx(-1.0)
