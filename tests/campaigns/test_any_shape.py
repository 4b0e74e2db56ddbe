"""Recognition and planning end without an exception, whatever the shape; `touched_shapes` runs as many as wanted."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.support import any_shape
from tests.support.touched_shapes import try_shape

SHAPES = 24


@pytest.fixture(autouse=True, scope="module")
def coarse():
    """Grow solids on a coarse grid: faster, and no less odd."""
    fine, any_shape.CELL_M = any_shape.CELL_M, 0.0035
    yield
    any_shape.CELL_M = fine


@pytest.mark.parametrize("kind", any_shape.KINDS, ids=lambda kind: kind.__name__)
def test_solids_are_closed_stand_and_fit_the_jaws(kind) -> None:
    mesh = any_shape.drawn(np.random.default_rng(5), kind)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0
    assert any_shape.usable(mesh)
    assert mesh.bounds[0, 2] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.study
@settings(max_examples=SHAPES, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(seed=st.integers(0, 2**31), number=st.integers(0, 10 * len(any_shape.KINDS)))
def test_no_shape_ends_in_an_exception(seed: int, number: int) -> None:
    try_shape(seed, number)
