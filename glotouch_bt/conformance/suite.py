"""The whole suite: it checks the promises of `Robot` from outside.

Subclass `RobotConformance` in a test file and implement `make`. Override `wall` and `losses` if the robot has a wall at
a known place, or a way to lose a device; otherwise these tests are skipped. The suite needs 0.15 m of free space around
the home posture.

The tests share one robot; a test that breaks its robot opens another. Do not run them in parallel on one device.
"""

from __future__ import annotations

from glotouch_bt.conformance.contact import ContactTests
from glotouch_bt.conformance.device_loss import DeviceLossTests
from glotouch_bt.conformance.hand import HandTests
from glotouch_bt.conformance.sensing import SensingTests
from glotouch_bt.conformance.stopping import StoppingTests


class RobotConformance(SensingTests, StoppingTests, HandTests, ContactTests, DeviceLossTests):
    """Subclass it and implement `make`; `glotouch_bt.conformance.base.Conformance` lists what else can be set."""
