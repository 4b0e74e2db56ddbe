"""The zero of the jaws from a handle of known width: a closed form, and what says nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glotouch_bt.perception.touch.calibration.jaw_zero import JawZero, measured_zero
from glotouch_bt.robot import GripperState, TactileFrame

SHAPE = (35, 20)


class Seen:
    """What `measured_zero` reads of an observation."""

    def __init__(self, aperture_m: float, left: Any, right: Any) -> None:
        self.gripper = GripperState(0.0, aperture_m, 60.0, False)
        self.tactile = None if left is None else TactileFrame(0.0, np.full(SHAPE, left), np.full(SHAPE, right))


@given(
    error=st.floats(-1e-3, 1e-3), left=st.floats(3e-4, 1.4e-3), right=st.floats(3e-4, 1.4e-3), seed=st.integers(0, 99)
)
def test_zero_is_measured_for_any_indentation(error: float, left: float, right: float, seed: int) -> None:
    """Harsh noise, and 3 % of the taxels dead: 20 reports leave 0.15 / sqrt(20) = 0.034 mm."""
    rng = np.random.default_rng(seed)
    width, blocks = 0.016, []
    for k in range(20):
        b: Any = Seen(width - left - right + error + rng.normal(0.0, 1.5e-4), None if k < 6 else left, right)
        if b.tactile is not None:
            for m in (b.tactile.left_m, b.tactile.right_m):
                m += rng.normal(0.0, 5e-5, SHAPE)
                m[rng.random(SHAPE) < 0.03] = np.nan
        blocks.append(b)
    zero = measured_zero(blocks, width, SHAPE)
    assert zero.error_m == pytest.approx(error, abs=1.5e-4)
    assert zero.sd_m < JawZero().sd_m


@pytest.mark.parametrize(("left", "right"), [(None, None), (0.0, 5e-4), (5e-4, np.nan), (0.0, 0.0)])
def test_zero_is_not_measured_without_contact_on_both_pads(left: float | None, right: float | None) -> None:
    blocks: list[Any] = [Seen(0.0149, left, right) for _ in range(20)]
    assert measured_zero(blocks, 0.016, SHAPE) == JawZero()
