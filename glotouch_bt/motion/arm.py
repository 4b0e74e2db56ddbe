"""Motions as generators: `result = yield from arm.line(pose, 0.04, guard=detector)`.

A motion is planned and checked completely before its first command. Then it yields one `Command` per control period and
receives the `Observation` of that period. When a guard trips, the NEXT command starts the deceleration. A generator may
be closed at any yield; the setpoint is then the last one yielded.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Generator, Mapping
from functools import wraps
from typing import Any, Concatenate, ParamSpec, TypedDict, TypeVar, Unpack

import numpy as np
import numpy.typing as npt

from glotouch_bt.motion.clearance import Scene
from glotouch_bt.motion.jaws import JawRestDetector
from glotouch_bt.motion.joints import plan_joints
from glotouch_bt.motion.paths import Arc, Line, Path, Polyline
from glotouch_bt.motion.plan import plan_piece
from glotouch_bt.motion.timing import JointProfile, ProfileLimits, SpeedSteps
from glotouch_bt.motion.tool_memory import FeltSpace, ToolSeat
from glotouch_bt.motion.travel import Guard, Motion, Mover, MoveResult
from glotouch_bt.robot import (
    Array,
    Command,
    GripperState,
    GripperTarget,
    Limits,
    MotionRefused,
    Observation,
    Pose,
    RobotDescription,
    World,
)

POSTURE_GAIN_1_M = 2.0
"""Null-space pull towards home in free motions, per metre travelled: half of the difference after 0.35 m."""
_START_M = 2e-3
"""Maximum distance of a path's start from the setpoint (servo error right after `sync`)."""
_START_RAD = 0.02
"""Maximum rotation of a path's start from the setpoint (servo error right after `sync`)."""


P = ParamSpec("P")
T = TypeVar("T")
A = TypeVar("A", bound="Arm")


def motion(make: Callable[Concatenate[A, P], Motion[T]]) -> Callable[Concatenate[A, P], Motion[T]]:
    """Decorate a motion so that `Arm.not_run` names it until its first command: `yield from` is easily forgotten."""

    @wraps(make)
    def made(arm: A, /, *args: P.args, **kwargs: P.kwargs) -> Motion[T]:
        caller = sys._getframe(1)
        name = f"{make.__name__!r} at {caller.f_code.co_filename}:{caller.f_lineno}"
        arm.not_run.append(name)
        return _run(arm, name, make(arm, *args, **kwargs))

    return made


def _run(arm: Arm, name: str, body: Motion[T]) -> Generator[Command, Observation, T]:
    arm.not_run.remove(name)
    return (yield from body)


class MoveOptions(TypedDict, total=False):
    """Keyword options of `Arm.follow`, accepted by every Cartesian motion."""

    acceleration_m_s2: float | None
    jerk_m_s3: float | None
    speed_steps: SpeedSteps
    guard: Guard | None
    check: bool
    tactile: bool
    posture_gain: float | None
    what: str


class Arm(Mover):
    """Motions of one arm. It stores the current setpoint, so one Arm drives one robot.

    Args:
        description: Robot data.
        limits: Robot-wide limits; the tool limits bound every motion.
        world: Nominal container, probe and holder.
        period_s: Control period.

    Attributes:
        kinematics: Forward and inverse kinematics.
        rotation_P_S: (3, 3) axes of the force sensor, written in P.
        scene: Obstacles; skills add the objects they find.
        felt: Space that the held tool has felt to be free.
        tool_seat: Displacement of the held tool since it was first measured.
        pause_signal: Pause state, written by the runner.
        not_run: Motions that were made and not run, each with its place in the code.
    """

    def __init__(self, description: RobotDescription, limits: Limits, world: World, period_s: float) -> None:
        super().__init__(description, limits, period_s)
        self.world = world
        self.rotation_P_S: Array = description.gripper.pose_E_P.rotation.T  # the axes of S are those of E
        self.scene = Scene(self.kinematics, world)
        self.felt = FeltSpace()
        self.tool_seat = ToolSeat()
        self.not_run: list[str] = []

    def state(self) -> dict[str, Any]:
        """Return the state kept between two motions, including the scene, for `restore`."""
        remembered = {"q": self._q.copy(), "aperture_m": self._aperture_m}
        parts = {"scene": self.scene.state(), "felt": self.felt.state(), "tool_seat": self.tool_seat.state()}
        return remembered | parts

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore a `state`; call `sync` afterwards if the arm has moved since.

        Raises:
            ValueError, TypeError, LookupError, BadInput: It does not fit this arm.
        """
        q, aperture_m = np.array(state["q"], dtype=np.float64), float(state["aperture_m"])
        if q.shape != self._q.shape or not np.isfinite([*q, aperture_m]).all():
            raise ValueError(f"joints {q.tolist()}, aperture {aperture_m} m")
        self._q, self._aperture_m, self._last_contact = q, aperture_m, None
        self.scene.restore(state["scene"])
        self.felt.restore(state["felt"])
        self.tool_seat.restore(state["tool_seat"])

    @property
    def rotation_B_S(self) -> Array:
        """Present axes (3, 3) of the force sensor, written in B."""
        return np.asarray(self.pose_B_P.rotation @ self.rotation_P_S)

    # -- motions -----------------------------------------------------------------------------------------------------

    @motion
    def hold(self, duration_s: float, *, tactile: bool = False) -> Motion[list[Observation]]:
        """Stay at rest for a whole number of periods (rounded up); return the observations."""
        out = []
        for _ in range(int(np.ceil(duration_s / self.period_s - 1e-9))):
            observation = yield Command(tactile=tactile)
            self._see(observation)
            out.append(observation)
        return out

    @motion
    def joints(self, q: npt.ArrayLike, speed: float = 0.5, *, check: bool = True) -> Motion[None]:
        """Move to joint positions `q` (dof,) rad along a straight line in joint space, from rest to rest.

        Args:
            q: Target.
            speed: 0..1, fraction of the joint speed limits; lowered so that P stays within the tool speed limit.
            check: Check clearance along the move.

        Raises:
            MotionRefused: Before the first command: a limit or the clearance would be violated.
        """
        goal = np.asarray(q, dtype=np.float64)
        running: JointProfile | None
        running, checks_q = plan_joints(self.kinematics, self._q, goal, speed, self.limits, self.period_s)
        if check:
            self._clear(checks_q, "joint move")
        while running is not None:
            k = yield from self._play_joints(running, pausable=True)
            if k is None:
                return
            running = yield from self._pause_joints(running, k)

    @motion
    def follow(
        self,
        path: Path,
        speed_m_s: float,
        *,
        acceleration_m_s2: float | None = None,
        jerk_m_s3: float | None = None,
        speed_steps: SpeedSteps = (),
        guard: Guard | None = None,
        check: bool = True,
        tactile: bool = False,
        posture_gain: float | None = None,
        what: str = "follow",
    ) -> Motion[MoveResult]:
        """Travel a Cartesian path of P from rest to rest, with a rest between its pieces.

        Args:
            path: Path that begins at the current pose of P.
            speed_m_s, acceleration_m_s2, jerk_m_s3: Limits along the path; the last two default to the robot's limits.
            speed_steps: Speeds that replace `speed_m_s` from path coordinates on: (coordinate m, speed m/s), ascending.
                The arm changes between them without a stop.
            guard: Called once a period with the newest observation. Any value but None stops the motion with the stop
                deceleration and jerk of the limits, and is returned as `stop`.
            check: Check clearance along the path (reach and joint limits are always checked).
            tactile: Request depth maps.
            posture_gain: Null-space pull towards home per metre; by default 0 with a guard, else `POSTURE_GAIN_1_M`.
            what: Name of the motion for the error message.

        Raises:
            MotionRefused: Before the first command: the path does not begin at P, exceeds a limit, leaves the arm's
                reach or a joint's range or speed, or has too little clearance (the pair is named).
        """
        acceleration = self.limits.tcp_acceleration_m_s2 if acceleration_m_s2 is None else acceleration_m_s2
        jerk = self.limits.tcp_jerk_m_s3 if jerk_m_s3 is None else jerk_m_s3
        for speed in (speed_m_s, *(pace for _, pace in speed_steps)):
            self._within_limits(speed, acceleration, jerk, what)
        if posture_gain is None:
            posture_gain = POSTURE_GAIN_1_M if guard is None else 0.0
        self._begins_here(path, what)
        plans = []
        q, begin_m = self._q, 0.0
        for piece in path.pieces:
            plan = plan_piece(
                self.kinematics,
                piece,
                q,
                limits=ProfileLimits(
                    speed_m_s, acceleration, jerk, tuple((at - begin_m, pace) for at, pace in speed_steps)
                ),
                period_s=self.period_s,
                posture_gain=posture_gain,
                what=what,
            )
            q, begin_m = plan.knots_q[-1], begin_m + piece.length_m
            plans.append(plan)
        if check and plans:
            self._clear(np.concatenate([p.knots_q for p in plans]), what)
        return (yield from self._travel(plans, guard, tactile))

    @motion
    def line(self, pose_B_P: Pose, speed_m_s: float, **options: Unpack[MoveOptions]) -> Motion[MoveResult]:
        """Move straight to a pose of P in B; options as in `follow`."""
        options.setdefault("what", "line")
        return (yield from self.follow(Line(self.pose_B_P, pose_B_P), speed_m_s, **options))

    @motion
    def shift(
        self, displacement_B_m: npt.ArrayLike, speed_m_s: float, **options: Unpack[MoveOptions]
    ) -> Motion[MoveResult]:
        """Move straight by a displacement (3,) m in B at constant orientation; options as in `follow`."""
        here = self.pose_B_P
        there = Pose(here.position_m + np.asarray(displacement_B_m, dtype=np.float64), here.quat)
        options.setdefault("what", "shift")
        return (yield from self.follow(Line(here, there), speed_m_s, **options))

    @motion
    def arc(
        self,
        centre_B_m: npt.ArrayLike,
        axis: npt.ArrayLike,
        angle_rad: float,
        speed_m_s: float,
        *,
        turn: bool = False,
        **options: Unpack[MoveOptions],
    ) -> Motion[MoveResult]:
        """Move on an arc about an axis through `centre_B_m` (3,); `turn` rotates the hand; options as in `follow`."""
        options.setdefault("what", "arc")
        path = Arc(self.pose_B_P, centre_B_m, axis, angle_rad, turn)
        return (yield from self.follow(path, speed_m_s, **options))

    @motion
    def transit(
        self, pose_B_P: Pose, height_B_m: float, speed_m_s: float, **options: Unpack[MoveOptions]
    ) -> Motion[MoveResult]:
        """Move straight up to a height of P in B, across with all rotation, and straight down; options as in `follow`.

        A start or goal above the height is not lowered to it.
        """
        here = self.pose_B_P
        up = Pose(np.array([*here.position_m[:2], max(here.position_m[2], height_B_m)]), here.quat)
        over = Pose(np.array([*pose_B_P.position_m[:2], max(pose_B_P.position_m[2], height_B_m)]), pose_B_P.quat)
        options.setdefault("what", "transit")
        path = Polyline((here, up, over, pose_B_P))
        return (yield from self.follow(path, speed_m_s, **options))

    @motion
    def jaws(
        self,
        aperture_m: float,
        *,
        speed_m_s: float = 0.05,
        force_N: float = 10.0,
        timeout_s: float = 3.0,
        tactile: bool = False,
        on_observation: Callable[[Observation], None] | None = None,
    ) -> Motion[GripperState]:
        """Drive the jaws while the arm holds, until they rest for about 60 ms or the timeout ends.

        Args:
            aperture_m: Target aperture; clipped to the stroke.
            speed_m_s, force_N: Limits of the jaws; clipped to the gripper's limits.
            timeout_s: Maximum duration; after a timeout the returned state says `moving`.
            tactile: Request depth maps.
            on_observation: Called with every observation (to collect frames).

        Returns:
            The last reported state with aperture and force averaged over the rest window.
        """
        hand = self.description.gripper
        gripper: GripperTarget | None = GripperTarget(
            min(max(aperture_m, 0.0), hand.stroke_m), min(speed_m_s, hand.speed_m_s), min(force_N, hand.force_N)
        )
        watch = JawRestDetector(self.period_s)
        with self.pause_signal.finishing():
            for _ in range(max(1, int(np.ceil(timeout_s / self.period_s - 1e-9)))):
                observation = yield Command(gripper=gripper, tactile=tactile)
                gripper = None
                self._see(observation)
                if on_observation is not None:
                    on_observation(observation)
                if watch.still(observation.now_s, observation.gripper):
                    break
        return watch.state()

    # -- inside ------------------------------------------------------------------------------------------------------

    def _within_limits(self, speed: float, acceleration: float, jerk: float, what: str) -> None:
        limits = self.limits
        for name, value, limit in (
            ("speed_m_s", speed, limits.tcp_speed_m_s),
            ("acceleration_m_s2", acceleration, limits.tcp_acceleration_m_s2),
            ("jerk_m_s3", jerk, limits.tcp_jerk_m_s3),
        ):
            if not 0.0 < value <= limit * (1 + 1e-9):
                raise MotionRefused(what, f"{name} {value:g} is not within 0..{limit:g}")

    def _begins_here(self, path: Path, what: str) -> None:
        begin, here = path.pose(0.0), self.pose_B_P
        away = float(np.linalg.norm(begin.position_m - here.position_m))
        turned = 2.0 * float(np.arccos(min(1.0, abs(float(begin.quat @ here.quat)))))
        if away > _START_M or turned > _START_RAD:
            raise MotionRefused(
                what, f"the path begins {away * 1e3:.1f} mm and {np.degrees(turned):.1f} deg from P's setpoint"
            )

    def _clear(self, q: Array, what: str) -> None:
        found = self.scene.first_violation(q, self._aperture_m)
        if found is not None:
            share = 100.0 * found.index / max(len(q) - 1, 1)
            raise MotionRefused(what, f"{found}, {share:.0f} % of the way")
