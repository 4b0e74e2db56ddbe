"""Servers of a small mission: ours, from a record, and the real library's."""

from __future__ import annotations

import socket
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from glotouch_bt.mission.export import as_monitored
from glotouch_bt.mission.load import load_mission
from glotouch_bt.mission.record.recorder import Recorder
from glotouch_bt.view.groot2 import MissionState, published
from tests.mission.conftest import REGISTRY
from tests.support.btcpp.installed import PUBLISHER, btcpp_python

MISSION = """
mission: small
world: container_five
tree:
  - find: {name: look, how_many: 3}
  - condition: {name: three, port: found, at_least: 3}
  - succeed: {name: never mind, do: {act: {name: try, script: F}}}
"""
TREE = """
<root BTCPP_format="4" main_tree_to_execute="small"><BehaviorTree ID="small"><Sequence name="sequence">
  <AlwaysSuccess name="look"/><ScriptCondition name="three" code="found >= 3.0"/>
  <ForceSuccess name="never mind"><AlwaysFailure name="try"/></ForceSuccess>
</Sequence></BehaviorTree></root>
"""
TICKS = (
    (0.0, "small/sequence", "INVALID", "RUNNING"),
    (0.0, "small/sequence/look", "INVALID", "RUNNING"),
    (1.0, "small/sequence/look", "RUNNING", "SUCCESS"),
    (1.0, "small/sequence/three", "INVALID", "SUCCESS"),
    (1.0, "small/sequence/never mind", "INVALID", "RUNNING"),
    (1.0, "small/sequence/never mind/try", "INVALID", "RUNNING"),
    (2.0, "small/sequence/never mind/try", "RUNNING", "FAILURE"),
    (2.0, "small/sequence/never mind", "RUNNING", "SUCCESS"),
    (2.0, "small/sequence", "RUNNING", "SUCCESS"),
    (3.0, "small/sequence/look", "SUCCESS", "INVALID"),
    (3.0, "small/sequence/never mind/try", "FAILURE", "INVALID"),
    (3.0, "small/sequence", "RUNNING", "INVALID"),
    (3.0, "small/sequence/three", "INVALID", "INVALID"),
)


@dataclass(frozen=True)
class Server:
    """A server of the small mission on a port."""

    port: int


def two_ports() -> int:
    """A free port whose successor is free, too."""
    for _ in range(100):
        with socket.socket() as first, socket.socket() as second:
            first.bind(("127.0.0.1", 0))
            port = int(first.getsockname()[1])
            try:
                second.bind(("127.0.0.1", port + 1))
            except (OSError, OverflowError):
                continue
        return port
    raise AssertionError("no two free ports")


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """The folder of a run of the small mission."""
    record_small(tmp_path / "run")
    return tmp_path / "run"


def record_small(folder: Path) -> None:
    """Write a run of the small mission."""
    folder.mkdir(exist_ok=True)
    (folder / "mission.yaml").write_text(MISSION)
    with Recorder(folder / "run.mcap", {"mission": "small"}) as record:
        for stamp_s, *change in TICKS:
            record.tick(stamp_s, [tuple(change)])
            if change == ["small/sequence/look", "RUNNING", "SUCCESS"]:
                record.port(stamp_s, "found", 3)
                record.port(stamp_s, "part@1/plan", {"poses": [1.5, None], "name": "é"})
        record.port(2.0, "found", 2**63)


def state_of(folder: Path, clock: Callable[[], float] = lambda: 2.5) -> MissionState:
    """The state of a recorded run, at a time before it is reset."""
    tree = as_monitored(load_mission(folder / "mission.yaml", {}, skills=REGISTRY))
    return MissionState(folder, tree, clock)


@contextmanager
def ours(folder: Path) -> Iterator[Server]:
    """Our publisher."""
    port = two_ports()
    with published(port, state_of(folder, lambda: 1.5)):
        yield Server(port)


@contextmanager
def the_librarys(folder: Path) -> Iterator[Server]:
    """The real publisher, in a process of its own."""
    python, port = btcpp_python(), two_ports()
    (folder / "tree.xml").write_text(TREE)
    words = [python, PUBLISHER, folder / "tree.xml", str(port)]
    process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        assert process.stdout.readline() == "ready\n"
        yield Server(port)
    finally:
        process.stdin.close()
        process.wait(20.0)
        process.stdout.close()


@pytest.fixture(params=[ours, the_librarys], ids=["ours", "the library's"])
def server(request: pytest.FixtureRequest, small: Path) -> Iterator[Server]:
    """Either publisher: a test of the protocol must hold for the real one."""
    with request.param(small) as opened:
        yield opened


@pytest.fixture
def own_server(small: Path) -> Iterator[Server]:
    """Our publisher."""
    with ours(small) as opened:
        yield opened
