"""Third-party modules that are loaded on first use, so that `glotouch check` and `glotouch --help` start quickly.

scipy loads its own subpackages on first use, so `import scipy` needs no help.
"""

from __future__ import annotations

import gc
import importlib
import importlib.util
import sys
from collections.abc import Callable
from types import ModuleType
from typing import Any

_MODULES: list[str] = []
_DOORS: list[tuple[str, str]] = []
_LOADERS: list[Callable[[], object]] = []
GARBAGE_OBJECTS = 20_000
"""New objects between two collections of garbage. Python's default is 700, and a control period makes hundreds.
Source: ours."""
_SCIPY = ("interpolate", "linalg.lapack", "ndimage", "sparse.csgraph", "spatial", "special")


def lazy_module(name: str) -> ModuleType:
    """Return a module that is loaded on the first access to one of its attributes.

    Raises:
        ModuleNotFoundError: It is not installed.
    """
    _MODULES.append(name)
    if name in sys.modules:
        return sys.modules[name]
    if not _put_off(name):
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)
    return sys.modules[name]


def spare(*names: str) -> None:
    """Put off the loading of modules of a package that others look up there and do not use: SciPy copies every name of
    NumPy. They are loaded on the first access to one of their attributes, and not by `load_all`.
    """
    for name in names:
        if name not in sys.modules:
            _put_off(name)


def _put_off(name: str) -> bool:
    """Make a module that is loaded on the first access to one of its attributes; return False if there is none."""
    spec = importlib.util.find_spec(name)
    if spec is None or spec.loader is None:
        return False
    spec.loader = importlib.util.LazyLoader(spec.loader)
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    package, _, own = name.rpartition(".")
    if package:
        setattr(sys.modules[package], own, module)
    return True


def lazy_door(package: str, **files: str) -> Callable[[str], Any]:
    """Return a module `__getattr__` for the door of `package` that imports each name from its file on first access."""

    _DOORS.extend((package, file) for file in sorted(set(files.values())))

    def load(name: str) -> Any:
        if name not in files:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(importlib.import_module(f"{package}.{files[name]}"), name)

    return load


def on_load_all(load: Callable[[], object]) -> None:
    """Have `load_all` call a function; it may be called several times."""
    _LOADERS.append(load)


def load_all() -> None:
    """Load every lazy module now, so that no import delays a control period of a robot that would not wait."""
    gc.disable()  # what a module makes stays; a collection would find nothing
    try:
        for package, file in _DOORS:
            importlib.import_module(f"{package}.{file}")
        for name in _MODULES:
            dir(sys.modules[name])  # any access to an attribute loads it
        for name in _SCIPY:
            importlib.import_module(f"scipy.{name}")
        for load in _LOADERS:
            load()
    finally:
        gc.enable()
    settle_garbage()


def settle_garbage() -> None:
    """Keep what there is now out of all later collections of garbage."""
    if gc.get_freeze_count():
        gc.collect()  # what an earlier run in this process has left would be kept for ever
    gc.freeze()  # a collection while the arm moves looks at what is made from now on only
    collect_rarely()


def collect_rarely() -> None:
    """Make collections of garbage rare, also while modules are loaded: what they make stays."""
    gc.set_threshold(GARBAGE_OBJECTS)
