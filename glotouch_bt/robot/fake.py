"""A robot without physics, for fast tests: it is exactly where it was commanded to be.

Every quantity moves linearly from one setpoint to the next. The tip touches elastic walls (or feels a function that the
test gives), the jaws grip a rigid width, and the gels are flat. No randomness, no sleeping.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import acos, atan2, hypot, pi

import numpy as np
import numpy.typing as npt

from glotouch_bt.compiled import compiled
from glotouch_bt.errors import BadInput, ParamError, SafetyStop
from glotouch_bt.robot.command import Command, GripperTarget, PendingTicket, Request, SetPayload
from glotouch_bt.robot.description import Box, Capsule, Gripper, Joint, Link, RobotDescription, forward
from glotouch_bt.robot.geometry import Array, Pose, cross, frozen_array
from glotouch_bt.robot.interface import Backend, Robot
from glotouch_bt.robot.limits import Limits
from glotouch_bt.robot.observation import GripperState, Observation, TactileFrame
from glotouch_bt.robot.scene import Conditions, World

WrenchFunction = Callable[[Array, Array, Array], Array]

_UPPER_M, _FORE_M, _SHOULDER_M, _HAND_M = 0.40, 0.40, 0.30, 0.30


def _fake_arm() -> RobotDescription:
    """Return an arm of seven revolute joints, z y z y z y z, straight up at q = 0. All numbers are made up."""
    heights = (0.15, _SHOULDER_M - 0.15, 0.20, _UPPER_M - 0.20, 0.20, _FORE_M - 0.20, 0.05)
    joints = []
    for i, height in enumerate(heights):
        reach = heights[i + 1] if i < 6 else 0.05
        capsule = Capsule(start_m=(0.0, 0.0, 0.0), end_m=(0.0, 0.0, reach), radius_m=0.05)
        link = Link(
            name=f"link{i + 1}",
            mass_kg=2.0,
            com_m=(0.0, 0.0, 0.5 * reach),
            inertia_kgm2=(0.01, 0.01, 0.005, 0.0, 0.0, 0.0),
            capsules=(capsule,),
        )
        axis = (0.0, 1.0, 0.0) if i % 2 else (0.0, 0.0, 1.0)
        joint = Joint(
            name=f"joint{i + 1}",
            origin_m=(0.0, 0.0, height),
            origin_rpy_rad=(0.0, 0.0, 0.0),
            axis=axis,
            lower_rad=-2.8,
            upper_rad=2.8,
            velocity_rad_s=2.5,
            torque_Nm=100.0,
            armature_kgm2=0.1,
            link=link,
        )
        joints.append(joint)
    # Home: P at (0.60, 0, 0.10) m, hand straight down; the wrist stands _HAND_M above it (law of cosines, equal links).
    x, z = 0.60, 0.10 + _HAND_M - _SHOULDER_M
    bend = 2.0 * acos(hypot(x, z) / (_UPPER_M + _FORE_M))
    lean = atan2(x, z) - 0.5 * bend
    hand = Gripper(
        pose_E_P=Pose(np.array([0.0, 0.0, 0.20])),
        mass_kg=0.7,
        com_E_m=(0.0, 0.0, 0.045),
        finger_mass_kg=0.09,
        stroke_m=0.085,
        force_N=60.0,
        speed_m_s=0.35,
        body=(Box(centre_m=(0.0, 0.0, 0.0425), half_m=(0.04, 0.07, 0.0425)),),
        finger=Box(centre_m=(0.0, 0.007, -0.0495), half_m=(0.011, 0.007, 0.0655)),
        pad_window_m=(0.0172, 0.0285),
        pad_shape=(35, 20),
        pad_depth_m=0.0015,
    )
    return RobotDescription(
        name="Fake 7R",
        base=Link(name="base", mass_kg=5.0, com_m=(0.0, 0.0, 0.05), inertia_kgm2=(0.02, 0.02, 0.02, 0.0, 0.0, 0.0)),
        joints=tuple(joints),
        pose_last_E=Pose(np.array([0.0, 0.0, 0.05])),
        home_q=(0.0, lean, 0.0, bend, 0.0, pi - lean - bend, 0.0),
        gripper=hand,
        source="made up",
    )


FAKE_ARM = _fake_arm()


def _turned(quat: Array, vector: Array) -> Array:
    """Rotate vectors (n, 3) by unit quaternions (n, 4): v + 2 u x (w v + u x v)."""
    w, u = quat[:, :1], quat[:, 1:]
    return np.asarray(vector + 2.0 * np.cross(u, w * vector + np.cross(u, vector)), dtype=np.float64)


@compiled("given f8[:]", "given f8[:]", "given f8[::1]")
def _between(before: Array, after: Array, share: Array) -> Array:
    """Return the rows (n, k) on the way from one vector (k,) to another, at shares (n,) of it."""
    out = np.zeros((len(share), len(before)))
    for i in range(len(share)):
        for k in range(len(before)):
            out[i, k] = before[k] + share[i] * (after[k] - before[k])
    return out


@compiled("given f8[:]", "given f8[:]", "given f8[::1]")
def _turned_by(before: Array, after: Array, share: Array) -> Array:
    """Return the unit quaternions (n, 4) on the shorter way from one (4,) to another, at shares (n,) of the chord."""
    dot = 0.0
    for k in range(4):
        dot += before[k] * after[k]
    sign = 1.0 if dot >= 0.0 else -1.0
    out = np.zeros((len(share), 4))
    for i in range(len(share)):
        square = 0.0
        for k in range(4):
            out[i, k] = before[k] + share[i] * (sign * after[k] - before[k])
            square += out[i, k] * out[i, k]
        out[i] /= np.sqrt(square)
    return out


@compiled("given f8[:, :]")
def _norms(wrench: Array) -> Array:
    """Return the norms (n, 2) of force and torque of wrenches (n, 6)."""
    out = np.zeros((len(wrench), 2))
    for i in range(len(wrench)):
        for j in range(2):
            x, y, z = wrench[i, 3 * j], wrench[i, 3 * j + 1], wrench[i, 3 * j + 2]
            out[i, j] = np.sqrt(x * x + y * y + z * z)
    return out


@dataclass(frozen=True)
class SpringWall:
    """A frictionless elastic half space.

    Attributes:
        point_B_m: (3,) any point of its face.
        normal_B: (3,) direction out of the wall, into free space.
        stiffness_N_m: Force per metre of depth.
    """

    point_B_m: Array
    normal_B: Array
    stiffness_N_m: float

    def __post_init__(self) -> None:
        normal = frozen_array("wall.normal_B", self.normal_B, (3,))
        length = float(np.linalg.norm(normal))
        if length < 1e-9 or not self.stiffness_N_m > 0:
            raise ParamError("wall", (normal.tolist(), self.stiffness_N_m), "a normal that is not zero, stiffness > 0")
        object.__setattr__(self, "point_B_m", frozen_array("wall.point_B_m", self.point_B_m, (3,)))
        object.__setattr__(self, "normal_B", frozen_array("wall.normal_B", normal / length, (3,)))

    def force_B_N(self, ball_B_m: Array, radius_m: float) -> Array:
        """Return the force (n, 3) on a ball of `radius_m` with centres `ball_B_m` (n, 3): stiffness times depth."""
        depth = np.maximum(radius_m - (ball_B_m - self.point_B_m) @ self.normal_B, 0.0)
        return np.asarray(self.stiffness_N_m * depth[:, None] * self.normal_B, dtype=np.float64)


class FakeRobot(Robot):
    """A robot that follows every setpoint exactly.

    Args:
        description: The arm.
        limits: Hard limits to enforce.
        period_s: Control period.
        samples: Samples per period.
        walls: Walls that the tip can touch.
        tip_P_m: (3,) centre of the ball that touches them, in P.
        tip_radius_m: Radius of the ball.
        wrench: Used instead of walls: (stamps (n,), positions (n, 3), quaternions (n, 4) of P in B) -> (n, 6) in S.
        grip_width_m: Width of a rigid object between the jaws, or None.
        frame_rate_Hz: Rate of the flat depth maps while they are requested.

    Attributes:
        cycles: Control periods so far.
        peak_force_N: Largest norm of the untared contact force so far.
        commands: Every accepted command.
    """

    def __init__(
        self,
        description: RobotDescription = FAKE_ARM,
        limits: Limits | None = None,
        *,
        period_s: float = 0.01,
        samples: int = 10,
        walls: Sequence[SpringWall] = (),
        tip_P_m: npt.ArrayLike = (0.0, 0.0, 0.13),
        tip_radius_m: float = 0.006,
        wrench: WrenchFunction | None = None,
        grip_width_m: float | None = None,
        frame_rate_Hz: float = 60.0,
    ) -> None:
        self.description, self.period_s = replace(description, wrist_feels_inertia=False), period_s
        self.limits = Limits() if limits is None else limits
        self.walls, self.wrench, self.grip_width_m = tuple(walls), wrench, grip_width_m
        self._tip_P = frozen_array("tip_P_m", tip_P_m, (3,))
        self._tip_radius = tip_radius_m
        self._hard = np.array([self.limits.hard_force_N, self.limits.hard_torque_Nm])
        self.cycles = 0
        self.peak_force_N = 0.0
        self.commands: list[Command] = []
        self._share = np.arange(1, samples + 1) / samples
        self._frame_s = 1.0 / frame_rate_Hz
        self._next_frame_s = 0.0
        self._q = np.array(description.home_q)
        self._pose = forward(description, self._q)
        self._aperture = description.gripper.stroke_m
        self._target = GripperTarget(self._aperture, description.gripper.speed_m_s, 10.0)
        self._bias = np.zeros(6)
        self._tare: tuple[PendingTicket, int, list[Array]] | None = None
        self._stop: SafetyStop | None = None
        self._lower = np.array([j.lower_rad for j in description.joints])
        self._upper = np.array([j.upper_rad for j in description.joints])
        self._newest = self._block(-period_s, self._q, self._pose, self._grip(), None)

    def observe(self) -> Observation:
        """See `Robot`."""
        return self._newest

    def cycle(self, command: Command) -> Observation:
        """See `Robot`."""
        if self._stop is not None:
            raise SafetyStop(self._stop.quantity, self._stop.value, self._stop.limit, self._stop.stamp_s)
        q, pose = self._q, self._pose
        if command.motion is not None:
            q, pose = command.motion.q, command.motion.pose_B_P
            self._check(q)
        if command.gripper is not None:
            self._target = command.gripper
        begin = self.cycles * self.period_s
        self.cycles += 1
        self.commands.append(command)
        state = self._grip()
        frame = self._frame() if command.tactile else None
        self._newest = self._block(begin, q, pose, state, frame)
        self._q, self._pose = q, pose
        self._take_tare()
        self._enforce()
        return self._newest

    def start(self, request: Request) -> PendingTicket:
        """Start a tare, which takes its duration, or a payload, which takes no time."""
        if isinstance(request, SetPayload):
            return PendingTicket(done=True)
        ticket = PendingTicket()
        self._tare = (ticket, round(request.duration_s / self.period_s), [])
        return ticket

    def hold(self) -> None:
        """See `Robot`; the arm rests whenever no motion is commanded."""

    def close(self) -> None:
        """See `Robot`; there is nothing to release."""

    def _check(self, q: Array) -> None:
        if q.shape != self._lower.shape or not np.isfinite(q).all():
            raise ParamError("command.motion.q", q.tolist(), f"{len(self._lower)} finite numbers")
        out = (q < self._lower - 1e-9) | (q > self._upper + 1e-9)
        if out.any():
            i = int(out.argmax())
            joint = self.description.joints[i]
            valid = f"within {joint.lower_rad}..{joint.upper_rad} rad"
            raise ParamError(f"command.motion.q[{joint.name}]", float(q[i]), valid)

    def _grip(self) -> GripperState:
        """Move the jaws for one period and return their report."""
        step = self._target.speed_m_s * self.period_s
        goal, now = self._target.aperture_m, self._aperture
        stop = 0.0 if self.grip_width_m is None or self.grip_width_m > now + 1e-12 else self.grip_width_m
        new = max(now - step, goal, stop) if goal < now else min(now + step, goal, self.description.gripper.stroke_m)
        gripping = goal < stop and new <= stop
        self._aperture = new
        force = self._target.force_N if gripping else 0.0
        return GripperState(self.cycles * self.period_s, new, force, abs(new - now) > 1e-12)

    def _frame(self) -> TactileFrame | None:
        now = self.cycles * self.period_s
        if now < self._next_frame_s - 1e-9:
            return None
        # The next instant of a fixed frame clock.
        self._next_frame_s = (np.floor(now / self._frame_s + 1e-6) + 1.0) * self._frame_s
        flat = np.zeros(self.description.gripper.pad_shape)
        return TactileFrame(now, flat, flat.copy())

    def _block(
        self, begin_s: float, q: Array, pose: Pose, state: GripperState, frame: TactileFrame | None
    ) -> Observation:
        before, share = self._pose, self._share
        stamp = begin_s + share * self.period_s
        position = _between(before.position_m, pose.position_m, share)
        quat = _turned_by(before.quat, pose.quat, share)
        joints = _between(self._q, q, share)
        speed = np.repeat(((q - self._q) / self.period_s)[None], len(share), axis=0)
        raw = self._felt(stamp, position, quat) if self.wrench is None else self.wrench(stamp, position, quat)
        self._raw = raw
        self.peak_force_N = max(self.peak_force_N, float(_norms(raw)[:, 0].max()))
        return Observation(stamp, joints, speed, position, quat, raw - self._bias, state, frame)

    def _felt(self, stamp: Array, position: Array, quat: Array) -> Array:
        """Return the wrench (n, 6) of the walls on the tip, in S about S's origin."""
        out = np.zeros((len(stamp), 6))
        if not self.walls:
            return out
        E_P = self.description.gripper.pose_E_P
        balls = position + _turned(quat, np.broadcast_to(self._tip_P, position.shape))
        force_B = sum((wall.force_B_N(balls, self._tip_radius) for wall in self.walls), np.zeros_like(position))
        out[:, :3] = _turned(quat * [1.0, -1.0, -1.0, -1.0], force_B) @ E_P.rotation.T
        out[:, 3:] = cross(E_P.apply(self._tip_P), out[:, :3])
        return out

    def _take_tare(self) -> None:
        if self._tare is None:
            return
        ticket, periods, blocks = self._tare
        blocks.append(self._raw)
        if len(blocks) >= periods:
            ticket.done = True
            self._bias = np.concatenate(blocks).mean(axis=0)
            self._tare = None

    def _enforce(self) -> None:
        norms = _norms(self._newest.wrench_S)
        over = norms > self._hard
        if over.any():
            j = int(over.any(axis=0).argmax())
            i = int(over[:, j].argmax())
            name, limit = ("force_N", "torque_Nm")[j], float(self._hard[j])
            self._stop = SafetyStop(name, float(norms[i, j]), limit, float(self._newest.stamp_s[i]))
            raise self._stop


class FakeBackend(Backend):
    """Entry point `fake`: an empty world and an arm that follows exactly. Conditions have no effect."""

    name = "fake"
    summary = "no physics: follows every setpoint exactly and touches nothing (for trying missions and for tests)"

    def open(self, world: World, conditions: Conditions, seed: int, options: Mapping[str, object]) -> FakeRobot:
        """Return a new robot at home.

        Raises:
            BadInput: An option was given; it has none.
        """
        if options:
            raise BadInput(f"the fake backend has no options (given: {', '.join(sorted(options))})")
        return FakeRobot()
