"""The environment: one step is one control period of a robot."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from glotouch_bt.environment.spaces import action_space, as_arrays, observation_space
from glotouch_bt.mission.read import load_conditions, load_world
from glotouch_bt.motion import Kinematics
from glotouch_bt.robot import (
    HOLD,
    Array,
    BackendError,
    Command,
    GripperTarget,
    JointSetpoint,
    Observation,
    ParamError,
    Robot,
    SafetyStop,
    Tare,
    World,
    load_backend,
)
from glotouch_bt.robot.simulation import Referee

ACCELERATION_RAD_S2 = 2.0
"""Default limit on joint accelerations. Source: measured; random actions ran 8 s without a stop at 3 rad/s2 (seeds
1-3), and tripped the force guard at 5 by the inertia of the hand."""
TARE_PERIODS = 1000
"""Longest wait for the tare at a reset, in control periods."""


@dataclass(frozen=True)
class Transition:
    """Data from which a reward is computed.

    Attributes:
        before, after: Observations at the beginning and at the end of the period.
        command: The command that was sent, within the limits.
        referee: The true state of a simulated world at its end; None on hardware.
        stopped: A safety stop ended the episode in this period.
    """

    before: Observation
    after: Observation
    command: Command
    referee: Referee | None
    stopped: bool


class TouchEnv(gymnasium.Env):
    """A robot of this project as a gymnasium environment.

    An action is one command (see `action_space`): joint velocities are integrated to setpoints within the limits of
    position, velocity and acceleration. An observation is the block of one control period (see `observation_space`).
    An episode is terminated by a safety stop or by `done`, and truncated after `duration_s`.

    `reset(seed=N)` draws the world of `--seed N`: the layouts of the benchmarks. Without a seed, the next one is drawn
    from the environment's own generator.

    Args:
        backend: Name of a registered backend.
        world: A world, the path of a world file, or the name of a shipped one.
        conditions: Name or path of the disturbances.
        options: Options of the backend.
        reward: Returns the reward of a transition (default: 0).
        done: Returns True if a transition ends the episode.
        duration_s: Length of an episode, s of robot time.
        acceleration_rad_s2: Limit on the change of every joint velocity.
        tare: Zero the wrist sensor at every reset.

    Raises:
        BadInput: An argument is wrong.
        BackendError: The robot does not open.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as gymnasium declares it

    def __init__(
        self,
        backend: str = "mujoco",
        *,
        world: str | Path | World = "container_five",
        conditions: str | Path = "nominal",
        options: Mapping[str, object] | None = None,
        reward: Callable[[Transition], float] = lambda transition: 0.0,
        done: Callable[[Transition], bool] = lambda transition: False,
        duration_s: float = 60.0,
        acceleration_rad_s2: float = ACCELERATION_RAD_S2,
        tare: bool = True,
    ) -> None:
        for name, value in (("duration_s", duration_s), ("acceleration_rad_s2", acceleration_rad_s2)):
            if not (math.isfinite(value) and value > 0):
                raise ParamError(name, value, "finite and positive")
        self._backend = load_backend(backend)
        self._world = world if isinstance(world, World) else load_world(str(world))
        self._conditions = load_conditions(str(conditions))
        self._options = dict(options or {})
        self._reward, self._done, self._tare = reward, done, tare
        self._duration_s, self._acceleration = duration_s, acceleration_rad_s2
        self._robot = self._opened(0)
        self._unused_seed: int | None = 0
        description = self._robot.description
        self._kinematics = Kinematics(description)
        self._lower = np.array([joint.lower_rad for joint in description.joints])
        self._upper = np.array([joint.upper_rad for joint in description.joints])
        self.action_space = action_space(description)
        self.observation_space = observation_space(description, len(self._robot.observe().stamp_s))
        self._start()

    @property
    def robot(self) -> Robot:
        """The open robot, for slow requests and limits."""
        return self._robot

    @property
    def referee(self) -> Referee | None:
        """The true state of a simulated world, for rewards and scores; None on hardware."""
        return self._referee

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Open the world of a seed; see `gymnasium.Env.reset`. It takes no options."""
        super().reset(seed=seed)
        chosen = int(self.np_random.integers(2**32)) if seed is None else seed
        if self._unused_seed != chosen:
            self.close()
            self._robot = self._opened(chosen)
        self._unused_seed = None
        self._start()
        if self._tare:
            self._zero_wrist()
        self._ends_s = self._newest.now_s + self._duration_s
        return self._shown(), {"seed": chosen}

    def step(self, action: Mapping[str, Any]) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Send one command; see `gymnasium.Env.step`. `info["stop"]` is the reason of a safety stop.

        Raises:
            ParamError: The action has no finite number of the right shape.
            BackendError: The device or simulator failed.
        """
        before, command, info = self._newest, self._command(action), {}
        try:
            self._take(self._robot.cycle(command))
        except SafetyStop as e:
            self._take(self._robot.observe())
            info["stop"] = str(e)
        transition = Transition(before, self._newest, command, self._referee, "stop" in info)
        terminated = bool("stop" in info or self._done(transition))
        truncated = self._newest.now_s > self._ends_s - 0.5 * self._robot.period_s
        return self._shown(), float(self._reward(transition)), terminated, truncated, info

    def close(self) -> None:
        """Hold the arm and release the robot."""
        self._robot.hold()
        self._robot.close()

    def _opened(self, seed: int) -> Robot:
        return self._backend.open(self._world, self._conditions, seed, self._options)

    def _start(self) -> None:
        self._referee = self._backend.referee(self._robot)
        self._tactile = np.zeros((2, *self._robot.description.gripper.pad_shape))
        self._take(self._robot.observe())
        self._q = np.clip(self._newest.q[-1], self._lower, self._upper)
        self._dq = np.zeros_like(self._q)
        self._ends_s = math.inf

    def _zero_wrist(self) -> None:
        ticket = self._robot.start(Tare())
        for _ in range(TARE_PERIODS):
            if ticket.done:
                break
            self._take(self._robot.cycle(HOLD))
        if not ticket.done or ticket.error is not None:
            raise BackendError(f"the wrist sensor cannot be zeroed: {ticket.error or 'no answer'}")

    def _take(self, observation: Observation) -> None:
        self._newest = observation
        if observation.tactile is not None:
            self._tactile = np.stack([observation.tactile.left_m, observation.tactile.right_m])

    def _shown(self) -> dict[str, Any]:
        return as_arrays(self._newest, self._tactile)

    def _command(self, action: Mapping[str, Any]) -> Command:
        """Return the command of an action, within the limits.

        The velocity changes linearly within the period, so that the setpoint lies at q + (dq + dq') / 2 dt.
        """
        velocity = self._within(action, "joint_velocity")
        aperture_m, speed_m_s, force_N = self._within(action, "gripper").tolist()
        period_s = self._robot.period_s
        change = self._acceleration * period_s
        dq = np.clip(velocity, self._dq - change, self._dq + change)
        q = self._q + 0.5 * (self._dq + dq) * period_s
        outside = (q < self._lower) | (q > self._upper)
        q, dq = np.clip(q, self._lower, self._upper), np.where(outside, 0.0, dq)
        ddq = (dq - self._dq) / period_s
        self._q, self._dq = q, dq
        motion = JointSetpoint(q, dq, ddq, self._kinematics.fk(q))
        return Command(motion, GripperTarget(aperture_m, speed_m_s, force_N), bool(action["tactile"]))

    def _within(self, action: Mapping[str, Any], name: str) -> Array:
        box = self.action_space[name]
        value = np.asarray(action[name], dtype=np.float64)
        if value.shape != box.shape or not np.isfinite(value).all():
            raise ParamError(f"action.{name}", value.tolist(), f"{box.shape[0]} finite numbers")
        return np.asarray(np.clip(value, box.low, box.high))
