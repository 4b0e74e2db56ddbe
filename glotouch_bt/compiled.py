"""Compilation of small numerical loops to machine code.

A control period has some dozens of operations on a few numbers each. NumPy takes about a microsecond for every one of
them, a compiled function for all together. Numba keeps the machine code on disk, so only the first run after an
installation waits for the compiler.

A compiled function calls compiled functions of its own file only: the code on disk is renewed when that file changes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
from numba import types

F = TypeVar("F", bound=Callable[..., Any])


READ_ONLY = {f"given{n}": types.Array(types.float64, n, "A", readonly=True) for n in (1, 2)}
"""Names of arrays of one and two axes that a function only reads; they need not be contiguous or writeable."""


def compiled(signature: str) -> Callable[[F], F]:
    """Compile a function for one signature when its file is imported.

    The arithmetic is that of IEEE 754 in the written order, without contraction, so results do not depend on the
    processor. A division by zero gives an infinity or NaN, as in NumPy.

    Args:
        signature: Types in Numba's notation, or of `READ_ONLY`: `f8(f8[::1], given2)`. `::1` requires a contiguous
            axis. Arguments of other types are refused and never compiled for, so no control period waits for the
            compiler.
    """
    exact = eval(signature, {"__builtins__": {}}, {**vars(types), **READ_ONLY})  # as Numba itself reads a signature
    return cast("Callable[[F], F]", numba.njit(exact, cache=True, error_model="numpy"))
