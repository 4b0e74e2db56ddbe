"""Backend over MuJoCo: the arm, the tactile gripper, a graspable probe and free objects. See `backend`."""

from glotouch_backends.mujoco.backend import MujocoBackend, build_world
from glotouch_backends.mujoco.robot import MAX_HELD_DISTANCE_M
from glotouch_backends.mujoco.truth import Truth
