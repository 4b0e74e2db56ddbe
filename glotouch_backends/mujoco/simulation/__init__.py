"""Access to the simulated world besides the robot: ground truth, faults, snapshots and replay of the solver steps."""

from glotouch_backends.mujoco.simulation.collision_filter import CollisionFilter
from glotouch_backends.mujoco.simulation.control_trace import ControlTrace
from glotouch_backends.mujoco.simulation.disturber import MujocoDisturber
from glotouch_backends.mujoco.simulation.referee import MujocoReferee, Simulated
from glotouch_backends.mujoco.simulation.snapshot import SnapshotStore
from glotouch_backends.mujoco.simulation.true_force import TrueForce
