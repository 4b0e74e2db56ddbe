"""Tests of devices that are lost, stop delivering or have a fault."""

from __future__ import annotations

import pytest

from glotouch_bt.conformance.base import Conformance
from glotouch_bt.robot import HOLD, BackendError


class DeviceLossTests(Conformance):
    """Loss of a device."""

    def test_a_lost_device_is_an_error(self) -> None:
        """Raise within `loss_s` and in every later cycle; hold and close never raise; another robot can be opened."""
        losses = self.losses()
        if not losses:
            pytest.skip("no way to lose a device is offered")
        for name, lose in losses.items():
            with self.own() as rig:
                rig.hold(0.1)
                lose(rig.robot)
                for _ in range(round(self.loss_s / rig.period_s)):
                    try:
                        rig.cycle()
                    except BackendError:
                        break
                else:
                    raise AssertionError(f"{name}: no error within {self.loss_s} s")
                for _ in range(3):
                    with pytest.raises(BackendError):
                        rig.robot.cycle(HOLD)
                rig.robot.hold()
        with self.own() as rig:
            rig.hold(0.05)
