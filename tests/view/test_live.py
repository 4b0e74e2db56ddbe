"""`run --live`: the page's requests reach the mission, and nothing else of the page does."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path

import pytest

pytest.importorskip("viser")

from typer.testing import CliRunner

from glotouch_bt import cli
from glotouch_bt.mission.execution import Control
from glotouch_bt.robot import BadInput
from glotouch_bt.view import LiveView
from glotouch_bt.view import live as live_file
from glotouch_bt.view import process as process_file
from tests.support.fake_cli import install_fakes

FAKE_CLI = Path(__file__).parents[1] / "support" / "fake_cli.py"
NAP = """
mission: nap
world: worlds/container_five.yaml
parameters: {seconds: {type: float, default: 3.0}}
tree: {sequence: [{wait: {seconds: $seconds}}, {succeed: {wait: {seconds: 0.2, end: fail}}}]}
"""
PATIENCE_S = 180.0


def waited_for(done: Callable[[], object]) -> bool:
    """Wait for another process or thread."""
    end = time.perf_counter() + PATIENCE_S
    while not done() and time.perf_counter() < end:
        threading.Event().wait(0.02)
    return bool(done())


@pytest.fixture
def nap(tmp_path: Path) -> Path:
    path = tmp_path / "nap.yaml"
    path.write_text(NAP)
    return path


def run(mission: Path, out: str, *options: str) -> subprocess.CompletedProcess[str]:
    words = [sys.executable, str(FAKE_CLI), "run", mission.name, "--seed", "4", "--out", out, *options]
    return subprocess.run(words, cwd=mission.parent, capture_output=True, text=True, timeout=PATIENCE_S, check=False)


def test_the_record_has_the_same_bytes_with_and_without_a_live_page(nap: Path) -> None:
    without = run(nap, "a")
    live = run(nap, "b", "--live", "--no-browser")
    assert (without.returncode, live.returncode) == (0, 0), live.stderr
    assert "live view: http://127.0.0.1:" in live.stderr
    a, b = nap.parent / "a", nap.parent / "b"
    assert (a / "run.mcap").read_bytes() == (b / "run.mcap").read_bytes()
    assert sorted(p.name for p in a.iterdir()) == sorted(p.name for p in b.iterdir())
    assert without.stdout.split("in ")[0] == live.stdout.split("in ")[0]
    assert live.stderr.endswith("nobody had the page open; look at it with: glotouch view b\n")


@pytest.mark.study
def test_a_record_that_is_watched_is_not_changed(nap: Path) -> None:
    run(nap, "a")
    folder = nap.parent / "a"
    before = {p.name: (p.read_bytes(), p.stat().st_mtime_ns) for p in folder.iterdir()}
    words = [sys.executable, str(FAKE_CLI), "view", "a", "--no-browser"]
    page = subprocess.Popen(words, cwd=nap.parent, stdout=subprocess.PIPE, text=True)
    try:
        assert page.stdout is not None
        address = page.stdout.readline().split()[0]
        with urllib.request.urlopen(address) as answer:
            assert answer.status == 200
        threading.Event().wait(0.5)
    finally:
        page.send_signal(signal.SIGINT)
        rest, code = page.communicate(timeout=PATIENCE_S)[0], page.returncode
    assert (rest, code) == ("", 0)  # Ctrl-C ends it cleanly
    assert {p.name: (p.read_bytes(), p.stat().st_mtime_ns) for p in folder.iterdir()} == before


def test_options_of_the_page_need_the_page(nap: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    install_fakes(monkeypatch.setattr)
    monkeypatch.chdir(nap.parent)
    for option in (("--port", "9000"), ("--no-browser",)):
        done = CliRunner().invoke(cli.app, ["run", nap.name, "--out", "a", *option])
        assert done.exit_code == 2
        assert done.stderr == f"glotouch: {option[0]}: needs --live\n"
        assert not (nap.parent / "a").exists()


def stub(monkeypatch: pytest.MonkeyPatch, script: str) -> None:
    """Let a page be a script."""
    monkeypatch.setattr(live_file, "PAGE", (sys.executable, "-c", script))


def test_pause_resume_and_stop_reach_the_mission(monkeypatch: pytest.MonkeyPatch) -> None:
    """The page sends one word after each line that it is told."""
    stub(
        monkeypatch,
        "import sys\nprint('ready http://here', flush=True)\n"
        "for word, line in zip(('pause', 'pause', 'resume', 'stop', 'left'), sys.stdin): print(word, flush=True)",
    )
    control = Control()
    with LiveView(control, browser=False) as page:
        assert page.address == "http://here"
        page.show(Path("somewhere"))
        assert waited_for(lambda: control.paused)
        page.show(Path("somewhere"))  # a second person presses it too: still paused
        page.show(Path("somewhere"))
        assert waited_for(lambda: not control.paused)
        page.show(Path("somewhere"))
        assert waited_for(lambda: control.stopped)
        assert control.stopped == "stopped on the page of --live"
        assert page.wait(patient=False)


def test_a_page_that_dies_leaves_the_mission_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    stub(monkeypatch, "import os, sys\nprint('ready http://here', flush=True)\nsys.stdin.readline()\nos._exit(9)")
    control = Control()
    with LiveView(control, browser=False) as page:
        for _ in range(200):  # more than a pipe without a reader takes
            page.show(Path("x" * 1000))
        page.wait(patient=False)
    assert (control.paused, control.stopped) == (False, None)


def test_a_page_that_does_not_read_does_not_block_the_mission(monkeypatch: pytest.MonkeyPatch) -> None:
    stub(monkeypatch, "import time\nprint('ready http://here', flush=True)\ntime.sleep(600)")
    monkeypatch.setattr(process_file, "END_S", 0.2)
    began = time.perf_counter()
    with LiveView(Control(), browser=False) as page:
        for _ in range(200):  # more than a pipe without a reader takes
            page.show(Path("x" * 1000))
    assert time.perf_counter() - began < 0.5 * PATIENCE_S


def test_a_fault_of_the_page_is_one_message_before_anything_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    stub(monkeypatch, "print('fault --port 80: is in use or not allowed')")
    with pytest.raises(BadInput, match="--port 80: is in use"):
        LiveView(Control(), browser=False)
    stub(monkeypatch, "")
    with pytest.raises(BadInput, match="did not start"):
        LiveView(Control(), browser=False)


def test_the_page_ends_with_the_run_that_is_killed(tmp_path: Path) -> None:
    """A killed run closes the pipe; the page's process must not stay."""
    script = (
        "from glotouch_bt.mission.execution import Control\nfrom glotouch_bt.view import LiveView\nimport time\n"
        "view = LiveView(Control(), browser=False)\nprint(view._process.pid, flush=True)\ntime.sleep(600)"
    )
    parent = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, cwd=tmp_path)
    assert parent.stdout is not None
    page = int(parent.stdout.readline())
    parent.kill()
    parent.communicate()

    def gone() -> bool:
        try:
            os.kill(page, 0)
        except ProcessLookupError:
            return True
        stat = Path(f"/proc/{page}/stat")
        return stat.exists() and stat.read_text().rsplit(")", 1)[1].split()[0] == "Z"  # dead, nobody has asked

    assert waited_for(gone)
