"""Pauses with real contact: forces stay bounded and do not creep, and the mission ends as it would have."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from typing import Any, ClassVar

import numpy as np
import pytest

from glotouch_backends.mujoco import MujocoBackend
from glotouch_bt.mission.execution.control import Control
from glotouch_bt.mission.execution.runner import Outcome, run_mission
from glotouch_bt.mission.read.worlds import load_conditions, load_world
from glotouch_bt.mission.record.run_summary import NullRecord
from glotouch_bt.robot import Array, Command, Observation, Pose
from glotouch_bt.robot.simulation.referee import Referee
from glotouch_bt.skill import Skill, SkillRun
from glotouch_bt.validation.pause import EveryNthTick
from glotouch_skills.common.hand.compliant_close import close_compliantly
from glotouch_skills.common.probe.free_corner import corner_place, corners

PAUSE_S = 20.0
OPEN_M = 0.08


class Sensed(NullRecord):
    """Everything sensed, and where a pause was."""

    def __init__(self) -> None:
        self.blocks: list[Observation] = []
        self.events: list[tuple[str, float, Any]] = []

    def block(self, observation: Observation, command: Command) -> None:
        self.blocks.append(observation)

    def event(self, kind: str, stamp_s: float, data: Any) -> None:
        self.events.append((kind, stamp_s, data))

    def paused(self) -> list[Observation]:
        """While the arm stood."""
        begin = next(t for k, t, _ in self.events if k == "paused")
        end = next(t for k, t, _ in self.events if k == "resumed")
        return [b for b in self.blocks if begin < b.now_s <= end]


class WhenTold(Control):
    """Pauses once the skill says so, for `PAUSE_S`."""

    def __init__(self) -> None:
        super().__init__()
        self.now = False
        self._until_s: float | None = None

    def wants_pause(self, ticks: int, now_s: float) -> bool:
        if self.now and self._until_s is None:
            self._until_s = now_s + PAUSE_S
        return self._until_s is not None and now_s < self._until_s


class Told(Skill):
    """Knows a test's control and where the object really is."""

    control: ClassVar[WhenTold]
    object_B_m: ClassVar[Array]
    moment: ClassVar[str] = ""

    def say(self, moment: str) -> None:
        if moment == self.moment:
            self.control.now = True


class Presses(Told):
    """Touches the floor of a free corner with the closed fingers, stays a while, leaves."""

    def run(self) -> SkillRun:
        arm, world = self.context.arm, self.context.world
        yield from arm.jaws(0.0)
        tip = arm.description.gripper.fingertip_below_P_m
        over = world.container.pose_B_K.apply([*corner_place(world, corners(world)[0], 0.03), tip + 0.03])
        yield from arm.transit(Pose.pointing_down(over, arm.pose_B_P.yaw_rad), arm.pose_B_P.position_m[2], 0.2)
        rest = np.concatenate([b.wrench_S for b in (yield from arm.hold(0.2))]).mean(axis=0)

        def touched(seen: Observation) -> str | None:
            if seen.position_B_P[-1, 2] < over[2] - 0.01:
                self.say("on the way")
            return "touch" if abs((seen.wrench_S - rest)[:, 2].mean()) > 1.0 else None

        result = yield from arm.shift((0.0, 0.0, -0.04), 0.02, guard=touched, check=False)
        assert result.stop == "touch"
        self.say("touching")
        yield from arm.hold(0.3)
        yield from arm.shift((0.0, 0.0, 0.05), 0.1, check=False)


class Squeezes(Told):
    """Closes on the object where it really is, holds it, lets go."""

    def run(self) -> SkillRun:
        arm = self.context.arm
        yield from arm.jaws(OPEN_M)
        x, y, z = self.object_B_m
        yaw = arm.pose_B_P.yaw_rad
        yield from arm.transit(Pose.pointing_down((x, y, z + 0.1), yaw), arm.pose_B_P.position_m[2], 0.2, check=False)
        yield from arm.line(Pose.pointing_down((x, y, z), yaw), 0.05, check=False)
        self.say("closing")
        yield from close_compliantly(arm, 0.03, 10.0, on_observation=self.seen)
        self.say("closed")
        yield from arm.hold(0.3)
        yield from arm.jaws(OPEN_M)

    def seen(self, seen: Observation) -> None:
        if seen.gripper.force_N > 1.0:
            self.say("first touch")


@pytest.fixture
def run(load: Callable[..., Any], registry: dict[str, type[Skill]]) -> Iterator[Callable[..., Any]]:
    registry.update(presses=Presses, squeezes=Squeezes)
    opened = []

    def go(tree: str, moment: str, conditions: str = "nominal") -> tuple[Outcome, Sensed, Referee]:
        world = load_world("container_five")
        world = dataclasses.replace(world, objects=dataclasses.replace(world.objects, names=("apple",)))
        backend = MujocoBackend()
        robot = backend.open(world, load_conditions(conditions), 3, {})
        opened.append(robot)
        referee = backend.referee(robot)
        assert referee is not None
        Told.control, Told.moment = WhenTold(), moment
        outline = referee.objects()[0].outline_B_m
        floor = float(world.container.pose_B_K.position_m[2])
        Told.object_B_m = np.array([*(0.5 * (outline.min(axis=0) + outline.max(axis=0))), floor + 0.03])
        mission = dataclasses.replace(load(tree), world=world)
        record = Sensed()
        return run_mission(mission, robot, record, control=Told.control), record, referee

    yield go
    for robot in opened:
        robot.close()
    for name in ("presses", "squeezes"):
        registry.pop(name)


def by_second(blocks: list[Observation], what: Callable[[Observation], float]) -> Array:
    """(n,) means of whole seconds."""
    values = np.array([what(b) for b in blocks])
    whole = len(values) // 100
    return values[: 100 * whole].reshape(whole, 100).mean(axis=1)


def force_N(seen: Observation) -> float:
    return float(np.linalg.norm(seen.wrench_S[:, :3].mean(axis=0)))


@pytest.mark.parametrize(
    ("style", "moment"), [("hold", "touching"), ("retreat", "touching"), ("retreat", "on the way")]
)
def test_a_touch_is_held_for_twenty_seconds(run: Any, monkeypatch: pytest.MonkeyPatch, style: str, moment: str) -> None:
    monkeypatch.setattr(Presses, "PAUSE", style)
    outcome, record, referee = run("  - presses\n", moment)
    assert outcome.status == "success", outcome.reasons
    assert outcome.guards == {}
    still = record.paused()
    assert len(still) > 1900
    each = by_second(still, lambda b: float(b.wrench_S[:, 2].mean()))
    assert np.ptp(each) < 0.15, "the force creeps"  # the sensor's own drift over 20 s: sd 0.02 N
    places = np.array([b.position_B_P[-1] for b in still])
    assert np.ptp(places, axis=0).max() < 1e-4, "the arm creeps"
    assert referee.peak_force_N() < 30.0
    where = next(d["where"] for k, _, d in record.events if k == "paused")
    assert where == {"hold touching": "at rest", "retreat touching": "backed off"}.get(
        f"{style} {moment}", "on the way"
    )
    pressed = float(np.abs(each.mean() - record.blocks[0].wrench_S[:, 2].mean()))
    assert (pressed > 0.5) == (style == "hold"), f"{pressed:.2f} N"


@pytest.mark.parametrize("moment", ["closing", "first touch", "closed"])
def test_a_squeeze_is_held_for_twenty_seconds(run: Any, moment: str) -> None:
    outcome, record, referee = run("  - squeezes\n", moment)
    assert outcome.status == "success", outcome.reasons
    assert outcome.guards == {}
    still = record.paused()
    assert len(still) > 1800
    jaw = by_second(still, lambda b: b.gripper.force_N)
    assert jaw.min() > 9.0, "the closure was finished before"
    assert jaw.max() < 10.5
    assert np.ptp(jaw[1:]) < 0.2, "the jaws' force creeps"
    # simulated friction creeps a little, and settles: 0.3 N of the object's weight and of the jaws' slant
    assert np.ptp(by_second(still, force_N)[1:]) < 0.5, "the force on the hand creeps"
    assert referee.peak_force_N() < 30.0


def test_a_pick_paused_at_every_50th_tick_ends_with_the_same_object(run: Any, load: Any) -> None:
    """A mission of shipped skills."""
    held = []
    for first in (None, 50):
        outcome, _, referee = pick(load, None if first is None else EveryNthTick(first, 0.4))
        assert outcome.status == "success", outcome.reasons
        assert outcome.guards == {}
        held.append([o.name for o in referee.objects() if o.in_gripper])
        assert referee.peak_force_N() < 30.0
    assert held == [["apple"]] * 2


def pick(load: Any, control: Control | None) -> tuple[Outcome, Sensed, Referee]:
    from glotouch_bt.mission.load import load_mission

    world = load_world("container_five")
    world = dataclasses.replace(world, objects=dataclasses.replace(world.objects, names=("apple",)))
    backend = MujocoBackend()
    robot = backend.open(world, load_conditions("nominal"), 3, {})
    referee = backend.referee(robot)
    assert referee is not None
    outline = referee.objects()[0].outline_B_m
    place = world.container.pose_B_K.inverse().apply([*(0.5 * (outline.min(axis=0) + outline.max(axis=0))), 0.0])
    settings = {"x": f"{1e3 * place[0]:.1f}", "y": f"{1e3 * place[1]:.1f}", "z": "30", "width": "60", "opening": "84"}
    mission = dataclasses.replace(load_mission("pick_at", settings), world=world)
    record = Sensed()
    outcome = run_mission(mission, robot, record, control=control)
    robot.close()
    return outcome, record, referee
