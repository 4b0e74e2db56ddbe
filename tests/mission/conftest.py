"""Scripted skills and a scripted robot: the executive is tested without an arm, a solver or a simulator."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from glotouch_bt.mission.load import Mission, load_mission
from glotouch_bt.mission.nodes import NODES, register
from glotouch_bt.mission.tree.build import BuiltTree, build_tree
from glotouch_bt.robot import HOLD, Array, GripperState, Limits, Observation
from glotouch_bt.robot.fake import FAKE_ARM
from glotouch_bt.skill import Context, In, Out, Skill, SkillFailed, SkillParams, SkillRun, param
from tests.mission.nodes.quorum import QuorumKind


class Item:
    """What the fake finder finds."""


class FindParams(SkillParams):
    how_many: int = param("how many to find", default=3, ge=0, le=9)
    speed_m_s: float = param("speed", unit="m/s", default=0.1, gt=0.0, le=0.25)
    mode: str = param("how", default="fast")


class Find(Skill):
    """Write `how_many` items."""

    Params = FindParams
    params: FindParams
    items = Out(tuple, "what was found", element=Item)
    found = Out(int, "how many")
    complete = Out(bool, "all found")

    def run(self) -> SkillRun:
        yield HOLD
        self.items = tuple(Item() for _ in range(self.params.how_many))
        self.found = self.params.how_many
        self.complete = True
        self.event("candidate", candidate={"index": 0})


class UseParams(SkillParams):
    force_N: float = param("force", unit="N", gt=0.0, le=60.0)


class Use(Skill):
    """Take an item, give a mark."""

    Params = UseParams
    params: UseParams
    item = In(Item, "what to use")
    mark = Out(float, "its mark")

    def run(self) -> SkillRun:
        yield HOLD
        assert self.item is not None
        self.mark = self.params.force_N


class Judge(Skill):
    """Read all marks."""

    marks = In(tuple, "marks, one an item")
    best = Out(float, "the largest")

    def run(self) -> SkillRun:
        yield HOLD
        self.best = max(self.marks)


class Number(Skill):
    """Read a number (the wrong type for a mark's tuple)."""

    number = In(int, "a number", key="found")

    def run(self) -> SkillRun:
        yield HOLD


@dataclasses.dataclass(frozen=True)
class Spot:
    position_K_m: Array
    yaw_rad: float
    count: int = 1


class GoTo(Skill):
    """Go to a spot."""

    spot = In(Spot, "where")
    seen = Out(Spot, "where it was")

    def run(self) -> SkillRun:
        yield HOLD
        self.seen = self.spot


class DoParams(SkillParams):
    script: str = param("S success, F failure, R one more period, X raise; one letter a tick", default="S")
    code: str = param("failure code", default="scripted")


class Do(Skill):
    """Play a script, one run after the other; a letter that ends a run leaves the rest for the next."""

    Params = DoParams
    params: DoParams
    log: ClassVar[list[str]] = []

    def initialise(self) -> None:
        self._left = getattr(self, "_left", "") or self.params.script
        super().initialise()

    def run(self) -> SkillRun:
        try:
            while True:
                letter, self._left = self._left[:1] or "S", self._left[1:]
                self.log.append(f"{self.name}{letter}")
                if letter == "S":
                    return
                if letter == "F":
                    raise SkillFailed(
                        self.params.code, f"{self.name} was told to fail", advice="change the script", n=1
                    )
                if letter == "X":
                    raise ZeroDivisionError("scripted")
                yield HOLD
        except GeneratorExit:
            self.log.append(f"{self.name}!")
            raise


REGISTRY: dict[str, type[Skill]] = {
    "find": Find,
    "use": Use,
    "judge": Judge,
    "number": Number,
    "act": Do,
    "go_to": GoTo,
}


class NoArm:
    not_run: list[str] = []  # noqa: RUF012

    def sync(self, observation: Observation) -> None:
        pass


class ClockRobot:
    """A robot that does nothing but let 10 ms pass; raises what it is told at a given time."""

    period_s = 0.01

    def __init__(self) -> None:
        self.now_s = 0.0
        self.held = 0
        self.fail_at: tuple[float, BaseException] | None = None
        self.description, self.limits, self.paced = FAKE_ARM, Limits(), False

    def observe(self) -> Observation:
        stamps = self.now_s + 0.001 * np.arange(-9, 1)
        rest = {"q": np.zeros((10, 7)), "dq": np.zeros((10, 7)), "position_B_P": np.zeros((10, 3))}
        quat = np.tile([1.0, 0.0, 0.0, 0.0], (10, 1))
        jaws = GripperState(self.now_s, 0.05, 0.0, False)
        return Observation(stamp_s=stamps, quat_B_P=quat, wrench_S=np.ones((10, 6)), gripper=jaws, **rest)

    def cycle(self, command: object) -> Observation:
        if self.fail_at and self.now_s >= self.fail_at[0]:
            raise self.fail_at[1]
        self.now_s = round(self.now_s + self.period_s, 6)
        return self.observe()

    def start(self, request: object) -> Any:
        raise NotImplementedError

    def hold(self) -> None:
        self.held += 1


@pytest.fixture
def registry() -> dict[str, type[Skill]]:
    return REGISTRY


@pytest.fixture(scope="module")
def quorum() -> Iterator[None]:
    """A decorator of the tests' own, registered while a module runs."""
    register(QuorumKind())
    yield
    del NODES["quorum"]


@pytest.fixture
def log() -> Iterator[list[str]]:
    Do.log.clear()
    yield Do.log
    Do.log.clear()


@pytest.fixture
def robot() -> ClockRobot:
    return ClockRobot()


@pytest.fixture
def no_arm() -> Callable[..., Any]:
    return lambda robot, world: NoArm()


HEAD = "mission: m\nworld: container_five\n"


@pytest.fixture
def load(tmp_path: Path) -> Callable[..., Mission]:
    """Load a mission from its tree (or from a whole text that begins with `mission:`)."""

    def make(text: str, **settings: Any) -> Mission:
        path = tmp_path / "m.yaml"
        path.write_text(text if text.startswith("mission:") else HEAD + "tree:\n" + text)
        return load_mission(path, settings, skills=REGISTRY)

    return make


@pytest.fixture
def built(load: Callable[..., Mission], robot: ClockRobot) -> Callable[[str], tuple[BuiltTree, Context]]:
    """A tree with its context, to be ticked by hand."""

    def make(text: str) -> tuple[BuiltTree, Context]:
        mission = load(text)
        context = Context(mission.world, NoArm(), robot, _Journal(), robot.observe())  # type: ignore[arg-type]
        return build_tree(mission.spec, context, mission.name), context

    return make


class _Journal:
    def event(self, kind: str, stamp_s: float, data: object) -> None:
        pass
