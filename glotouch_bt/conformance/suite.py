"""One suite that every backend passes: what a `Robot` promises, looked at from outside.

Subclass `RobotConformance` in a test file, say how a robot is made, and pytest does the rest. What only some robots can
be asked (a known wall, losing a device) is offered by overriding `wall` and `losses`; without that those tests are
skipped by name. Nothing is needed but free space: 0.15 m round the home posture.

The tests use one robot one after another; those that end one make their own. So do not spread them over processes where
there is only one device.
"""

from __future__ import annotations

from glotouch_bt.conformance.contact import ContactTests
from glotouch_bt.conformance.hand import HandTests
from glotouch_bt.conformance.losing import LossTests
from glotouch_bt.conformance.sensing import SensingTests
from glotouch_bt.conformance.stopping import StoppingTests


class RobotConformance(SensingTests, StoppingTests, HandTests, ContactTests, LossTests):
    """Subclass it and implement `make`; `glotouch_bt.conformance.base.Conformance` says what else can be told."""
