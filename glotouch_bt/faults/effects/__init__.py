"""The effects of faults: one class per fault, one file per channel. An effect never knows a plan or a trigger."""

from glotouch_bt.faults.effects.base import Actions, Effect, EffectContext, FaultParams, samples_altered
from glotouch_bt.faults.effects.model import WrongScaleStlParams

__all__ = ["Actions", "Effect", "EffectContext", "FaultParams", "WrongScaleStlParams", "samples_altered"]
