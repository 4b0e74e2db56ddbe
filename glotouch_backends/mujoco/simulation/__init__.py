"""TODO door of glotouch_backends/mujoco/simulation."""

from glotouch_backends.mujoco.simulation.control_trace import ControlTrace
from glotouch_backends.mujoco.simulation.disturber import MujocoDisturber
from glotouch_backends.mujoco.simulation.referee import MujocoReferee, Simulated
from glotouch_backends.mujoco.simulation.snapshot import SnapshotStore

__all__ = ["ControlTrace", "MujocoDisturber", "MujocoReferee", "Simulated", "SnapshotStore"]
