"""Where a push met its object, from made forces."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from glotouch_skills.make_space.push_guard import STARTED_M, PushGuard

PERIOD_S, SPEED_M_S, RISE_S = 0.01, 0.02, 0.2


@pytest.mark.parametrize("met_m", [0.004, 0.012, math.inf])
@pytest.mark.parametrize("inertia_N", [0.0, 0.2])
def test_the_object_is_met_where_the_resistance_begins_not_where_the_hand_accelerates(
    met_m: float, inertia_N: float
) -> None:
    t = PERIOD_S * np.arange(150)
    along = SPEED_M_S * np.where(t < RISE_S, 0.5 * t**2 / RISE_S, t - 0.5 * RISE_S)  # constant acceleration, then speed
    assert along[t < RISE_S].max() <= STARTED_M
    force = np.where(t < RISE_S, inertia_N, 0.0) + np.where(along >= met_m, 0.3, 0.0)
    arm = SimpleNamespace(period_s=PERIOD_S)
    guard = PushGuard(cast(Any, arm), np.zeros(3), np.array([1.0, 0.0, 0.0]), 6.0)
    guard.resistance_N, guard.along_m = force.tolist(), (0.5 + along).tolist()
    if math.isinf(met_m):
        assert math.isnan(guard.met_m())
    else:
        assert guard.met_m() == pytest.approx(0.5 + met_m, abs=SPEED_M_S * PERIOD_S)
