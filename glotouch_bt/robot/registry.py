"""Find backends by name through the entry-point group `glotouch_bt.backends`."""

from __future__ import annotations

from importlib.metadata import EntryPoint

from glotouch_bt.errors import BackendError, UnknownName
from glotouch_bt.plugins import plugins
from glotouch_bt.robot.interface import Backend

GROUP = "glotouch_bt.backends"


def backend_entry_points() -> dict[str, EntryPoint]:
    """Return the installed backends by name without importing them."""
    return plugins(GROUP)


def load_backend(name: str) -> Backend:
    """Import and create one backend.

    Raises:
        UnknownName: It is not registered; lists those that are.
        BackendError: It is registered but cannot be imported here (a missing dependency); cause chained.
    """
    found = backend_entry_points()
    if name not in found:
        raise UnknownName("backend", name, found)
    try:
        factory = found[name].load()
    except ImportError as e:
        raise BackendError(f"backend {name!r} cannot be used here: {e}") from e
    backend = factory()
    if not isinstance(backend, Backend):
        raise BackendError(f"entry point {name!r} of {GROUP} gives {type(backend).__name__}, not a Backend")
    return backend
