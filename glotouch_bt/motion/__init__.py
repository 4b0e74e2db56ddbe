"""Arm and jaw motions: kinematics (Pinocchio), time profiles (ruckig), clearance (python-fcl) and guarded moves."""

from glotouch_bt.motion.arm import Arm
from glotouch_bt.motion.clearance import Scene
from glotouch_bt.motion.hand_pose import hand_pose_B, yaw_near_home
from glotouch_bt.motion.jaws import JawRestDetector
from glotouch_bt.motion.kinematics import Kinematics
from glotouch_bt.motion.paths import Arc, Line, Polyline
from glotouch_bt.motion.pause_signal import PauseSignal
from glotouch_bt.motion.plan import plan_piece
from glotouch_bt.motion.shapes import finger_outline_half_m
from glotouch_bt.motion.timing import ProfileLimits, SpeedSteps, rest_to_rest
from glotouch_bt.motion.tool_memory import FREE_M_S, FeltSpace
from glotouch_bt.motion.travel import Motion, MoveResult, drive
from glotouch_bt.motion.workspace import out_of_reach
