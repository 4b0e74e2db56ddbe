"""Arm and jaw motions: kinematics (Pinocchio), time profiles (ruckig), clearance (python-fcl) and guarded moves."""

from glotouch_bt.motion.arm import Arm
from glotouch_bt.motion.clearance import ClearanceViolation, Scene
from glotouch_bt.motion.hand_pose import hand_pose_B, yaw_near_home
from glotouch_bt.motion.jaws import JawRestDetector
from glotouch_bt.motion.kinematics import Kinematics, build_model
from glotouch_bt.motion.paths import Arc, Line, Path, Piece, Polyline
from glotouch_bt.motion.pause_signal import PauseSignal, Style
from glotouch_bt.motion.plan import MotionPlan, plan_piece
from glotouch_bt.motion.shapes import finger_outline_half_m
from glotouch_bt.motion.timing import rest_to_rest
from glotouch_bt.motion.travel import Guard, Motion, MoveResult

__all__ = [
    "Arc",
    "Arm",
    "ClearanceViolation",
    "Guard",
    "JawRestDetector",
    "Kinematics",
    "Line",
    "Motion",
    "MotionPlan",
    "MoveResult",
    "Path",
    "PauseSignal",
    "Piece",
    "Polyline",
    "Scene",
    "Style",
    "build_model",
    "finger_outline_half_m",
    "hand_pose_B",
    "plan_piece",
    "rest_to_rest",
    "yaw_near_home",
]
