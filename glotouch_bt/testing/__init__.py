"""For those who write backends: one suite that every backend must pass. Needs pytest.

from glotouch_bt.testing import RobotConformance

class TestMine(RobotConformance):
    def make(self) -> Robot: return MyBackend().open(world, Conditions(), 0, {})
"""

from glotouch_bt.testing.conformance import RobotConformance
from glotouch_bt.testing.rig import Rig, Wall

__all__ = ["Rig", "RobotConformance", "Wall"]
