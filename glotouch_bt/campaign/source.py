"""The commit of the source that runs."""

from __future__ import annotations

import shutil
import subprocess
from functools import cache
from pathlib import Path

from glotouch_bt.version import __version__

ROOT = Path(__file__).resolve().parents[2]
"""Folder above the package: the checkout, if there is one."""
CHANGED = " (changed)"
"""Follows the commit of a checkout with changes that are not committed."""


@cache
def commit_of_source() -> str:
    """Return the short commit of the checkout, with `CHANGED` if tracked files differ; else the version."""
    git = shutil.which("git")
    if git is None or not (ROOT / ".git").exists():
        return f"version {__version__}"
    commit = _output(git, "rev-parse", "--short", "HEAD")
    if not commit:
        return f"version {__version__}"
    return commit + (CHANGED if _output(git, "status", "--porcelain", "--untracked-files=no") else "")


def _output(git: str, *words: str) -> str:
    done = subprocess.run([git, "-C", str(ROOT), *words], capture_output=True, text=True, check=False)
    return done.stdout.strip() if done.returncode == 0 else ""
