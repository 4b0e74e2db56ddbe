"""The real vendors' packages in throw-away environments of Python 3.10, kept between runs in the user's cache."""

from __future__ import annotations

import fcntl
import glob
import hashlib
import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

PINS = {
    "1.9": ("flexivrdk==1.9.4.1", "xensesdk==2.2.2", "xensegripper==1.3.0"),
    "2.0": ("flexivrdk==2.0.0",),
}
MODULES = {"1.9": ("flexivrdk", "xensesdk", "xensegripper.xense_gripper"), "2.0": ("flexivrdk",)}
SCRIPT = Path(__file__).with_name("introspect_vendor.py")
# Read when this is imported: other tests point the cache elsewhere while they run.
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "glotouch-bt" / "vendor"
REQUIRED = bool(os.environ.get("GLOTOUCH_REQUIRE_VENDOR"))
INSTALL_S, LOOK_S = 280, 60


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


def python310() -> str | None:
    """A Python 3.10 that runs."""
    for path in _candidates():
        try:
            done = subprocess.run(
                [path, "-c", "import sys; print(sys.version_info[:2])"], capture_output=True, text=True
            )
        except OSError:
            continue
        if done.returncode == 0 and done.stdout.strip() == "(3, 10)":
            return path
    return None


def missing(why: str) -> None:
    """Skip, by name."""
    pytest.skip(f"not compared with the real vendors' packages: {why}")


def environment(api: str) -> Path:
    """The interpreter of an environment with the packages of this version; made if need be."""
    pins = PINS[api]
    folder = CACHE / hashlib.sha256("\n".join(pins).encode()).hexdigest()[:16]
    python, done = folder / "bin" / "python", folder / "complete"
    CACHE.mkdir(parents=True, exist_ok=True)
    with (CACHE / f"{folder.name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if done.exists() and python.exists():
            return python
        base = python310()
        if base is None:
            missing("there is no Python 3.10 here (GLOTOUCH_PYTHON310 can name one)")
        shutil.rmtree(folder, ignore_errors=True)
        for command in ([base, "-m", "venv", folder], [python, "-m", "pip", "install", "--quiet", *pins]):
            made = subprocess.run(command, capture_output=True, text=True, timeout=INSTALL_S)
            if made.returncode != 0:
                if REQUIRED:
                    pytest.fail(f"GLOTOUCH_REQUIRE_VENDOR is set, but: {made.stderr}")
                said = (made.stderr.strip() or made.stdout.strip() or "no reason given").splitlines()[-1]
                missing(f"{' '.join(pins)} cannot be installed: {said}")
        done.touch()
    return python


def real_api(api: str, out: Path) -> dict[str, Any]:
    """What the real modules offer, as `introspect_vendor.py` writes it to `out`."""
    python = environment(api)
    done = subprocess.run(
        [python, SCRIPT, out, *MODULES[api]], capture_output=True, text=True, timeout=LOOK_S, cwd=out.parent
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(out.read_text())
    assert isinstance(found, dict)
    return found
