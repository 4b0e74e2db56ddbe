"""Write the pictures of docs/gallery.md from recorded runs: reports and one live view. Needs chromium.

MUJOCO_GL=egl python docs/images/gallery.py RUN ...
"""

from __future__ import annotations

import io
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

from glotouch_bt.report import write_report
from glotouch_bt.robot import GlotouchError
from glotouch_bt.runs import write_film

VIEWS = {"": (1120, 1240), "_phone": (390, 1240)}
"""Ending of a picture's name, and the size of its window."""
FLAGS = ("--headless", "--no-sandbox", "--hide-scrollbars", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")


def main(runs: list[str]) -> None:
    """Write report_NAME.webp and report_NAME_phone.webp for each run; NAME is that of its folder."""
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        sys.exit("chromium is needed")
    for run in map(Path, runs):
        try:
            write_film(run)
        except GlotouchError as e:
            print(f"{run}: no film: {e}")
        page = write_report(run).resolve().as_uri()
        for ending, (width, height) in VIEWS.items():
            with tempfile.TemporaryDirectory() as folder:
                shot = Path(folder) / "shot.png"
                command = [browser, *FLAGS, f"--window-size={width},{height}", "--virtual-time-budget=4000"]
                subprocess.run([*command, f"--screenshot={shot}", page], check=True, capture_output=True)
                picture = Image.open(io.BytesIO(shot.read_bytes())).convert("RGB")
            out = Path(__file__).with_name(f"report_{run.name}{ending}.webp")
            picture.save(out, quality=80, method=6)
            print(out.name, out.stat().st_size, "bytes")


if __name__ == "__main__":
    main(sys.argv[1:])
