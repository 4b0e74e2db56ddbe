"""Compilation of small numerical loops to machine code.

A control period has hundreds of operations on a few numbers each. NumPy takes about a microsecond for one of them, a
compiled function for a whole loop. Numba keeps the machine code on disk, so only the first run after an installation
waits for the compiler.

A compiled function calls no compiled function: Numba renews its code on disk only when its own file changes.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from typing import Any, TypeVar, cast

from glotouch_bt.lazy import on_load_all

F = TypeVar("F", bound=Callable[..., Any])
_TYPE = re.compile(r"(given )?(\w+)(?:\[(.*)\])?")


class _Uncompiled:
    """Stands in for a function until the first call or `load_all`, so that `glotouch check` does not load Numba."""

    def __init__(self, function: Callable[..., Any], arguments: tuple[str, ...]) -> None:
        self._function, self._arguments = function, arguments
        self._compiled: Callable[..., Any] | None = None
        on_load_all(self.load)

    def load(self) -> Callable[..., Any]:
        """Compile the function, or load its code, and put it into its module in place of this object."""
        if self._compiled is None:
            import numba

            signature = tuple(_type(a, numba.types) for a in self._arguments)
            self._compiled = numba.njit(signature, cache=True, error_model="numpy")(self._function)
            vars(sys.modules[self._function.__module__])[self._function.__name__] = self._compiled
        return self._compiled

    def __call__(self, *args: object) -> Any:
        return self.load()(*args)


def _type(text: str, types: Any) -> object:
    """Return Numba's type of an argument; see `compiled`."""
    found = _TYPE.fullmatch(text)
    assert found is not None, text
    given, kind, axes = found.groups()
    if axes is None:
        return getattr(types, kind)
    layout = "C" if axes.endswith("::1") else "A"
    return types.Array(getattr(types, kind), axes.count(",") + 1, layout, readonly=bool(given))


def compiled(*arguments: str) -> Callable[[F], F]:
    """Compile a function of a module.

    The arithmetic is that of IEEE 754 in the written order, without contraction, so results do not depend on the
    processor. A division by zero gives an infinity or NaN, as in NumPy.

    Args:
        arguments: Type of each argument in Numba's notation: `f8`, `i8`, `f8[:, ::1]`; `::1` requires contiguous rows.
            `given f8[:, :]` is an array that the function only reads, and that need not be writeable. Arguments of
            other types raise a TypeError; no control period waits for the compiler.
    """

    def replace(function: F) -> F:
        return cast("F", _Uncompiled(function, arguments))

    return replace
