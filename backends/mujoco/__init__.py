"""Robot over MuJoCo: the arm, the tactile gripper, a really grasped probe and free objects. See `backend`."""

from backends.mujoco.backend import MujocoBackend

__all__ = ["MujocoBackend"]
