"""The factory of simulated robots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import mujoco
import numpy as np

from glotouch_backends.mujoco.control import check_sane, silence_mujoco
from glotouch_backends.mujoco.model import Handles, compile_world
from glotouch_backends.mujoco.robot import MujocoRobot
from glotouch_backends.mujoco.simulation import MujocoDisturber, MujocoReferee
from glotouch_backends.mujoco.truth import Truth, draw_truth
from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.robot import (
    Backend,
    BackendError,
    Conditions,
    Limits,
    ParamError,
    Robot,
    RobotDescription,
    UnknownName,
    World,
)
from glotouch_bt.robot.simulation import Disturber, Referee

OPTIONS = ("fixed", "layout", "trace")
SETTLE_S = 0.6
START_APERTURE_M = 0.040
Layout = dict[str, tuple[float, float, float]]


def _read_layout(value: object) -> Layout:
    """Option `layout`: {object: (x m, y m, yaw rad)} in K."""
    rule = "a mapping of object names to (x m, y m, yaw rad)"
    if not isinstance(value, Mapping):
        raise ParamError("option layout", value, rule)
    places: Layout = {}
    for name, place in value.items():
        try:
            x, y, yaw = (float(v) for v in place)
        except (TypeError, ValueError) as e:
            raise ParamError(f"option layout[{name}]", place, rule) from e
        places[str(name)] = (x, y, yaw)
    return places


def _read_switch(name: str, value: object) -> bool:
    """An option that is on or off."""
    words = {"true": True, "false": False}
    found = value if isinstance(value, bool) else words.get(str(value).lower())
    if found is None:
        raise ParamError(f"option {name}", value, "true or false")
    return found


def _settle(model: mujoco.MjModel, data: mujoco.MjData, handles: Handles, description: RobotDescription) -> None:
    """Put the arm at home with half-open jaws, let everything come to rest, and start the clock at zero."""
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
    check_sane(data.warning.number, data.sensordata, data.time)


def build_world(
    description: RobotDescription, world: World, conditions: Conditions, seed: int, options: Mapping[str, object]
) -> tuple[Truth, mujoco.MjModel, mujoco.MjData, Handles]:
    """Draw, compile and settle the world of a trial; of the options only `layout` and `fixed` are looked at.

    Raises:
        BadInput: The world cannot be built.
        BackendError: MuJoCo failed; cause chained.
    """
    layout = _read_layout(options["layout"]) if "layout" in options else None
    fixed = _read_switch("fixed", options.get("fixed", False))
    silence_mujoco()
    truth = replace(draw_truth(world, conditions, seed, layout), fixed=fixed)
    model, handles = compile_world(description, world, truth)
    data = mujoco.MjData(model)
    try:
        _settle(model, data, handles, description)
    except mujoco.FatalError as e:
        raise BackendError(f"MuJoCo failed while the world {world.name!r} settled: {e}") from e
    return truth, model, data, handles


class MujocoBackend(Backend):
    """A Rizon 4 with a tactile gripper, a probe in its stand and free objects in a box, in MuJoCo.

    Args:
        description: The robot; the servo gains are for this arm.
        limits: Hard limits to enforce.
    """

    name = "mujoco"
    summary = "MuJoCo: Rizon 4, tactile gripper, free objects in a container; seeded, no display needed"

    def __init__(self, description: RobotDescription = RIZON4_XENSE, limits: Limits | None = None) -> None:
        self._description, self._limits = description, limits or Limits()

    def open(self, world: World, conditions: Conditions, seed: int, options: Mapping[str, object]) -> Robot:
        """See `Backend`.

        Options: `layout`, {object: (x m, y m, yaw rad)} in K, instead of a random layout; `fixed` (true or false),
        bolt the objects to the floor, as a calibration artefact is; `trace` (true or false), remember every control so
        that the referee can repeat the bare steps (some 80 kB a second of robot time).
        """
        for option in options:
            if option not in OPTIONS:
                raise UnknownName("option of backend mujoco", option, OPTIONS)
        traced = _read_switch("trace", options.get("trace", False))
        truth, model, data, handles = build_world(self._description, world, conditions, seed, options)
        return MujocoRobot(
            self._description, self._limits, world, truth, model, data, handles, conditions, seed, traced
        )

    def referee(self, robot: Robot) -> Referee | None:
        """See `Backend`."""
        return MujocoReferee(robot) if isinstance(robot, MujocoRobot) else None

    def disturber(self, robot: Robot) -> Disturber | None:
        """See `Backend`."""
        return MujocoDisturber(robot) if isinstance(robot, MujocoRobot) else None
