"""Kinematics (Pinocchio), timing (ruckig), clearance (python-fcl), and the guarded motions made of them."""

from glotouch_bt.motion.arm import Arm
from glotouch_bt.motion.clearance import Blocked, Scene
from glotouch_bt.motion.jaws import JawWatch
from glotouch_bt.motion.kinematics import Kinematics, build_model
from glotouch_bt.motion.paths import Arc, Line, Path, Piece, Polyline
from glotouch_bt.motion.pause_signal import PauseSignal, Style
from glotouch_bt.motion.plan import Plan, plan_piece
from glotouch_bt.motion.shapes import finger_outline_half_m
from glotouch_bt.motion.timing import rest_to_rest
from glotouch_bt.motion.travel import Guard, Motion, MoveResult

__all__ = [
    "Arc",
    "Arm",
    "Blocked",
    "Guard",
    "JawWatch",
    "Kinematics",
    "Line",
    "Motion",
    "MoveResult",
    "Path",
    "PauseSignal",
    "Piece",
    "Plan",
    "Polyline",
    "Scene",
    "Style",
    "build_model",
    "finger_outline_half_m",
    "plan_piece",
    "rest_to_rest",
]
