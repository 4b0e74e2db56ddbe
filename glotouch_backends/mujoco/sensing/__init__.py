"""Models of the wrist force sensor and the tactile pads: true state in, disturbed readings out."""

from glotouch_backends.mujoco.sensing.depth import DepthErrors
from glotouch_backends.mujoco.sensing.gel import GelSensor, PairPress, Side, pad_pose_P
from glotouch_backends.mujoco.sensing.kinematics import PoseReports
from glotouch_backends.mujoco.sensing.rays import SurfaceRays
from glotouch_backends.mujoco.sensing.tactile import Tactile, TaxelErrors, body_pose, gel_of_trial, imager_of_trial
from glotouch_backends.mujoco.sensing.wrench import GRAVITY_M_S2, WristSensor, up_in
