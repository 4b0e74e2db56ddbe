"""Protocols that a simulation offers to scoring (`Referee`) and to faults (`Disturber`); no skill may use them."""

from glotouch_bt.robot.simulation.disturber import Disturber, PathBlocked
from glotouch_bt.robot.simulation.referee import BareSteps, Referee, TrueObject
