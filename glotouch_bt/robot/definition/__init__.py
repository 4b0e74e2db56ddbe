"""Read a robot from two files: kinematics, inertia and limits from URDF, everything else from YAML."""

from glotouch_bt.robot.definition.read import read_robot
from glotouch_bt.robot.definition.robot_file import RobotFile
from glotouch_bt.robot.definition.urdf import LIMITS
