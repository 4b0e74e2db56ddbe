"""The simulated gripper and pads through the vendors' APIs, with the quirks of the real ones."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from glotouch_backends.flexiv_xense.simulated import GRIPPER_ADDRESS, PAD_SNS, SimulatedVendor
from glotouch_backends.flexiv_xense.simulated.vendor_api.flexiv_types import EPOCH_S
from glotouch_bt.robot import Conditions, TactileFrame
from tests.backends.flexiv_xense.simulated_rig import vendor


@pytest.fixture
def bench() -> SimulatedVendor:
    return vendor()


def sleep(v: SimulatedVendor, seconds: float) -> None:
    v.clock.sleep_until(v.clock.now_s() + seconds)


def test_positions_are_millimetres_and_open_is_85(bench: SimulatedVendor) -> None:
    gripper: Any = bench.xensegripper.XenseGripper.create(GRIPPER_ADDRESS)
    assert gripper.get_gripper_status() is None, "before the first data"
    sleep(bench, 0.05)
    assert gripper.get_gripper_status()["position"] == pytest.approx(40.0, abs=0.02)
    gripper.set_position(70.0, 50.0, 10.0)
    assert gripper.get_gripper_status()["position"] == pytest.approx(40.0, abs=0.02), "it returns at once"
    sleep(bench, 0.3)
    status = gripper.get_gripper_status()
    assert status["velocity"] == pytest.approx(50.0, abs=3.0)
    assert status["position"] == pytest.approx(54.0, abs=2.5)
    sleep(bench, 1.0)
    assert float(bench.world.data.qpos[bench.world.handles.jaw_qpos].sum()) == pytest.approx(0.070, abs=2e-4)


def test_the_network_gripper_clamps_without_a_check(bench: SimulatedVendor) -> None:
    gripper: Any = bench.xensegripper.XenseGripper.create(GRIPPER_ADDRESS)
    for position in (500.0, float("nan")):
        gripper.set_position(position, 1000.0, 1000.0)
    sleep(bench, 1.0)
    assert gripper.get_gripper_status()["position"] == pytest.approx(85.0, abs=0.2)
    serial: Any = bench.xensegripper.XenseGripper.create(port=GRIPPER_ADDRESS)
    with pytest.raises(ValueError, match="85"):
        serial.set_position(90.0, 50.0, 10.0)
    serial.set_position(50.0, 10000.0, 10.0)


def test_a_lost_gripper_repeats_its_last_status(bench: SimulatedVendor) -> None:
    gripper: Any = bench.xensegripper.XenseGripper.create(GRIPPER_ADDRESS)
    sleep(bench, 0.05)
    last = gripper.get_gripper_status()
    bench.gripper.linked = False
    gripper.set_position(0.0, 100.0, 10.0)
    sleep(bench, 1.0)
    assert gripper.get_gripper_status() == last
    began = bench.clock.now_s()
    with pytest.raises(Exception, match="no gripper"):
        bench.xensegripper.XenseGripper.create("AABBCCDDEEFF")
    assert bench.clock.now_s() - began > 7.0


def test_aperture_noise_has_the_spread_of_the_conditions() -> None:
    v = vendor(Conditions(aperture_noise_sd_m=5e-5, aperture_bias_m=(3e-4, 3e-4), gripper_latency_s=0.01))
    gripper: Any = v.xensegripper.XenseGripper.create(GRIPPER_ADDRESS)
    sleep(v, 0.05)
    seen = []
    for _ in range(300):
        sleep(v, 0.01)
        seen.append(gripper.get_gripper_status()["position"])
    assert np.mean(seen) == pytest.approx(40.3, abs=0.02)
    assert np.std(seen) == pytest.approx(0.05, rel=0.2)


def test_pads_are_found_and_opened_by_serial_number(bench: SimulatedVendor) -> None:
    sensor = bench.xensesdk.Sensor
    for wrong in ("OG999999", 77, None):
        with pytest.raises(ValueError, match="no sensor"):
            sensor.create(wrong)


def test_a_pads_outputs(bench: SimulatedVendor) -> None:
    kinds = bench.xensesdk.Sensor.OutputType
    pad = bench.xensesdk.Sensor.create(PAD_SNS[0])
    depth, stamp = pad.selectSensorInfo(kinds.Depth, kinds.TimeStamp)
    assert depth is None
    assert stamp is None, "nothing yet"
    sleep(bench, 0.1)
    depth, stamp, force = pad.selectSensorInfo(kinds.Depth, kinds.TimeStamp, kinds.Force)
    assert depth.shape == (700, 400)
    assert float(np.abs(depth).max()) == 0.0
    assert force is None, "not simulated"
    assert 0.0 <= EPOCH_S + bench.clock.now_s() - stamp < 0.05
    assert pad.selectSensorInfo(kinds.Depth).shape == (700, 400), "one alone is no tuple"
    bench.pads[0].missing = True
    assert pad.selectSensorInfo(kinds.Depth) is None


def test_millimetres_and_mirroring(bench: SimulatedVendor, monkeypatch: pytest.MonkeyPatch) -> None:
    """A dent of 0.5 mm at row 3, column 2 of both maps: the right sensor sees it mirrored."""
    dent = np.zeros(bench.world.description.gripper.pad_shape)
    dent[3, 2] = 5e-4
    left = bench.xensesdk.Sensor.create(PAD_SNS[0])
    right = bench.xensesdk.Sensor.create(PAD_SNS[1])
    monkeypatch.setattr(bench.world.hand, "frame", TactileFrame(1.0, dent, dent))
    kind = bench.xensesdk.Sensor.OutputType.Depth
    for pad, columns in ((left, slice(40, 60)), (right, slice(340, 360))):
        seen = pad.selectSensorInfo(kind)
        assert seen.max() == pytest.approx(0.5)
        assert (seen[60:80, columns] > 0.4).all()
        assert (seen > 0.4).sum() == 400


def test_frames_are_simulated_only_while_a_sensor_is_read(bench: SimulatedVendor) -> None:
    """They come at the tactile rate, then stop; the last one stays available with its old stamp."""
    kinds = bench.xensesdk.Sensor.OutputType
    pad = bench.xensesdk.Sensor.create(PAD_SNS[0])
    stamps = set()
    for _ in range(100):
        sleep(bench, 0.01)
        stamps.add(pad.selectSensorInfo(kinds.TimeStamp))
    assert 50 <= len(stamps - {None}) <= 62
    sleep(bench, 1.0)
    assert EPOCH_S + bench.clock.now_s() - pad.selectSensorInfo(kinds.TimeStamp) > 0.8


def test_an_image_is_rendered_after_it_was_asked_for(bench: SimulatedVendor) -> None:
    """Blue, green, red of an untouched gel; depth, image and stamp of one call are of one frame."""
    output = bench.xensesdk.Sensor.OutputType
    sensors = [bench.xensesdk.Sensor.create(serial) for serial in PAD_SNS]
    asked = (output.Depth, output.Rectify, output.TimeStamp)
    for _ in range(20):
        sleep(bench, 0.005)
        found = [sensor.selectSensorInfo(*asked) for sensor in sensors]
        if all(image is not None for _, image, _ in found):
            break
    for _, image, stamp in found:
        assert (image.shape, image.dtype) == ((700, 400, 3), np.uint8)
        assert stamp == EPOCH_S + bench.gripper.hand.images.stamp_s
        assert np.ptp(image) == 0, "no noise, nothing touched, and equal lights"
    sleep(bench, 0.1)
    assert bench.gripper.hand.images.stamp_s == pytest.approx(stamp - EPOCH_S), "no further one without a request"
