"""The backend as missions open it: options, the driver process with simulated devices, and its end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from glotouch_backends.flexiv_xense import FlexivXenseBackend
from glotouch_backends.flexiv_xense.client.options import read_options
from glotouch_backends.flexiv_xense.client.robot import FlexivXenseRobot
from glotouch_bt.commissioning.doctor import nearly_empty
from glotouch_bt.mission.load import load_mission
from glotouch_bt.robot import HOLD, BackendError, BadInput, Conditions, Observation, load_backend


@pytest.fixture
def robot() -> Iterator[FlexivXenseRobot]:
    world = nearly_empty(load_mission("retrieve", {}).world)
    with FlexivXenseBackend().open(world, Conditions(), 5, {"devices": "simulated"}) as opened:
        assert isinstance(opened, FlexivXenseRobot)
        yield opened


def test_it_is_registered() -> None:
    assert load_backend("flexiv_xense").name == "flexiv_xense"


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({}, "need their addresses"),
        ({"devices": "toy"}, "one of real, simulated"),
        ({"devices": "simulated", "robto": "x"}, "did you mean 'robot'"),
        ({"robot": "Rizon4-1", "pace": "real"}, "only simulated devices"),
        ({"robot": "Rizon4-1", "layout": {}}, "only simulated devices"),
        ({"robot": "Rizon4-1", "left_pad": "OG1"}, "both or none"),
        ({"robot": "Rizon4-1", "driver": "tcp://x:1"}, "needs keys"),
        ({"robot": "Rizon4-1", "keys": "/no/such/folder"}, "is not a folder"),
        ({"devices": "simulated", "driver": "tcp://x:1"}, "driver of our own"),
        ({"devices": "simulated", "feed_forward": "maybe"}, "true or false"),
    ],
)
def test_invalid_options_name_the_valid_ones(options: dict[str, object], text: str) -> None:
    with pytest.raises(BadInput, match=text):
        read_options(options)


def test_default_addresses_are_those_of_the_simulated_devices() -> None:
    from glotouch_backends.flexiv_xense.simulated import GRIPPER_ADDRESS, PAD_SNS, ROBOT_SN

    _, o = read_options({"devices": "simulated"})
    assert (o.robot, o.gripper, (o.left_pad, o.right_pad)) == (ROBOT_SN, GRIPPER_ADDRESS, PAD_SNS)


def test_a_run_is_reproducible_and_leaves_no_files(robot: FlexivXenseRobot) -> None:
    world = nearly_empty(load_mission("retrieve", {}).world)
    backend = FlexivXenseBackend()
    first = [robot.cycle(HOLD) for _ in range(20)]
    referee = backend.referee(robot)
    assert referee is not None
    assert len(referee.objects()) == 1
    assert referee.probe_in_holder()
    with backend.open(world, Conditions(), 5, {"devices": "simulated"}) as again:
        second = [again.cycle(HOLD) for _ in range(20)]
        assert isinstance(again, FlexivXenseRobot)
        assert again.process is not None
        folder: Path = again.process.folder
        assert folder.stat().st_mode & 0o077 == 0
    assert not folder.exists()
    for a, b in zip(first, second, strict=True):
        assert same(a, b)


def same(a: Observation, b: Observation) -> bool:
    arrays = ("stamp_s", "q", "dq", "position_B_P", "quat_B_P", "wrench_S")
    return all(np.array_equal(getattr(a, n), getattr(b, n)) for n in arrays) and a.gripper == b.gripper


def test_a_killed_driver_is_an_error_and_closing_still_works(robot: FlexivXenseRobot) -> None:
    robot.cycle(HOLD)
    assert robot.process is not None
    os.kill(robot.process.pid, signal.SIGKILL)
    with pytest.raises(BackendError, match="the driver has ended"):
        robot.cycle(HOLD)
    with pytest.raises(BackendError, match="the driver has ended"):
        robot.cycle(HOLD)
    robot.hold()
    robot.close()
    assert robot.process._process is None


def test_a_killed_executive_leaves_no_files() -> None:
    """The driver outlives it and removes its private folder."""
    code = (
        "import sys, time\n"
        "from glotouch_bt.mission.load import load_mission\n"
        "from glotouch_bt.robot import Conditions, load_backend\n"
        "world = load_mission('calibrate').world\n"
        "robot = load_backend('flexiv_xense').open(world, Conditions(), 0, {'devices': 'simulated'})\n"
        "print(robot.process.pid, robot.process.folder, flush=True)\n"
        "time.sleep(600)\n"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as executive:
        assert executive.stdout is not None
        pid, folder = executive.stdout.readline().split()
        assert Path(folder).is_dir()
        executive.kill()
    for _ in range(600):
        if not Path(folder).exists():
            break
        time.sleep(0.1)
    assert not Path(folder).exists(), f"driver {pid} left it"
