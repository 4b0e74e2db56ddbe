"""Kinematics (Pinocchio), timing (ruckig), clearance (python-fcl), and the guarded motions made of them."""

from glotouch_bt.motion.arm import Arm
from glotouch_bt.motion.clearance import Blocked, Scene
from glotouch_bt.motion.kinematics import Kinematics, build_model
from glotouch_bt.motion.paths import Arc, Line, Path, Piece, Polyline
from glotouch_bt.motion.travel import Guard, Motion, MoveResult

__all__ = [
    "Arc",
    "Arm",
    "Blocked",
    "Guard",
    "Kinematics",
    "Line",
    "Motion",
    "MoveResult",
    "Path",
    "Piece",
    "Polyline",
    "Scene",
    "build_model",
]
