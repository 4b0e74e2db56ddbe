"""Protocols of a simulation: `Referee` for scoring, `TouchSampler` for experiments, `Disturber` for faults.

No skill may use them.
"""

from glotouch_bt.robot.simulation.disturber import Disturber, PathBlocked
from glotouch_bt.robot.simulation.referee import BareSteps, Referee, TrueObject
from glotouch_bt.robot.simulation.touch_sampler import Place, SampledClosure, TouchSampler
