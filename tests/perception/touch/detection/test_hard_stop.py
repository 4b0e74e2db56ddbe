"""The two rules know nothing of each other: what trips one need not trip the other."""

import numpy as np
import pytest

from glotouch_bt.perception.touch import ContactGuard, GuardParams, HardStop, fit_baseline
from glotouch_bt.robot import Pose

TIP_P, POSE_E_P, LEVER = np.array([0.0, 0.0, 0.13]), Pose(np.array([0.0, 0.0, 0.20])), np.array([0.0, 0.0, 0.33])
R_B_S = np.diag([1.0, -1.0, -1.0])


@pytest.mark.parametrize(("force_N", "soft", "hard"), [(-2.0, True, False), (25.0, False, True), (-25.0, True, True)])
def test_soft_and_hard_rule_are_independent(bench, force_N, soft, hard):
    """Moving along x: 2 N against it is a touch; 25 N WITH it is none, yet too much; 25 N against it is both."""
    rng = np.random.default_rng(0)
    baseline = fit_baseline(np.vstack([b.wrench_S for b in bench.blocks(np.zeros((120, 3)), rng=rng, lever=LEVER)]))
    force = np.zeros((200, 3))
    force[100:, 0] = force_N
    blocks = bench.blocks(force @ R_B_S, rng=rng, lever=LEVER)
    guard = ContactGuard(baseline, np.array([1.0, 0, 0]), TIP_P, POSE_E_P, GuardParams())
    stop = HardStop(baseline, GuardParams())
    assert any(guard(b) is not None for b in blocks) == soft
    assert any(stop(b) is not None for b in blocks) == hard


@pytest.mark.parametrize(
    ("baseline", "wrench", "quantity"),
    [
        ([0, 0, 25.0, 0, 0, 0], [0, 0, 29.0, 0, 0, 0], None),
        ([0, 0, 25.0, 0, 0, 0], [0, 0, 31.0, 0, 0, 0], "force_N"),
        ([0, 0, -15.0, 0, 0, 0], [0, 0, 6.0, 0, 0, 0], "residual_force_N"),
        ([0, 0, 0, 0, 9.0, 0], [0, 0, 0, 0, 10.5, 0], "torque_Nm"),
        ([0, 0, 0, 0, -4.0, 0], [0, 0, 0, 0, 3.0, 0], "residual_torque_Nm"),
    ],
)
def test_absolute_and_residual_limits(bench, baseline, wrench, quantity):
    still = bench.blocks(np.zeros((10, 3)), rng=np.random.default_rng(0), lever=LEVER)[0]
    still.wrench_S[:] = wrench
    trip = HardStop(fit_baseline(np.tile(np.array(baseline, float), (5, 1))), GuardParams())(still)
    assert (trip.quantity if trip else None) == quantity
