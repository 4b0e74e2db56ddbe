"""The test suite that every backend must pass, for authors of backends. Needs pytest.

from glotouch_bt.conformance import RobotConformance

class TestMine(RobotConformance):
    def make(self) -> Robot: return MyBackend().open(world, Conditions(), 0, {})
"""

from glotouch_bt.conformance.rig import Rig, Wall
from glotouch_bt.conformance.suite import RobotConformance
