"""The held tool and its guarded moves: what touches, for skills and benches alike."""

from glotouch_bt.skill.probing.guarded_probe import (
    LISTENING_ACCELERATION_M_S2,
    LISTENING_JERK_M_S3,
    Probed,
    Prober,
)
from glotouch_bt.skill.probing.held_tool import HeldTool

__all__ = ["LISTENING_ACCELERATION_M_S2", "LISTENING_JERK_M_S3", "HeldTool", "Probed", "Prober"]
