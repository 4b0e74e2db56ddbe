"""TODO door of glotouch_backends/mujoco/simulation."""

from glotouch_backends.mujoco.simulation.disturber import MujocoDisturber
from glotouch_backends.mujoco.simulation.referee import MujocoReferee, Simulated
from glotouch_backends.mujoco.simulation.snapshot import SnapshotStore
from glotouch_backends.mujoco.simulation.trace import Trace

__all__ = ["MujocoDisturber", "MujocoReferee", "Simulated", "SnapshotStore", "Trace"]
