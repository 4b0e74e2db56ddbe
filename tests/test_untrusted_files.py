"""Only `glotouch_bt.untrusted` opens files that a stranger may have written; every other use of files has a reason."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("glotouch_bt", "glotouch_skills", "glotouch_backends")
OPENING = {
    "open", "fdopen", "read_text", "read_bytes", "write_text", "write_bytes", "memmap", "fromfile", "load", "loads",
    "rmtree", "decompress", "load_mesh", "connect", "copyfile", "copy2", "copytree", "savez", "savez_compressed",
}  # fmt: skip
"""Names of functions that open, read, unpack or delete files, or parse what they hold."""
MODULES = {"json", "np", "numpy", "pickle", "marshal", "shelve", "zipfile", "tarfile", "zstandard", "sqlite3", "shutil",
           "trimesh", "os", "io", "yaml", "gzip", "zlib", "lzma"}  # fmt: skip
"""Modules whose functions of these names count; methods of other objects count only if they are those of `Path`."""
METHODS = {"read_text", "read_bytes", "write_text", "write_bytes"}

OWN = "our own folder, made in this process"
BENCH = "results of an experiment that the user started, in the folder that the user named"
DRIVER = "the driver stands alone and imports nothing of ours; see its own limits"
ALLOWED = {
    "glotouch_bt/untrusted": "the reader and the writer",
    "glotouch_bt/mission/checkpoint/store.py": "SQLite opens its file itself, after the reader has checked it",
    "glotouch_bt/perception/model_cache.py": "maps the file that the reader has opened; writes with mkstemp",
    "glotouch_backends/mujoco/hulls/files.py": "parses what the reader has bounded; the installed package; its lock",
    "glotouch_backends/mujoco/hulls/decompose.py": OWN,
    "glotouch_backends/mujoco/hulls/coacd_worker.py": OWN,
    "glotouch_bt/robot/scene/meshes.py": "parses what the reader has bounded",
    "glotouch_bt/report/scene/played.py": "the installed package's own script",
    "glotouch_bt/runs/folder.py": "opens the folder for its lock",
    "glotouch_bt/commands/shared/output.py": "/dev/null",
    "glotouch_bt/commands/tree.py": "writes the drawing to the file that the user names",
    "glotouch_backends/flexiv_xense/driver": DRIVER,
    "glotouch_backends/flexiv_xense/simulated": DRIVER,
    "glotouch_backends/trial_message.py": "private folder of the driver",
    "glotouch_backends/flexiv_xense/client": "private folder of the driver, and the log that the user names",
    "glotouch_bt/bench": BENCH,
    "glotouch_bt/campaign": BENCH,
    "glotouch_bt/claims": BENCH,
    "glotouch_bt/validation": BENCH,
    "glotouch_bt/commissioning/keys.py": "keys in the folder that the user names, created anew with mode 0600",
    "glotouch_bt/mission/load.py": "parses a word of the command line",
}
"""Files and folders that may, and why."""


def uses(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text())):
        if not isinstance(node, ast.Call):
            continue
        called = node.func
        if isinstance(called, ast.Name) and called.id == "open":
            yield f"{path.relative_to(ROOT)}:{node.lineno}: open"
        elif isinstance(called, ast.Attribute) and called.attr in OPENING:
            owner = called.value.id if isinstance(called.value, ast.Name) else ""
            if owner in MODULES or (called.attr in METHODS and len(node.args) < 2):  # two: `RunFolder.write_text`
                yield f"{path.relative_to(ROOT)}:{node.lineno}: {owner}.{called.attr}"


def test_untrusted_files_are_opened_in_one_place() -> None:
    found = [use for p in PACKAGES for path in sorted((ROOT / p).rglob("*.py")) for use in uses(path)]
    assert len(found) > 20, "the search finds something"
    assert [use for use in found if not use.startswith(tuple(ALLOWED))] == [], "read it through glotouch_bt.untrusted"


def test_every_reason_is_still_needed() -> None:
    found = [use for p in PACKAGES for path in sorted((ROOT / p).rglob("*.py")) for use in uses(path)]
    assert [a for a in ALLOWED if not any(use.startswith(a) for use in found)] == []
