"""Controllers of arm and gripper between two setpoints, slow requests, and the hard limits."""

from glotouch_backends.mujoco.control.jaws import JawReports, JawServo, force_errors
from glotouch_backends.mujoco.control.requests import PAYLOAD_S, PendingPayload, PendingTare
from glotouch_backends.mujoco.control.safety import HardLimitGuard, check_sane, silence_mujoco
from glotouch_backends.mujoco.control.servo import BRAKE_REACH_M, Servo, hermite
