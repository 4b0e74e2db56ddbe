"""A run folder sets the options of simulated devices, and no program, file, address or device."""

from __future__ import annotations

from dataclasses import fields

import pytest

from glotouch_backends.flexiv_xense import FlexivXenseBackend
from glotouch_backends.flexiv_xense.client.options import ClientOptions
from glotouch_backends.flexiv_xense.driver.messages import DeviceSettings
from glotouch_backends.mujoco import MujocoBackend
from glotouch_bt.robot import FakeRobot
from glotouch_bt.robot.fake import FakeBackend

PORTABLE = {"devices": "simulated", "pace": "real", "layout": "{}", "fixed": "true"}
NAMES = [*(f.name for f in fields(ClientOptions)), *DeviceSettings.__struct_fields__]


@pytest.mark.parametrize("name", NAMES)
def test_only_simulated_devices_are_portable(name: str) -> None:
    value = PORTABLE.get(name, "x")
    assert FlexivXenseBackend().is_portable(name, value) == (name in PORTABLE)
    assert not FlexivXenseBackend().is_portable("devices", "real")


def test_other_backends() -> None:
    assert MujocoBackend().is_portable("layout", {})
    assert not FakeBackend().is_portable("anything", FakeRobot)
