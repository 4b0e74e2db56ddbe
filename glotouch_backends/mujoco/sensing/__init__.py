"""Models of the wrist force sensor and the tactile pads: true state in, disturbed readings out."""

from glotouch_backends.mujoco.sensing.depth import DepthErrors
from glotouch_backends.mujoco.sensing.gel import PairPress
from glotouch_backends.mujoco.sensing.kinematics import PoseReports
from glotouch_backends.mujoco.sensing.tactile import Tactile, body_pose
from glotouch_backends.mujoco.sensing.wrench import GRAVITY_M_S2, WristSensor, up_in
