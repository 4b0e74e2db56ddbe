"""A bench for skills: the runner's tick without a tree, on a fake robot that brakes and feels what a test says."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from py_trees.blackboard import Blackboard
from py_trees.common import Status

from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.motion import Arm
from glotouch_bt.perception.touch import Candidate, Contact, Contour, Payload, fit_contour
from glotouch_bt.robot import (
    HOLD,
    Array,
    Command,
    Container,
    Holder,
    JointSetpoint,
    ObjectSet,
    Observation,
    Pose,
    Probe,
    Robot,
    World,
    cross_matrix,
    quat_to_matrix,
)
from glotouch_bt.robot.fake import FakeRobot, forward
from glotouch_bt.skill import Context, Skill
from glotouch_bt.skill.probing.held_tool import HeldTool
from tests.support.examples import ALL

BRAKE_RAD_S2 = 2.5
JUMP_RAD_S = 0.3  # a setpoint's velocity may change by this in a period; the hardest stop changes it by 0.05
STIFFNESS_N_M = 3000.0
_spaces = itertools.count()

Thing = Callable[[Array, float], Array]  # (n, 3) ball centres in K, ball radius -> (n, 3) force in K


def floor(top_m: float = 0.0) -> Thing:
    """An elastic floor."""

    def force(ball: Array, radius: float) -> Array:
        out = np.zeros_like(ball)
        out[:, 2] = STIFFNESS_N_M * np.maximum(top_m + radius - ball[:, 2], 0.0)
        return out

    return force


def post(centre_m: tuple[float, float], radius_m: float, top_m: float) -> Thing:
    """An elastic upright cylinder that pushes the ball out the nearest way: sideways, or up."""

    def force(ball: Array, radius: float) -> Array:
        out = np.zeros_like(ball)
        if ball[:, 2].min() - radius >= top_m:
            return out
        offset = ball[:, :2] - centre_m
        away = np.linalg.norm(offset, axis=1)
        side, above = radius_m + radius - away, top_m + radius - ball[:, 2]
        inside = (side > 0) & (above > 0)
        if not inside.any():
            return out
        up = inside & (above < side)
        out[up, 2] = STIFFNESS_N_M * above[up]
        out_of = inside & ~up
        out[out_of, :2] = STIFFNESS_N_M * (side / np.maximum(away, 1e-9))[out_of, None] * offset[out_of]
        return out

    return force


class BenchRobot(FakeRobot):
    """Brakes along its way when it is told to hold, and lets no setpoint jump, as real arms do.

    Args:
        world: Its container and probe.
        things: What the ball (at `tip_P_m`) touches.
        weight_N: Weight in the hand for a position (3,) of P in B and an aperture, m; None for nothing.
        moment_S_Nm: (3,) felt always, of what hangs aside.
    """

    def __init__(
        self,
        world: World,
        things: Sequence[Thing] = (),
        weight_N: Callable[[Array, float], float] | None = None,
        tip_P_m: float = 0.13,
        grip_width_m: float | None = None,
        moment_S_Nm: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> None:
        self.world, self.things, self.weight_N, self.tip_P_m = world, things, weight_N, tip_P_m
        self.pose_K_B, self.tip_P = world.container.pose_B_K.inverse(), np.array([0.0, 0.0, tip_P_m])
        self.rotation_K_B = self.pose_K_B.rotation
        self.moment_S_Nm = np.asarray(moment_S_Nm)
        self.speed_rad_s = np.zeros(7)
        self.velocity_B: Array | None = None
        self.hand = Payload.hand(RIZON4_XENSE.gripper, world.probe)
        self.lever_S = cross_matrix(RIZON4_XENSE.gripper.pose_E_P.apply((0.0, 0.0, tip_P_m)))
        super().__init__(RIZON4_XENSE, wrench=self._all_felt, grip_width_m=grip_width_m)

    def cycle(self, command: Command) -> Observation:
        q, v, dt = self.observe().q[-1], self.speed_rad_s, self.period_s
        if command.motion is not None:
            self.speed_rad_s = (np.asarray(command.motion.q) - q) / dt
            jump = float(np.abs(self.speed_rad_s - v).max())
            assert jump < JUMP_RAD_S, f"the setpoint jumps by {jump:.2f} rad/s in one period"
        elif v.any():
            slower = v * max(0.0, 1.0 - BRAKE_RAD_S2 * dt / float(np.abs(v).max()))
            q = q + 0.5 * dt * (v + slower)
            self.speed_rad_s = slower
            setpoint = JointSetpoint(q, slower, np.zeros(7), forward(self.description, q))
            command = Command(setpoint, command.gripper, command.tactile)
        return super().cycle(command)

    def _all_felt(self, stamp: Array, position: Array, quat: Array) -> Array:
        rotation, wrench = quat_to_matrix(quat[-1]), np.zeros((len(stamp), 6))
        if self.things:
            ball = self.pose_K_B.apply(position + rotation @ self.tip_P)
            force_K = self.things[0](ball, 0.006)
            for thing in self.things[1:]:
                force_K = force_K + thing(ball, 0.006)
            if force_K.any():
                contact = force_K @ (self.rotation_K_B @ rotation)
                wrench[:, :3], wrench[:, 3:] = contact, contact @ self.lever_S.T
        if self.weight_N is not None:
            wrench[:, :3] -= np.array([self.weight_N(p, self._aperture) for p in position])[:, None] * rotation[2]
        wrench[:, 3:] += self.moment_S_Nm
        wrench += self._inertial(position, rotation, float(stamp[-1] - stamp[0]))
        return wrench

    def _inertial(self, position: Array, rotation: Array, span_s: float) -> Array:
        """(6,) what the hand with the probe feels of the change of velocity since the last period."""
        velocity = (position[-1] - position[0]) / span_s
        change = velocity - (velocity if self.velocity_B is None else self.velocity_B)
        self.velocity_B = velocity
        return np.asarray(self.hand.wrench_S(change @ rotation / self.period_s))


class Bench:
    """One skill at a time on one robot, ticked as the runner does."""

    def __init__(self, world: World, robot: Robot) -> None:
        self.world, self.robot = world, robot
        self.arm = Arm(robot.description, robot.limits, world, robot.period_s)
        self.arm.sync(robot.observe())
        self.events: list[tuple[str, Mapping[str, Any]]] = []
        self.context = Context(world, self.arm, robot, self, robot.observe())
        self.commands: list[Command] = []

    @staticmethod
    def on(world: World, robot: Robot) -> Bench:
        """A bench for another robot."""
        return Bench(world, robot)

    def event(self, kind: str, stamp_s: float, data: Mapping[str, object]) -> None:
        self.events.append((kind, data))

    def of_kind(self, kind: str) -> list[Mapping[str, Any]]:
        """Data of the events of one kind."""
        return [d for k, d in self.events if k == kind]

    def make(self, skill: type[Skill], *, inputs: Mapping[str, object] | None = None, **params: object) -> Skill:
        """A skill wired to keys of its own."""
        space = f"/bench{next(_spaces)}"
        made = skill("skill", skill.Params(**params), self.context)
        keys = skill.default_keys()
        made.setup_ports({p: f"{space}/{k}" for p, k in keys.items()})
        for port, value in (inputs or {}).items():
            Blackboard.set(f"{space}/{keys[port]}", value)
        return made

    def tick(self, skill: Skill) -> Status:
        """One tick, and one control period if the skill goes on."""
        self.context.command = HOLD
        skill.tick_once()
        if skill.status is Status.RUNNING:
            self.pass_time(self.context.command)
        return skill.status

    def pass_time(self, command: Command = HOLD) -> None:
        self.commands.append(command)
        self.context.observation = self.robot.cycle(command)

    def run(self, skill: Skill, ticks: int = 30_000) -> int:
        """Tick to the end, or `ticks` times; how many ticks it took."""
        for n in range(ticks):
            if self.tick(skill) is not Status.RUNNING:
                return n + 1
        return ticks

    def go(self, motion: Any) -> Any:
        """Drive one motion generator to its end."""
        try:
            command = next(motion)
            while True:
                self.pass_time(command)
                command = motion.send(self.context.observation)
        except StopIteration as end:
            return end.value

    def preempt(self, skill: Skill) -> None:
        """Break the skill off in mid-tick, as a timeout does, and see that it left everything as it must."""
        scene = self.arm.scene
        self.context.command = HOLD
        skill.tick_once()
        if skill.status is not Status.RUNNING:
            return
        skill.stop(Status.INVALID)
        assert self.context.command is HOLD
        assert not [o for o in scene.obstacles if o.startswith("candidate")]
        assert not scene._allowed
        speed = float(np.abs(self.context.observation.dq[-1]).max())
        before = self.context.observation
        periods = 0
        while periods < 200:
            self.pass_time(self.context.command)
            periods += 1
            if np.abs(self.context.observation.dq).max() < 1e-3:
                break
        assert periods < 200, "the arm does not come to rest"
        # An even deceleration of all joints takes max|dq| / a, in which P goes half as far as at its first speed.
        v = float(np.linalg.norm(before.position_B_P[-1] - before.position_B_P[-2])) / 1e-3
        way = float(np.linalg.norm(self.context.observation.position_B_P[-1] - before.position_B_P[-1]))
        longest = 1.1 * 0.5 * v * speed / BRAKE_RAD_S2 + v * self.robot.period_s + 1e-3
        assert way <= longest, f"stopped after {way * 1e3:.1f} mm from {v:.3f} m/s, {speed:.2f} rad/s"


@pytest.fixture(scope="session")
def things() -> SimpleNamespace:
    """Objects that can stand in the container: `floor(top_m)`, `post(centre_m, radius_m, top_m)`."""
    return SimpleNamespace(floor=floor, post=post)


Make = Callable[[], tuple[Bench, Skill]]


@pytest.fixture(scope="session")
def preempt_all_along() -> Callable[..., None]:
    """Break a skill off at points spread over its run, a fresh bench each; it must be startable again.

    `make test` takes every other point, `make test-studies` all.
    """

    def check(
        make: Make,
        points: int,
        *,
        finish: bool = True,
        after: Callable[[Bench], None] = lambda bench: None,
    ) -> None:
        bench, skill = make()
        total = bench.run(skill)
        assert skill.status is Status.SUCCESS, skill.feedback_message
        moments = np.linspace(1, total - 2, points).astype(int)
        for k in moments if ALL else moments[1::2]:
            bench, skill = make()
            bench.run(skill, int(k))
            bench.preempt(skill)
            after(bench)
            bench.run(skill, 30_000 if finish else 60)
            if finish:
                assert skill.status is Status.SUCCESS, f"broken off at tick {k}: {skill.feedback_message}"

    return check


@pytest.fixture(scope="session")
def world(tmp_path_factory: pytest.TempPathFactory) -> World:
    return World(
        name="bench",
        container=Container(pose_B_K=Pose(np.array([0.6, 0.0, -0.2])), interior_m=(0.30, 0.40, 0.08)),
        probe=Probe(),
        holder=Holder(pose_B_grasp=Pose.pointing_down((0.45, -0.32, -0.06), np.pi)),
        objects=ObjectSet(folder=Path(tmp_path_factory.mktemp("objects"))),
    )


@pytest.fixture
def bench(world: World) -> Iterator[Callable[..., Bench]]:
    """Makes a bench; keywords as of `BenchRobot`."""
    yield lambda **keywords: Bench(world, BenchRobot(world, **keywords))
    Blackboard.clear()


@pytest.fixture
def tool(world: World) -> HeldTool:
    """The probe perfectly grasped, at the yaw of the hand at home."""
    probe = world.probe
    home_yaw = forward(RIZON4_XENSE, np.array(RIZON4_XENSE.home_q)).yaw_rad
    tip = np.array([0.0, 0.0, probe.grasp_to_tip_m])
    return HeldTool(tip, probe.tip_radius_m, probe.handle_m[1], home_yaw)


def traced(index: int, outline_K_m: Array, height_m: float) -> Candidate:
    """A candidate as tracing an outline (n, 2) gives it: the ball met it at each point from outside."""
    middle = outline_K_m.mean(axis=0)
    contacts = []
    for point in outline_K_m:
        out = (point - middle) / np.linalg.norm(point - middle)
        flat = np.array([*out, 0.0])
        contacts.append(Contact(0.0, np.array([*(point + 0.006 * out), 0.018]), -flat, flat, point, 1.0))
    contour = fit_contour(np.array([c.tip_K_m[:2] for c in contacts]), 0.006)
    return Candidate(index, contour, height_m, 1.0, tuple(contacts))


def round_thing(centre_m: tuple[float, float], radius_m: float, height_m: float = 0.06, index: int = 0) -> Candidate:
    a = np.linspace(0.0, 2 * np.pi, 16, endpoint=False)
    return traced(index, np.array(centre_m) + radius_m * np.column_stack([np.cos(a), np.sin(a)]), height_m)


def box_thing(
    centre_m: tuple[float, float],
    size_m: tuple[float, float],
    yaw_rad: float = 0.0,
    height_m: float = 0.06,
    index: int = 0,
) -> Candidate:
    """A box traced face by face (its contour is given, not fitted: contacts on faces push straight outwards)."""
    l, s = 0.5 * size_m[0], 0.5 * size_m[1]
    u = np.linspace(-0.9, 0.9, 5)
    sides = [((u * l, np.full(5, e * s)), (0.0, e)) for e in (1, -1)] + [
        ((np.full(5, e * l), u * s), (e, 0.0)) for e in (1, -1)
    ]
    turn = np.array([[np.cos(yaw_rad), -np.sin(yaw_rad)], [np.sin(yaw_rad), np.cos(yaw_rad)]])
    contacts = []
    for (x, y), out in sides:
        for p in np.column_stack([x, y]):
            point, normal = turn @ p + centre_m, np.array([*(turn @ out), 0.0])
            tip = np.array([*(point + 0.006 * normal[:2]), 0.018])
            contacts.append(Contact(0.0, tip, -normal, normal, point, 1.0))
    contour = Contour("box", np.array(centre_m), size_m, yaw_rad, 0.0, np.zeros(len(contacts)))
    return Candidate(index, contour, height_m, 1.0, tuple(contacts))


@pytest.fixture(scope="session")
def found() -> SimpleNamespace:
    """Candidates as the probe would find them: `round(centre, radius)`, `box(centre, size, yaw)`."""
    return SimpleNamespace(round=round_thing, box=box_thing, traced=traced)
