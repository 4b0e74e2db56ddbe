"""TODO door of glotouch_bt/robot/simulation."""

from glotouch_bt.robot.simulation.disturber import Disturber, NoRoom
from glotouch_bt.robot.simulation.referee import BareSteps, Referee, TrueObject

__all__ = ["BareSteps", "Disturber", "NoRoom", "Referee", "TrueObject"]
