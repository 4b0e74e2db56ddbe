"""TODO door of glotouch_bt/mission/check."""

from glotouch_bt.mission.check.loop_bounds import worst_case
from glotouch_bt.mission.check.rules import check_flow

__all__ = ["check_flow", "worst_case"]
