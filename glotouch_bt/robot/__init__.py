"""The interface between missions and robots. Imports only the lowest layers of this project.

`Robot.cycle(command) -> observation` is the contract; see `interface`. Values are frozen and carry units and frames in
their names; see `observation` for the frames.
"""

from glotouch_bt.errors import (
    BackendError,
    BadInput,
    GlotouchError,
    GuardTripped,
    MissionFailed,
    MotionRefused,
    ParamError,
    SafetyStop,
    StaleReading,
    UnknownName,
)
from glotouch_bt.lazy import spare
from glotouch_bt.robot.command import (
    HOLD,
    Command,
    GripperTarget,
    JointSetpoint,
    PendingTicket,
    Request,
    SetPayload,
    Tare,
    Ticket,
)
from glotouch_bt.robot.definition import RobotFile, read_robot
from glotouch_bt.robot.description import Box, Capsule, GelCamera, Gripper, Joint, Link, RobotDescription
from glotouch_bt.robot.fake import FakeRobot
from glotouch_bt.robot.geometry import (
    Array,
    Pose,
    cross,
    cross_matrix,
    frozen_array,
    matrix_to_quat,
    quat_to_matrix,
    rpy_to_matrix,
)
from glotouch_bt.robot.interface import Backend, Picture, Robot, Snapshot
from glotouch_bt.robot.limits import Limits
from glotouch_bt.robot.observation import SAMPLED, GelImages, GripperState, ImageArray, Observation, TactileFrame
from glotouch_bt.robot.registry import backend_entry_points, load_backend
from glotouch_bt.robot.scene import Conditions, Container, Holder, ObjectSet, Probe, World

spare("numpy.f2py", "numpy.testing")
