"""Spaces of the environment, and observations as plain arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces

from glotouch_bt.robot import Array, Observation, RobotDescription

OBSERVATION_KEYS = (
    "stamp_s", "q", "dq", "position_B_P", "quat_B_P", "wrench_S", "gripper", "tactile_m", "tactile_dead", "tactile_new",
)  # fmt: skip
ACTION_KEYS = ("joint_velocity", "gripper", "tactile")


def action_space(robot: RobotDescription) -> spaces.Dict:
    """Return the space of commands.

    `joint_velocity` (dof,) rad/s at the end of the next control period; `gripper` (3,) aperture m, speed m/s and force
    N of the jaws; `tactile` 1 to request depth maps.
    """
    speed = np.array([joint.velocity_rad_s for joint in robot.joints])
    jaws = robot.gripper
    low, high = np.array([0.0, 0.001, 0.1]), np.array([jaws.stroke_m, jaws.speed_m_s, jaws.force_N])
    return spaces.Dict(
        {
            "joint_velocity": spaces.Box(-speed, speed, dtype=np.float64),
            "gripper": spaces.Box(low, high, dtype=np.float64),
            "tactile": spaces.Discrete(2),
        }
    )


def observation_space(robot: RobotDescription, samples: int) -> spaces.Dict:
    """Return the space of observations: the fields of `Observation`, with one row a sample; values are not bounded.

    `gripper` (4,) stamp s, aperture m, force N, and 1 while the jaws move; `tactile_m` (2, rows, columns) the newest
    left and right depth maps, 0 before the first and at dead taxels; `tactile_dead` 1 there; `tactile_new` 1 if they
    arrived in this period.
    """
    dof, pads = len(robot.joints), (2, *robot.gripper.pad_shape)

    def box(*shape: int) -> spaces.Box:
        return spaces.Box(-np.inf, np.inf, shape, dtype=np.float64)

    return spaces.Dict(
        {
            "stamp_s": box(samples),
            "q": box(samples, dof),
            "dq": box(samples, dof),
            "position_B_P": box(samples, 3),
            "quat_B_P": box(samples, 4),
            "wrench_S": box(samples, 6),
            "gripper": box(4),
            "tactile_m": box(*pads),
            "tactile_dead": spaces.MultiBinary(pads),
            "tactile_new": spaces.Discrete(2),
        }
    )


def as_arrays(observation: Observation, tactile_m: Array) -> dict[str, Any]:
    """Return an observation as an element of `observation_space`.

    Args:
        observation: The block.
        tactile_m: (2, rows, columns) newest depth maps; NaN at dead taxels.
    """
    jaws, dead = observation.gripper, np.isnan(tactile_m)
    found = {
        name: np.array(getattr(observation, name), dtype=np.float64)
        for name in ("stamp_s", "q", "dq", "position_B_P", "quat_B_P", "wrench_S")
    }
    return found | {
        "gripper": np.array([jaws.stamp_s, jaws.aperture_m, jaws.force_N, float(jaws.moving)]),
        "tactile_m": np.where(dead, 0.0, tactile_m),
        "tactile_dead": dead.astype(np.int8),
        "tactile_new": int(observation.tactile is not None),
    }
