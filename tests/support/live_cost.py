"""Measure what `--live` costs a mission, and whether its page grows. One command:

python tests/support/live_cost.py --pairs 5 --seed 3 --out runs/live_cost

A survey runs on one core: alone; with its page and a browser on the other core; and beside a program of no use on the
other core, since two busy cores of one machine slow each other. The browser does not draw: that is the work of the
viewer's computer. Then one mission of half an hour of robot time is watched. Needs two cores, chromium and
chromium-driver.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import mean
from typing import Any

import psutil

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.support.browser_page import Page, open_window

GLOTOUCH = str(Path(sys.executable).with_name("glotouch"))
ROUNDS = """
mission: rounds
description: find all objects, then trace and touch each again and again
world: container_five
tree:
  sequence:
    - subtree: {{file: subtrees/take_probe.yaml, ports: {{tool: tool}}}}
    - subtree:
        file: subtrees/explore.yaml
        parameters: {{expected_objects: 5}}
        ports: {{tool: tool, map: map, candidates: candidates, found: found}}
    - repeat:
        times: {times}
        do:
          for_each:
            items: candidates
            item: candidate
            on_failure: continue
            do: {{sequence: [refine_outline, touch_top]}}
"""
ROUND_S = 150.0
"""Robot time of one round."""
WINDOW = (1100, 640)
ARMS = ("alone", "beside a busy core", "live")


def run(words: list[str], out: Path, arm: str, window: Page) -> dict[str, Any]:
    """Run a mission on core 0; return its wall and processor time, and the page's memory at each poll."""
    live = ["--live", "--no-browser"] if arm == "live" else []
    mission = subprocess.Popen(
        [GLOTOUCH, "run", *words, "--out", str(out), *live],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: os.sched_setaffinity(0, {0}),
    )
    program, rows = psutil.Process(mission.pid), []
    with following(mission, window) if arm == "live" else spinning(arm != "alone") as page:
        while not (out / "result.json").exists():
            times = program.cpu_times()
            if page is not None:
                rows.append(round(page.memory_info().rss / 2**20, 1))
            time.sleep(0.2)
    mission.communicate()
    result = json.loads((out / "result.json").read_text())
    return {
        "arm": arm,
        "status": result["status"],
        "robot_s": result["sim_time_s"],
        "wall_s": result["wall_time_s"],
        "cpu_s": times.user + times.system,
        "page_MB": rows,
    }


@contextmanager
def following(mission: subprocess.Popen[str], window: Page) -> Iterator[psutil.Process]:
    """Open the page of a mission in the window; yield the page's process."""
    assert mission.stderr is not None
    address = next(found[0] for line in mission.stderr if (found := re.search(r"http://\S+", line)))
    children = psutil.Process(mission.pid).children(recursive=True)
    page = next(c for c in children if "glotouch_bt.view" in " ".join(c.cmdline()))
    for thread in page.threads():
        os.sched_setaffinity(thread.id, {1})
    window.open(address)
    window.says("running")
    yield page
    window.open("about:blank")


@contextmanager
def browser() -> Iterator[Page]:
    """Open a browser that does not draw."""
    chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if chromium is None or driver is None:
        sys.exit("chromium and chromium-driver are needed")
    os.sched_setaffinity(0, {1})
    with tempfile.TemporaryDirectory() as profile:
        window = open_window(WINDOW, chromium, driver, Path(profile))
        still = {"source": "window.requestAnimationFrame = () => 0"}
        window.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", still)
        try:
            yield window
        finally:
            window.driver.quit()


@contextmanager
def spinning(busy: bool) -> Iterator[None]:
    """Keep core 1 busy."""
    spin = subprocess.Popen([sys.executable, "-c", "while True: pass"]) if busy else None
    try:
        yield None
    finally:
        if spin is not None:
            spin.kill()
            spin.wait()


def rounds(out: Path, minutes: float, seed: int, window: Page) -> dict[str, Any]:
    """Watch a long mission; return the memory of its page, MB, at eleven moments."""
    file = out / "rounds.yaml"
    file.write_text(ROUNDS.format(times=max(1, round(60.0 * minutes / ROUND_S))))
    long = run([str(file), "--seed", str(seed)], out / "rounds", "live", window)
    polled = long["page_MB"]
    parts = [polled[i * (len(polled) - 1) // 10] for i in range(11)]
    return {"robot_min": long["robot_s"] / 60.0, "MB": parts, "status": long["status"]}


def main() -> None:
    """Write summary.json and print it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=5)
    parser.add_argument("--seed", type=int, default=3)
    parser.add_argument("--minutes", type=float, default=30.0, help="robot time of the long mission; 0: none")
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    rows = []
    with browser() as window:
        run(["calibrate"], given.out / "first", "live", window)  # fills the caches
        for n in range(given.pairs):
            for arm in ARMS[n % 3 :] + ARMS[: n % 3]:
                words = ["survey", "--seed", str(given.seed)]
                rows.append(run(words, given.out / f"{n}-{arm.replace(' ', '_')}", arm, window))
                print(json.dumps({k: v for k, v in rows[-1].items() if k != "page_MB"}), file=sys.stderr, flush=True)
        long = rounds(given.out, given.minutes, given.seed, window) if given.minutes else None
    summary: dict[str, Any] = {"pairs": given.pairs, "seeds": [given.seed]}
    alone = [r for r in rows if r["arm"] == "alone"]
    for arm in ARMS[1:]:
        these = [r for r in rows if r["arm"] == arm]
        for key in ("wall_s", "cpu_s"):
            shares = [100.0 * (a[key] / b[key] - 1.0) for a, b in zip(these, alone, strict=True)]
            summary[f"{arm} {key}".replace(" ", "_")] = {"mean": mean(shares), "min": min(shares), "max": max(shares)}
    if long is not None:
        summary["page"] = long
    (given.out / "summary.json").write_text(json.dumps(summary, indent=2))
    print(json.dumps(summary, indent=2))


if __name__ == "__main__":
    main()
