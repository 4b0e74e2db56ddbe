"""TODO door of glotouch_bt/robot/supervision."""

from glotouch_bt.robot.supervision.limits import Finding, SupervisionLimits
from glotouch_bt.robot.supervision.supervisor import Supervisor

__all__ = ["Finding", "SupervisionLimits", "Supervisor"]
