"""Throw-away environments with packages that this project does not depend on, kept between runs in the user's cache."""

from __future__ import annotations

import fcntl
import hashlib
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

# Read when this is imported: other tests point the cache elsewhere while they run.
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "glotouch-bt" / "vendor"
REQUIRED = bool(os.environ.get("GLOTOUCH_REQUIRE_VENDOR"))
INSTALL_S = 280


def environment(find_python: Callable[[], str], packages: Sequence[str], what: str, *, key: str = "") -> Path:
    """The interpreter of an environment with these packages; made if need be.

    Args:
        find_python: Returns the interpreter to make it with; called only if need be.
        packages: Arguments of `pip install`.
        what: What is not tested without it, for the skip.
        key: Content that the packages depend on besides their names.
    """
    text = "\n".join(packages) + key
    folder = CACHE / hashlib.sha256(text.encode()).hexdigest()[:16]
    python, done = folder / "bin" / "python", folder / "complete"
    CACHE.mkdir(parents=True, exist_ok=True)
    with (CACHE / f"{folder.name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if done.exists() and python.exists():
            return python
        base = find_python()
        shutil.rmtree(folder, ignore_errors=True)
        # This environment's pip installs into the other one: to give that one a pip of its own takes longer.
        pip = [sys.executable, "-m", "pip", "--python", python, "install", "--quiet", *packages]
        for command in ([base, "-m", "venv", "--without-pip", folder], pip):
            made = subprocess.run(command, capture_output=True, text=True, timeout=INSTALL_S)
            if made.returncode != 0:
                if REQUIRED:
                    pytest.fail(f"GLOTOUCH_REQUIRE_VENDOR is set, but: {made.stderr}")
                said = (made.stderr.strip() or made.stdout.strip() or "no reason given").splitlines()[-1]
                pytest.skip(f"{what}: {' '.join(packages)} cannot be installed: {said}")
        done.touch()
    return python
