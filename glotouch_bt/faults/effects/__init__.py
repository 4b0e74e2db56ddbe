"""TODO door of glotouch_bt/faults/effects."""

from glotouch_bt.faults.effects.base import Acts, Effect, FaultParams, Scene, samples_altered
from glotouch_bt.faults.effects.model import ScaleParams

__all__ = ["Acts", "Effect", "FaultParams", "ScaleParams", "Scene", "samples_altered"]
