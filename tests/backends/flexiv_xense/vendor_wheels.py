"""The real vendors' packages in throw-away environments of Python 3.10, kept between runs in the user's cache."""

from __future__ import annotations

import glob
import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support.other_environment import environment

PINS = {
    "1.9": ("flexivrdk==1.9.4.1", "xensesdk==2.2.2", "xensegripper==1.3.0"),
    "2.0": ("flexivrdk==2.0.0",),
}
MODULES = {"1.9": ("flexivrdk", "xensesdk", "xensegripper.xense_gripper"), "2.0": ("flexivrdk",)}
SCRIPT = Path(__file__).with_name("introspect_vendor.py")
LOOK_S = 60
NOT_COMPARED = "not compared with the real vendors' packages"


def _candidates() -> Iterator[str]:
    """Interpreters that may be Python 3.10: the one that is named, the path's, pyenv's."""
    named = os.environ.get("GLOTOUCH_PYTHON310")
    if named:
        yield named
    on_path = shutil.which("python3.10")
    if on_path:
        yield on_path
    for root in (os.environ.get("PYENV_ROOT"), Path.home() / ".pyenv"):
        if root:
            yield from sorted(glob.glob(f"{root}/versions/3.10.*/bin/python3.10"), reverse=True)


def python310() -> str:
    """A Python 3.10 that runs; skip if there is none."""
    for path in _candidates():
        try:
            done = subprocess.run(
                [path, "-c", "import sys; print(sys.version_info[:2])"], capture_output=True, text=True
            )
        except OSError:
            continue
        if done.returncode == 0 and done.stdout.strip() == "(3, 10)":
            return path
    pytest.skip(f"{NOT_COMPARED}: there is no Python 3.10 here (GLOTOUCH_PYTHON310 can name one)")


def real_api(api: str, out: Path) -> dict[str, Any]:
    """What the real modules offer, as `introspect_vendor.py` writes it to `out`."""
    python = environment(python310, PINS[api], NOT_COMPARED)
    done = subprocess.run(
        [python, SCRIPT, out, *MODULES[api]], capture_output=True, text=True, timeout=LOOK_S, cwd=out.parent
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(out.read_text())
    assert isinstance(found, dict)
    return found
