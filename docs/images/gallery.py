"""Make the runs of docs/gallery.md and its pictures: reports, live view by stage, terminal, tree. One command:

MUJOCO_GL=egl python -m docs.images.gallery [FOLDER]

It needs chromium, chromium-driver and tmux. Runs that FOLDER holds already are not made again.
"""

from __future__ import annotations

import io
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from PIL import Image
from rich.console import Console
from rich.text import Text

from glotouch_bt.errors import GlotouchError
from glotouch_bt.report import write_report
from glotouch_bt.runs import write_film
from glotouch_bt.view.page import AT_START
from glotouch_bt.view.serve import page_server
from glotouch_bt.view.watch import RunWatch
from tests.support.browser_page import PHONE, Page, open_window, until

HERE = Path(__file__).parent
GLOTOUCH = str(Path(sys.executable).with_name("glotouch"))
RETRIEVE = ("retrieve", "--set", "target=apple", "--seed", "0")
RUNS = {
    "aborted": ("retrieve", "--set", "target=apple", "--seed", "2", "--faults", "dead_wrist"),
    "surveyed": ("survey", "--seed", "0"),
    "crowded": ("examples/crowded.yaml", "--seed", "1"),
}
"""Arguments of `glotouch run` for each run whose report is shown, beside the retrieval."""
STAGES = {
    "tool_pickup": "pickup",
    "guarded_sweep": "search",
    "refine_outline": "outline",
    "touch_top": "top",
    "touch_next": "squeeze",
    "grasp": "grasp",
    "lift": "lift",
}
"""Skills during which the live view is photographed, and the name of the picture."""
VIEW, REPORT, TREE = (1440, 900), (1120, 1240), (900, 1300)
TERMINAL = (96, 16)
"""Columns and rows."""


def main(folder: str = "runs") -> None:
    """Make what is missing in the folder, and write all pictures."""
    runs = Path(folder)
    runs.mkdir(parents=True, exist_ok=True)
    if not (runs / "retrieved" / "result.json").is_file():
        photograph_live(runs / "retrieved")
    for name, words in RUNS.items():
        if not (runs / name / "result.json").is_file():
            subprocess.run([GLOTOUCH, "run", *words, "--out", str(runs / name)], check=False)
    photograph_view(runs / "aborted", "view_aborted")
    photograph_view(runs / "retrieved", "view_truth", AT_START)
    for name in ("retrieved", *RUNS):
        photograph_report(runs / name)
    photograph_terminal(runs)


@contextmanager
def window(size: tuple[int, int]) -> Iterator[Page]:
    """Open a browser window for one picture."""
    chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if chromium is None or driver is None:
        sys.exit("chromium and chromium-driver are needed")
    with tempfile.TemporaryDirectory() as profile:
        page = open_window(size, chromium, driver, Path(profile))
        try:
            yield page
        finally:
            page.driver.quit()


def save(page: Page, name: str) -> None:
    """Write the picture of a page."""
    picture = Image.open(io.BytesIO(page.driver.get_screenshot_as_png())).convert("RGB")
    out = HERE / f"{name}.webp"
    picture.save(out, quality=80, method=6)
    print(out.name, out.stat().st_size, "bytes")


@contextmanager
def serving(words: list[str]) -> Iterator[str]:
    """Run a command that serves a page, and yield the address that it prints."""
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as program:
        assert program.stdout is not None
        try:
            for line in program.stdout:
                if found := re.search(r"http://\S+", line):
                    yield found[0]
                    return
            sys.exit(f"no page: {' '.join(words)}")
        finally:
            program.terminate()


def photograph_live(folder: Path) -> None:
    """Make the retrieval, and photograph its live view when each stage is first seen, and once paused."""
    with (
        window(VIEW) as page,
        serving([GLOTOUCH, "run", *RETRIEVE, "--live", "--no-browser", "--out", str(folder)]) as at,
    ):
        page.open(at)
        missing = dict(STAGES)
        while missing and not (folder / "result.json").is_file():
            time.sleep(0.1)
            running = next((skill for skill in missing if re.search(rf"^.*\b{skill}\b", head(page))), None)
            if running is None:
                continue
            save(page, f"live_{missing.pop(running)}")
            if running == "refine_outline":
                page.press("pause")
                page.says("paused")
                save(page, "live_paused")
                page.press("go on")
        until((folder / "result.json").is_file, "the end of the mission")
        page.says("the mission succeeded")
        time.sleep(3.0)
        save(page, "live_end")


def head(page: Page) -> str:
    """Return the head of the page: clock, phase, mission, running skill."""
    return page.text.partition("Time")[0]


def photograph_view(folder: Path, name: str, ghost: str = "") -> None:
    """Photograph the page of a finished run at its end, with the true objects if `ghost` says when."""
    over = threading.Event()
    with window(VIEW) as page, page_server(None, browser=False) as (server, at):
        watch = RunWatch(server, folder)
        drawing = threading.Thread(target=watch.run, args=(over,))
        drawing.start()
        try:
            page.open(at)
            page.says("the mission")
            if ghost:
                watch.page.ghost_switch.value = ghost
            time.sleep(3.0)
            save(page, name)
        finally:
            over.set()
            drawing.join()


def photograph_report(run: Path) -> None:
    """Photograph the report of a run, also as a phone shows it, and the picture of its tree."""
    with suppress(GlotouchError):  # a run without a simulated world has no film
        write_film(run)
    address = write_report(run).resolve().as_uri()
    for ending, size in (("", REPORT), ("_phone", PHONE)):
        with window(size) as page:
            page.open(address)
            time.sleep(2.0)
            save(page, f"report_{run.name}{ending}")
    with window(TREE) as page:
        page.open(address)
        page.driver.execute_script("document.querySelector('.tree').scrollIntoView()")
        time.sleep(1.0)
        save(page, f"tree_{run.name}")


def photograph_terminal(runs: Path) -> None:
    """Photograph the terminal of a retrieval under way, through tmux."""
    columns, rows = map(str, TERMINAL)
    session = ["tmux", "-L", "gallery"]
    with tempfile.TemporaryDirectory() as out:
        command = f"TERM=xterm-256color {GLOTOUCH} run {' '.join(RETRIEVE)} --out {out}/run"
        subprocess.run([*session, "new-session", "-d", "-x", columns, "-y", rows, command], check=True)
        try:
            time.sleep(14.0)
            shown = subprocess.run(
                [*session, "capture-pane", "-e", "-p"], check=True, capture_output=True, text=True
            ).stdout
        finally:
            subprocess.run([*session, "kill-server"], check=True)
    console = Console(record=True, width=TERMINAL[0], file=io.StringIO(), force_terminal=True)
    console.print(Text.from_ansi(shown.rstrip()))
    (HERE / "terminal.svg").write_text(console.export_svg(title="glotouch run retrieve --set target=apple"))


if __name__ == "__main__":
    main(*sys.argv[1:2])
