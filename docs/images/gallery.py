"""Make the runs of docs/gallery.md and its pictures: reports, live view by stage, terminal, tree. One command:

MUJOCO_GL=egl python -m docs.images.gallery [FOLDER]

It needs chromium, chromium-driver and tmux. Runs that FOLDER holds already are not made again.
"""

from __future__ import annotations

import io
import math
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
from PIL import Image
from rich.console import Console
from rich.text import Text

from glotouch_bt.errors import GlotouchError
from glotouch_bt.report import RecordReader, write_report
from glotouch_bt.report.state import RunModel
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
"""Skills during which the view is photographed, and the name of the picture."""
FELT_M = 2e-4
"""Indentation of a gel that shows something."""
PAUSE_AFTER_S = 6.0
"""Wall time of the mission before it is paused for its picture."""
TREES = ("retrieved", "crowded")
"""Runs whose tree is shown."""
VIEW, REPORT, TREE = (1440, 900), (1120, 1240), (900, 1300)
TERMINAL = (96, 16)
"""Columns and rows."""


def main(folder: str = "runs") -> None:
    """Make what is missing in the folder, and write all pictures."""
    runs = Path(folder)
    runs.mkdir(parents=True, exist_ok=True)
    if not (runs / "retrieved" / "result.json").is_file():
        run_paused(runs / "retrieved")
    for name, words in RUNS.items():
        if not (runs / name / "result.json").is_file():
            subprocess.run([GLOTOUCH, "run", *words, "--out", str(runs / name)], check=False)
    photograph_stages(runs / "retrieved")
    for name in ("aborted", "crowded"):
        photograph_view(runs / name, {f"view_{name}": (math.inf, "")})
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


def save(page: Page, name: str, png: bytes | None = None) -> None:
    """Write the picture of a page, or another one."""
    picture = Image.open(io.BytesIO(png or page.driver.get_screenshot_as_png())).convert("RGB")
    out = HERE / f"{name}.webp"
    picture.save(out, quality=80, method=6)
    print(out.name, out.stat().st_size, "bytes")


def run_paused(folder: Path) -> None:
    """Make the retrieval with its live page, and photograph the page while the mission is paused."""
    words = [GLOTOUCH, "run", *RETRIEVE, "--live", "--no-browser", "--out", str(folder)]
    with subprocess.Popen(words, stderr=subprocess.PIPE, text=True) as program, window(VIEW) as page:
        assert program.stderr is not None
        address = next(found[0] for line in program.stderr if (found := re.search(r"http://\S+", line)))
        until((folder / "run.mcap").is_file, "the record")
        time.sleep(PAUSE_AFTER_S)
        program.send_signal(signal.SIGUSR1)
        page.open(address)
        page.says("paused")
        shoot(page, "live_paused")
        page.press("go on")
        page.says("the mission succeeded")  # the command ends when its window is closed


def photograph_stages(folder: Path) -> None:
    """Photograph the page of a run during the longest run of each skill of `STAGES`."""
    model = RunModel()
    with RecordReader(folder) as reader:
        reader.read()
        model.feed(reader)
        ticks = [(t.node.rsplit("/", 1)[-1].split(" ")[0], t) for t in reader.record.ticks]
    longest: dict[str, tuple[float, float]] = {}
    began: dict[str, float] = {}
    for skill, tick in ticks:
        if skill in STAGES and tick.new == "RUNNING":
            began[tick.node] = tick.stamp_s
        elif tick.node in began:
            start = began.pop(tick.node)
            longest[skill] = max(longest.get(skill, (0.0, 0.0)), (tick.stamp_s - start, tick.stamp_s))
    moments = {f"view_{STAGES[s]}": (moment(model, end - length, end), "") for s, (length, end) in longest.items()}
    photograph_view(folder, moments | {"view": (math.inf, ""), "view_truth": (math.inf, AT_START)})


def moment(model: RunModel, start_s: float, end_s: float) -> float:
    """Return the time at which the gels are pressed deepest, or one at 70 % of the way if they feel nothing."""
    deepest, best_s = FELT_M, start_s + 0.7 * (end_s - start_s)
    for t_s in np.arange(start_s, end_s, 0.25):
        pads = model.state_at(t_s).pads
        depth = max((float(np.nanmax(pad)) for pad in pads), default=0.0) if pads is not None else 0.0
        if depth > deepest:
            deepest, best_s = depth, float(t_s)
    return best_s


def photograph_view(folder: Path, moments: dict[str, tuple[float, str]]) -> None:
    """Photograph the page of a finished run: for each name at a robot clock, and with the true objects of a moment."""
    over = threading.Event()
    with window(VIEW) as page, page_server(None, browser=False) as (server, at):
        watch = RunWatch(server, folder)
        drawing = threading.Thread(target=watch.run, args=(over,))
        drawing.start()
        try:
            page.open(at)
            page.says("the mission")
            for name, (t_s, ghost) in moments.items():
                watch.player.seek(t_s)
                if ghost:
                    watch.page.ghost_switch.value = ghost
                shoot(page, name)
        finally:
            over.set()
            drawing.join()


def shoot(page: Page, name: str) -> None:
    """Photograph a page of the view once it is drawn."""
    dismiss = "document.querySelectorAll('.mantine-Notification-closeButton').forEach(b => b.click())"
    time.sleep(3.0)
    page.driver.execute_script(dismiss)  # viser warns that the scene is drawn in software
    time.sleep(2.0)
    save(page, name)


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
    if run.name not in TREES:
        return
    with window(TREE) as page:
        page.open(address)
        save(page, f"tree_{run.name}", page.find("section:has(.tree)").screenshot_as_png)


def photograph_terminal(runs: Path) -> None:
    """Photograph the terminal of a retrieval under way, through tmux."""
    columns, rows = map(str, TERMINAL)
    session = ["tmux", "-L", "gallery"]
    with tempfile.TemporaryDirectory() as out:
        command = f"cd {out}; TERM=xterm-256color {GLOTOUCH} run {' '.join(RETRIEVE)} --out runs/apple"
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
