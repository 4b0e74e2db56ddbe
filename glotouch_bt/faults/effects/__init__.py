"""The effects of faults, one class per fault and one file per channel, and their catalogue. No plans, no triggers."""

from glotouch_bt.faults.effects.base import Actions, Effect, EffectContext, FaultParams, samples_altered
from glotouch_bt.faults.effects.catalogue import CATALOGUE, FaultKind
from glotouch_bt.faults.effects.model import WrongScaleStlParams
