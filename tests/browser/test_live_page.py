"""`glotouch run --live` in a browser, with a mission in MuJoCo: it is followed, paused, continued and stopped."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil

from tests.support.browser_page import PATIENCE_S, Page, drawn, until

CLI = (sys.executable, "-c", "from glotouch_bt.cli import main; main()")


@contextmanager
def live(out: Path, mission: str) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """Start a mission with its page; give the page's address and the mission's process."""
    words = [*CLI, "run", mission, "--seed", "3", "--live", "--no-browser", "--out", str(out)]
    run = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env=dict(os.environ))
    try:
        assert run.stderr is not None
        found = None
        while found is None:
            found = re.search(r"live view: (http\S+)", run.stderr.readline())
        yield found[1], run
    finally:
        run.kill()
        run.communicate(timeout=60)


def test_pause_go_on_and_stop_act_on_the_mission(browse: Callable[..., Page], tmp_path: Path) -> None:
    page = browse()
    with live(tmp_path / "run", "survey") as (address, run):
        until(lambda: (tmp_path / "run" / "run.mcap").exists(), "the record")  # attach late
        page.open(address)
        page.says("running")
        until(lambda: drawn(page.picture()), "the scene drawn")
        page.press("pause")
        page.says("paused")
        held = page.clock_s
        page.press("go on")
        until(lambda: page.clock_s > held, "the clock goes on")
        page.press("stop")
        page.press("Stop it")
        page.says("ended")
        page.says("stopped on the page of --live")
        assert page.errors() == []
        page.driver.quit()
        assert run.wait(PATIENCE_S) != 0
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert "stopped on the page of --live" in result["reasons"][-1]


def test_a_browser_that_stands_still_delays_nothing(browse: Callable[..., Page], tmp_path: Path) -> None:
    page = browse()
    with live(tmp_path / "run", "calibrate") as (address, _):
        page.open(address)
        frozen = [p for p in psutil.Process(page.driver.service.process.pid).children(recursive=True)]
        for process in frozen:
            process.send_signal(signal.SIGSTOP)
        try:
            until(lambda: (tmp_path / "run" / "result.json").exists(), "the end of the mission")
        finally:
            for process in frozen:
                process.send_signal(signal.SIGCONT)
    assert json.loads((tmp_path / "run" / "result.json").read_text())["status"] == "success"
