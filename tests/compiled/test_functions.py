"""Compiled functions: one signature, results of plain Python, loaded at the first call or before a run."""

from __future__ import annotations

import numpy as np
import pytest

from glotouch_bt.compiled import compiled
from glotouch_bt.robot import Array


@compiled("given f8[:, :]", "f8", "i8")
def scaled(values: Array, factor: float, count: int) -> Array:
    out = np.zeros(values.shape)
    for i in range(count):
        for j in range(values.shape[1]):
            out[i, j] = values[i, j] * factor
    return out


def test_arrays_that_are_only_read_may_be_strided_or_read_only() -> None:
    whole = np.arange(40.0).reshape(5, 8)
    frozen = whole.copy()
    frozen.setflags(write=False)
    for values in (whole, whole[:, 2:5], whole.T, frozen):
        np.testing.assert_array_equal(scaled(values, 0.1, len(values)), values * 0.1)


@pytest.mark.parametrize("wrong", [np.zeros(3), np.zeros((2, 2), dtype=np.float32), [[1.0]]])
def test_another_type_is_an_error_and_not_compiled_for(wrong: object) -> None:
    with pytest.raises(TypeError):
        scaled(wrong, 1.0, 1)  # type: ignore[arg-type]


def test_the_function_replaces_its_stand_in() -> None:
    scaled(np.zeros((1, 1)), 1.0, 1)
    assert type(scaled).__name__ == "CPUDispatcher"
    assert scaled.__name__ == "scaled"
