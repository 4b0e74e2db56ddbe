"""Functions and classes of other packages, found by name through entry points. A module is imported on first use."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import cache
from importlib.metadata import EntryPoint, EntryPoints, entry_points
from typing import Any

from glotouch_bt.errors import BadInput

POLICIES = "glotouch_bt.search_policies"
"""Group of search policies: callables that take a seed and return a `SearchPolicy`."""
MATCHERS = "glotouch_bt.matchers"
"""Group of matchers: callables that take a mesh and TouchSets; see docs/guides/own_method.md."""


def plugins(group: str) -> dict[str, EntryPoint]:
    """Return the entry points of a group by name, sorted, without importing them."""
    return {e.name: e for e in sorted(_installed(tuple(sys.path))(group=group), key=lambda e: e.name)}


@cache
def _installed(path: tuple[str, ...]) -> Callable[..., EntryPoints]:
    """Return the selection from the entry points on `sys.path`; to find them takes 20 ms, and a run asks often."""
    return entry_points().select


@cache
def load_plugin(point: EntryPoint) -> Any:
    """Import what an entry point names.

    Raises:
        BadInput: Its module cannot be imported, or it is not callable; cause chained.
    """
    try:
        found = point.load()
    except Exception as e:  # the module of a stranger may raise anything
        raise BadInput(
            f"{point.name}: {point.value} of {point.group} cannot be imported: {type(e).__name__}: {e}"
        ) from e
    if not callable(found):
        raise BadInput(f"{point.name}: {point.value} of {point.group} is not callable")
    return found
