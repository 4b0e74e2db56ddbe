"""Geometry against numpy."""

import numpy as np
import pytest

from glotouch_bt.robot import cross


@pytest.mark.parametrize("shape", [(3,), (10, 3), (2, 5, 3)])
def test_cross_has_the_bits_of_numpy(shape: tuple[int, ...]) -> None:
    rng = np.random.default_rng(3)
    p, v = rng.normal(size=3), rng.normal(size=shape)
    np.testing.assert_array_equal(cross(p, v), np.cross(p, v))
