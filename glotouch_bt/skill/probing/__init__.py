"""The held tool and its guarded moves, for skills and benches."""

from glotouch_bt.skill.probing.guarded_probe import GUARDED_ACCELERATION_M_S2, GUARDED_JERK_M_S3, Probed, Prober
from glotouch_bt.skill.probing.held_tool import HeldTool
