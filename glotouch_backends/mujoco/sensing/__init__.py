"""TODO door of glotouch_backends/mujoco/sensing."""

from glotouch_backends.mujoco.sensing.tactile import Tactile, body_pose
from glotouch_backends.mujoco.sensing.wrench import GRAVITY_M_S2, WristSensor, hand_mass, up_in

__all__ = ["GRAVITY_M_S2", "Tactile", "WristSensor", "body_pose", "hand_mass", "up_in"]
