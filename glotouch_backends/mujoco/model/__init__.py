"""Builders of the compiled MuJoCo model: one file a part of the world. No time step."""

from glotouch_backends.mujoco.model.arm import DAMPING_PER_STIFFNESS_S, JOINT_DAMPING
from glotouch_backends.mujoco.model.compile import STEP_S, STEPS, BuiltWorld, Handles, SensorMap, compile_world
from glotouch_backends.mujoco.model.gripper import JAW_STIFFNESS_N_M
from glotouch_backends.mujoco.model.probe import handle_mesh
