"""`run`, `resume` and `view` with `--groot2`: monitors see the tree, the run does not see them."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import zmq
from click.testing import Result
from typer.testing import CliRunner

from glotouch_bt import cli
from tests.support.btcpp.installed import btcpp_python
from tests.support.fake_cli import install_fakes
from tests.support.groot2_client import Groot2Client, ServerError
from tests.view.groot2.conftest import two_ports

FAKE_CLI = Path(__file__).parents[2] / "support" / "fake_cli.py"
NAP = """
mission: nap
world: container_five
tree:
  - wait: {name: first, seconds: 2.0}
  - wait: {name: long, seconds: 200.0}
  - condition: {name: waited, port: done, equals: true}
  - succeed: {name: never mind, do: {wait: {name: last, seconds: 0.2, end: fail}}}
"""
LIVE = {"sequence": "RUNNING", "first": "SUCCESS", "long": "RUNNING", "waited": "IDLE", "never mind": "IDLE"}
ENDED = {"sequence": "SUCCESS", "first": "SUCCESS", "long": "SUCCESS", "waited": "SUCCESS", "never mind": "SUCCESS"}
PATIENCE_S = 180.0


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "nap.yaml").write_text(NAP)
    for name, seconds in (("short", 3.0), ("middle", 120.0)):
        (tmp_path / f"{name}.yaml").write_text(NAP.replace("nap", name).replace("200.0", str(seconds)))
    return tmp_path


@contextmanager
def started(folder: Path, *words: str) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, str(FAKE_CLI), *words]
    process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.communicate(timeout=PATIENCE_S)


@pytest.fixture
def done(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Result]:
    """Run a command with the fakes, in this process."""
    install_fakes(monkeypatch.setattr)
    monkeypatch.chdir(folder)
    return lambda *words: CliRunner().invoke(cli.app, words)


def eventually(look: Callable[[], bool]) -> None:
    """Wait for what another process does."""
    end = time.perf_counter() + PATIENCE_S
    while time.perf_counter() < end:
        try:
            if look():
                return
        except (ServerError, zmq.Again):
            pass
        threading.Event().wait(0.02)
    raise AssertionError("it never happened")


def has(client: Groot2Client, wanted: dict[str, str]) -> bool:
    return wanted.items() <= client.statuses().items()


def test_a_monitor_sees_the_run(folder: Path) -> None:
    port = two_ports()
    with started(folder, "run", "nap.yaml", "--out", "a", "--groot2", str(port)) as run, Groot2Client(port) as client:
        eventually(lambda: has(client, LIVE))
        assert client.blackboard("nap") == {"nap": {"done": True}}
        assert run.poll() is None
        out, err = run.communicate(timeout=PATIENCE_S)
    assert run.returncode == 0, err
    assert f"for Groot2: 127.0.0.1:{port}\n" in err
    assert "done  nap" in out


@pytest.mark.study
def test_the_record_has_the_same_bytes_with_and_without_monitors(folder: Path, done: Callable[..., Result]) -> None:
    port = two_ports()
    without = done("run", "middle.yaml", "--out", "a")
    words = ("run", "middle.yaml", "--out", "b", "--groot2", str(port))
    with started(folder, *words) as run, Groot2Client(port) as client, Groot2Client(port) as other:
        eventually(lambda: has(client, LIVE))
        while run.poll() is None:
            for each in (client, other):
                each.socket.setsockopt(zmq.RCVTIMEO, 200)
                try:
                    each.ask("S")
                    each.ask("B", b"middle")
                except zmq.Again:
                    break  # the run has ended
        assert (without.exit_code, run.wait(PATIENCE_S)) == (0, 0)
    a, b = folder / "a", folder / "b"
    assert (a / "run.mcap").read_bytes() == (b / "run.mcap").read_bytes()
    assert sorted(p.name for p in a.iterdir()) == sorted(p.name for p in b.iterdir())


@pytest.mark.study
def test_a_monitor_sees_a_resumed_run(folder: Path) -> None:
    port = two_ports()
    with started(folder, "run", "nap.yaml", "--out", "a", "--groot2", str(port)) as run:
        with Groot2Client(port) as client:
            eventually(lambda: has(client, LIVE))
        run.kill()
    with started(folder, "resume", "a", "--groot2", str(port)) as run, Groot2Client(port) as client:
        eventually(lambda: has(client, LIVE))
        assert run.wait(PATIENCE_S) == 0
    assert json.loads((folder / "a" / "result.json").read_text())["status"] == "success"


def test_a_finished_run_is_shown_too(folder: Path, done: Callable[..., Result]) -> None:
    pytest.importorskip("viser")
    port = two_ports()
    assert done("run", "short.yaml", "--out", "a").exit_code == 0
    before = {p.name: (p.read_bytes(), p.stat().st_mtime_ns) for p in (folder / "a").iterdir()}
    with started(folder, "view", "a", "--no-browser", "--groot2", str(port)) as view, Groot2Client(port) as client:
        eventually(lambda: has(client, {**ENDED, "last": "FAILURE"}))
        assert client.blackboard("short") == {"short": {"done": True}}
        assert view.stdout is not None
        assert "http://127.0.0.1:" in view.stdout.readline()
        assert view.stdout.readline() == f"for Groot2: 127.0.0.1:{port}\n"
        view.send_signal(signal.SIGINT)
        assert view.wait(PATIENCE_S) == 0
    assert {p.name: (p.read_bytes(), p.stat().st_mtime_ns) for p in (folder / "a").iterdir()} == before


@pytest.mark.study
def test_a_free_monitor_shows_the_run(folder: Path) -> None:
    port, python = two_ports(), btcpp_python()
    more = "".join(f"  - wait: {{name: longer {i}, seconds: 800.0}}\n" for i in range(9))
    (folder / "nap.yaml").write_text(NAP + more)  # the monitor's start takes a while
    with started(folder, "run", "nap.yaml", "--out", "a", "--groot2", str(port)) as run:
        with Groot2Client(port) as client:
            eventually(lambda: has(client, LIVE))
        words = [python, "-m", "btview", "snapshot", "--ascii", "--port", str(port)]
        shown = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
        assert run.poll() is None
    assert shown.returncode == 0, shown.stderr
    lines = [line.split() for line in shown.stdout.splitlines()]
    assert ["[-]", "sequence", "[Sequence]", "*", "RUNNING"] in lines
    assert ["+-", "-->", "long", "[wait]", "*", "RUNNING"] in lines
    assert ["+-", "-->", "first", "[wait]", "o", "SUCCESS"] in lines


@pytest.mark.parametrize("command", ["run nap.yaml", "resume a", "view a"])
@pytest.mark.parametrize("given", ["0", "65535", "99999", "-1", "1.5", "=x", "="])
def test_a_port_that_cannot_be_is_refused(command: str, given: str, folder: Path) -> None:
    option = [f"--groot2{given}"] if given.startswith("=") else ["--groot2", given]
    result = CliRunner().invoke(cli.app, [*command.split(), *option])
    assert result.exit_code == 2
    assert "'--groot2'" in result.stderr
    assert sorted(p.name for p in folder.iterdir()) == ["middle.yaml", "nap.yaml", "short.yaml"]


def test_a_port_in_use_ends_the_command_before_anything_moves(folder: Path, done: Callable[..., Result]) -> None:
    port = two_ports()
    with zmq.Context() as context, context.socket(zmq.REP) as other:
        other.bind(f"tcp://127.0.0.1:{port}")
        result = done("run", "--out", "a", "short.yaml", "--groot2", str(port))
    assert (result.exit_code, result.stdout) == (2, "")
    sentence = f"port {port} is in use or not allowed; give another one: --groot2 PORT"
    assert result.stderr == f"glotouch: --groot2 {port}: {sentence}\n"
    assert not (folder / "a").exists()


@pytest.mark.parametrize(
    "words", [["--groot2", "short.yaml"], ["short.yaml", "--groot2"], ["--groot2", "--", "short.yaml"]]
)
def test_the_port_may_be_left_out(words: list[str], folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The option alone means Groot2's own port; what follows it is not taken for one."""
    asked: list[int | None] = []
    monkeypatch.setattr("glotouch_bt.commands.shared.live_tree", lambda port: asked.append(port) or stop())
    CliRunner().invoke(cli.app, ["run", *words])
    assert asked == [1667]


def stop() -> None:
    raise SystemExit(0)
