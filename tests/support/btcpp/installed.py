"""The real BehaviorTree.CPP and a free monitor of it, installed in an environment of their own."""

from __future__ import annotations

import json
import platform
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from tests.support.other_environment import environment

PINS = Path(__file__).with_name("requirements.txt")
LIBRARY, PUBLISHER = (Path(__file__).with_name(f"real_{name}.py") for name in ("library", "publisher"))
PATIENCE_S = 60.0


def btcpp_python() -> Path:
    """The interpreter of the environment; skip where the library has no wheel."""
    if (sys.platform, platform.machine()) != ("linux", "x86_64"):
        pytest.skip("not tested with the real BehaviorTree.CPP: it has wheels for Linux on x86_64 only")
    what = "not tested with the real BehaviorTree.CPP"
    return environment(lambda: sys.executable, ("--require-hashes", "-r", str(PINS)), what, key=PINS.read_text())


def loaded(trees: Sequence[dict[str, Any]], folder: Path) -> list[dict[str, str]]:
    """Load each tree in the real library and return its result; see `real_library.py`."""
    given, results = folder / "trees.json", folder / "results.json"
    given.write_text(json.dumps(trees))
    done = subprocess.run(
        [btcpp_python(), LIBRARY, given, results], capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(results.read_text())
    assert isinstance(found, list)
    assert len(found) == len(trees)
    return found
