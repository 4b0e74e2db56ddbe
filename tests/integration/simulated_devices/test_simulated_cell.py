"""The cell: a world that outlives its clients; how the arm stops when the client that moves it is killed."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glotouch_backends.flexiv_xense.driver.messages import RefereeRequest
from glotouch_backends.flexiv_xense.simulated import PAD_SNS, ROBOT_SN, RemoteVendor, open_remote_vendor
from glotouch_backends.flexiv_xense.simulated.arm import LINK_LOST_S, STOP_RAD_S2
from glotouch_backends.options import WorldOptions
from glotouch_backends.trial_message import trial_message
from glotouch_bt.robot import Conditions
from tests.conformance.conformance_world import OPTIONS, WORLD

SPEED_M_S = 0.10
REACH_M = 0.65  # of P from the first axis, which does most of this motion
ROOT = Path(__file__).parents[3]


def wait(seconds: float) -> None:
    threading.Event().wait(seconds)


@pytest.fixture
def cell(tmp_path: Path) -> Iterator[Path]:
    """A running cell's folder: `socket` and `log`."""
    (tmp_path / "world").write_bytes(trial_message(WORLD, Conditions(), 0, WorldOptions(**OPTIONS)))
    module = "glotouch_backends.flexiv_xense.simulated.cell"
    command = [sys.executable, "-m", module, tmp_path / "world", tmp_path / "socket", tmp_path / "log"]
    process = subprocess.Popen(command, cwd=ROOT)
    yield tmp_path
    process.terminate()
    assert process.wait(20.0) == 0


def events(folder: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / "log").read_text().splitlines()]


def until(found: Callable[[], Any], limit_s: float = 60.0) -> Any:
    for _ in range(round(limit_s / 0.05)):
        value = found()
        if value:
            return value
        wait(0.05)
    raise AssertionError(f"nothing within {limit_s} s")


def test_a_killed_clients_arm_stands_still(cell: Path) -> None:
    """Time and distance are bounded by LINK_LOST_S and the braking time."""
    command = [sys.executable, "-m", "tests.backends.flexiv_xense.cell_client", cell / "socket", str(SPEED_M_S)]
    for round_number in range(3):
        with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as client:
            try:
                assert client.stdout is not None
                assert client.stdout.readline().strip() == "moving"
                wait(0.3 + 0.13 * round_number)
            finally:
                client.kill()
        still = until(lambda n=round_number: [e for e in events(cell) if e["event"] == "standstill"][n:])[0]
        lost = [e for e in events(cell) if e["event"] == "client lost"][round_number]
        # A client that lacks processor time sends late and makes the arm catch up.
        speed = max(lost["speed_m_s"], SPEED_M_S)
        braking_s = speed / REACH_M / STOP_RAD_S2
        assert speed < 3 * SPEED_M_S
        assert still["after_s"] < LINK_LOST_S + braking_s + 0.2, "0.2 s: the servo's lag, down to 1 mm/s"
        assert still["travel_m"] < speed * (LINK_LOST_S + 0.5 * braking_s) + 0.003
        assert still["peak_force_N"] < 1e-6, "in free space"


def test_calls_return_their_values_and_errors(cell: Path) -> None:
    vendor: RemoteVendor = open_remote_vendor(str(cell / "socket"))
    rdk = vendor.flexivrdk
    with pytest.raises(ValueError, match="serial"):
        rdk.Robot("Rizon4")
    robot = rdk.Robot(ROBOT_SN)
    assert robot.mode() is rdk.Mode.IDLE
    first = robot.states()
    wait(0.1)
    assert robot.states().timestamp > first.timestamp, "it lives by itself"
    with pytest.raises(RuntimeError, match="operational"):
        robot.SwitchMode(rdk.Mode.NRT_JOINT_POSITION)
    tool, params = rdk.Tool(robot), rdk.ToolParams()
    params.mass, params.tcp_location = 0.5, [0.0, 0.0, 0.2, 1.0, 0.0, 0.0, 0.0]
    tool.Add("hand", params)
    assert tool.params("hand").mass == 0.5
    gripper = vendor.xensegripper.XenseGripper.create("000000000001")
    until(gripper.get_gripper_status)
    gripper.set_position(20.0, 100.0, 10.0)
    until(lambda: abs(gripper.get_gripper_status()["position"] - 20.0) < 0.1)
    kinds = vendor.xensesdk.Sensor.OutputType
    pad = vendor.xensesdk.Sensor.create(PAD_SNS[1])
    depth = until(lambda: (pad.selectSensorInfo(kinds.Depth) is not None) and [pad.selectSensorInfo(kinds.Depth)])[0]
    assert np.asarray(depth).shape == (700, 400)
    (peak,) = vendor.referee(RefereeRequest(number=1, method="peak_force_N")).numbers
    assert peak >= 0.0
    vendor.referee(RefereeRequest(number=2, method="disturb", name="fault"))
    assert robot.fault()
