"""Compilation of small numerical loops to machine code.

A control period has hundreds of operations on a few numbers each. NumPy takes about a microsecond for one of them, a
compiled function for a whole loop. Numba keeps the machine code on disk, so only the first run after an installation
waits for the compiler.

A compiled function calls no compiled function: Numba renews its code on disk only when its own file changes.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any, TypeVar, cast

from glotouch_bt.lazy import on_load_all

F = TypeVar("F", bound=Callable[..., Any])


class _Uncompiled:
    """Stands in for a function until the first call or `load_all`, so that `glotouch check` does not load Numba."""

    def __init__(self, function: Callable[..., Any], signature: str) -> None:
        self._function, self._signature = function, signature
        self._compiled: Callable[..., Any] | None = None
        on_load_all(self.load)

    def load(self) -> Callable[..., Any]:
        """Compile the function, or load its code, and put it into its module in place of this object."""
        if self._compiled is None:
            import numba
            from numba import types

            given = {f"given{n}": types.Array(types.float64, n, "A", readonly=True) for n in (1, 2)}
            exact = eval(self._signature, {"__builtins__": {}}, vars(types) | given)  # as Numba itself reads one
            self._compiled = numba.njit(exact, cache=True, error_model="numpy")(self._function)
            vars(sys.modules[self._function.__module__])[self._function.__name__] = self._compiled
        return self._compiled

    def __call__(self, *args: object) -> Any:
        return self.load()(*args)


def compiled(signature: str) -> Callable[[F], F]:
    """Compile a function of a module for one signature.

    The arithmetic is that of IEEE 754 in the written order, without contraction, so results do not depend on the
    processor. A division by zero gives an infinity or NaN, as in NumPy.

    Args:
        signature: Types in Numba's notation: `f8(f8[::1], i8)`; `::1` requires a contiguous axis. `given1` and `given2`
            are arrays of one and two axes that the function only reads; they need not be contiguous or writeable.
            Arguments of other types raise a TypeError; no control period waits for the compiler.
    """

    def replace(function: F) -> F:
        return cast("F", _Uncompiled(function, signature))

    return replace
