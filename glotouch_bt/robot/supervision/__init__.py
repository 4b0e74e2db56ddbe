"""Guards between the mission and the robot: the supervisor, its limits, and one file a kind of guard."""

from glotouch_bt.robot.supervision.limits import GuardFinding, SupervisionLimits
from glotouch_bt.robot.supervision.supervisor import Supervisor
