"""The factory of simulated robots."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import mujoco
import numpy as np

from glotouch_backends.mujoco.axis_proof import AxisProof
from glotouch_backends.mujoco.control import check_sane, silence_mujoco
from glotouch_backends.mujoco.model import BuiltWorld, Handles, compile_world
from glotouch_backends.mujoco.robot import MujocoRobot
from glotouch_backends.mujoco.sampler import MujocoTouchSampler
from glotouch_backends.mujoco.simulation import MujocoDisturber, MujocoReferee
from glotouch_backends.mujoco.truth import draw_truth
from glotouch_backends.options import WorldOptions, convert_options
from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_backends.robots import load_robot, shipped_robots
from glotouch_bt.robot import Backend, BackendError, Conditions, Limits, Picture, Robot, RobotDescription, World
from glotouch_bt.robot.simulation import Disturber, Referee, TouchSampler

DEFAULT_ROBOT = "rizon4"
SETTLE_S = 0.6
"""Simulated time in which the world comes to rest. Source: ours."""
START_APERTURE_M = 0.040
"""Aperture of the jaws at the start. Source: ours."""


@dataclass(frozen=True, kw_only=True)
class MujocoOptions(WorldOptions):
    """Options of this backend.

    Attributes:
        robot: Name of a shipped robot, or path of a robot's YAML file.
        trace: Record every control input, so that the referee can repeat the solver steps (80 kB/s).
    """

    robot: str = DEFAULT_ROBOT
    trace: bool = False


def _settle(model: mujoco.MjModel, data: mujoco.MjData, handles: Handles, description: RobotDescription) -> None:
    """Put the arm at home with half-open jaws, let the world come to rest, and set the clock to zero."""
    home = np.array(description.home_q)
    data.qpos[handles.arm_qpos] = home
    data.qpos[handles.jaw_qpos] = 0.5 * START_APERTURE_M
    data.ctrl[handles.arm_ctrl] = home
    data.ctrl[handles.jaw_ctrl] = 0.5 * START_APERTURE_M
    mujoco.mj_step(model, data, round(SETTLE_S / model.opt.timestep))
    data.qvel[:] = 0.0
    data.qpos[handles.arm_qpos] = home
    data.time = 0.0
    mujoco.mj_forward(model, data)
    check_sane(data.warning.number, data.sensordata[None], data.time)


def build_world(
    description: RobotDescription, world: World, conditions: Conditions, seed: int, options: WorldOptions
) -> BuiltWorld:
    """Draw, compile and settle the world of a trial.

    Raises:
        BadInput: The world cannot be built.
        BackendError: MuJoCo failed; cause chained.
    """
    silence_mujoco()
    proof = AxisProof(conditions)
    truth = replace(draw_truth(description, world, conditions, seed, proof, options.layout), fixed=options.fixed)
    model, handles = compile_world(description, world, truth)
    data = mujoco.MjData(model)
    try:
        _settle(model, data, handles, description)
    except mujoco.FatalError as e:
        raise BackendError(f"MuJoCo failed while the world {world.name!r} settled: {e}") from e
    return BuiltWorld(description, world, conditions, seed, truth, model, data, handles, proof)


class MujocoBackend(Backend):
    """An arm with a tactile gripper, a probe in its stand and free objects in a box, in MuJoCo.

    Args:
        limits: Hard limits to enforce.
    """

    name = "mujoco"
    summary = (
        "MuJoCo: an arm (--set robot=NAME or FILE), tactile gripper, free objects in a container; seeded, "
        "no display needed"
    )
    description = RIZON4_XENSE
    clock_waits = True

    def __init__(self, limits: Limits | None = None) -> None:
        self._limits = limits or Limits()

    def describe(self, options: Mapping[str, object]) -> RobotDescription:
        """See `Backend`."""
        return load_robot(str(options.get("robot", DEFAULT_ROBOT)))

    def open(self, world: World, conditions: Conditions, seed: int, options: Mapping[str, object]) -> Robot:
        """See `Backend`; options in `MujocoOptions`."""
        chosen = MujocoOptions(**convert_options(self.name, options, MujocoOptions))
        built = build_world(load_robot(chosen.robot), world, conditions, seed, chosen)
        return MujocoRobot(built, self._limits, chosen.trace)

    def is_portable(self, option: str, value: object) -> bool:
        """See `Backend`: every option describes the simulated world, except a robot's file."""
        return option != "robot" or value in shipped_robots()

    def referee(self, robot: Robot) -> Referee | None:
        """See `Backend`."""
        return MujocoReferee(robot) if isinstance(robot, MujocoRobot) else None

    def disturber(self, robot: Robot) -> Disturber | None:
        """See `Backend`."""
        return MujocoDisturber(robot) if isinstance(robot, MujocoRobot) else None

    def camera(self, robot: Robot) -> Callable[[int, int], Picture] | None:
        """See `Backend`."""
        from glotouch_backends.mujoco.render import render

        return partial(render, robot) if isinstance(robot, MujocoRobot) else None

    def touch_sampler(self, world: World, conditions: Conditions, seed: int) -> TouchSampler:
        """See `Backend`."""
        return MujocoTouchSampler(self.description, world, conditions, seed)
