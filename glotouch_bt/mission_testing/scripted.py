"""Run a mission with scripted leaves: the real tree and runner on a robot without physics, in milliseconds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal, cast

from glotouch_bt.faults import ListeningRecord, injector_in
from glotouch_bt.mission import Mission
from glotouch_bt.mission.execution import default_arm, run_mission
from glotouch_bt.mission.record import NullRecord, Record
from glotouch_bt.mission.spec import NodeSpec
from glotouch_bt.mission.tree import NodeFailure
from glotouch_bt.mission_testing import casting
from glotouch_bt.mission_testing.call import Call
from glotouch_bt.mission_testing.casting import ScriptError
from glotouch_bt.mission_testing.leaf import STAGE, Part, Stage, playing
from glotouch_bt.mission_testing.outcomes import Script
from glotouch_bt.mission_testing.skipping import PATIENT, SkippingRobot, may_skip
from glotouch_bt.robot import Command, FakeRobot, GlotouchError, Observation, Robot

if TYPE_CHECKING:
    from glotouch_bt.motion import Arm

MAX_TICKS = 20_000


class RunsAway(GlotouchError):
    """A scripted mission did not end."""


class ScriptedRun:
    """Result of a scripted mission.

    Attributes:
        mission: The mission's name.
        status: success, failure or aborted (a leaf raised).
        calls: Every call of a leaf, in order of start.
        chain: Reasons of failure, root cause last.
        error: Exception that aborted it, or None.
        ticks: Number of ticks.
        duration_s: Robot time.
        keys: Last value of each key that was written.
    """

    def __init__(self, mission: str, leaves: Mapping[str, NodeSpec], heard: _Heard, stage: Stage, outcome: Any) -> None:
        self.mission = mission
        self.status: Literal["success", "failure", "aborted"] = outcome.status
        self.calls: tuple[Call, ...] = tuple(stage.calls)
        self.chain: tuple[NodeFailure, ...] = tuple(outcome.chain)
        self.error: BaseException | None = outcome.error
        self.ticks: int = outcome.ticks
        self.duration_s: float = round(outcome.end_s - outcome.start_s, 9)
        self.keys: Mapping[str, Any] = heard.keys
        self._leaves, self._statuses = leaves, heard.statuses

    @property
    def succeeded(self) -> bool:
        """Return True if the mission succeeded."""
        return self.status == "success"

    @property
    def code(self) -> str:
        """Return the code of the root cause: a failure code, `mission_timeout`, `fault` ...; empty if none."""
        reason = self.chain[-1].reason if self.chain else None
        return reason.code if reason else ""

    @property
    def order(self) -> list[str]:
        """Return the names of the called leaves, in order of start."""
        return [c.node for c in self.calls]

    def failed_with(self, code: str, node: str = "*") -> bool:
        """Return True if the mission failed with this root code (at this leaf)."""
        if self.status != "failure" or self.code != code:
            return False
        return node == "*" or self.chain[-1].node in {s.name for s in self._fitting(node).values()}

    def calls_of(self, pattern: str) -> list[Call]:
        """Return the calls of the leaves that a name or pattern matches.

        Raises:
            ScriptError: It matches no leaf of the mission.
        """
        fitting = self._fitting(pattern)
        return [c for c in self.calls if c.path in fitting]

    def ran(self, pattern: str) -> int:
        """Return the number of calls of these leaves."""
        return len(self.calls_of(pattern))

    def never_ran(self, pattern: str) -> bool:
        """Return True if none of these leaves was called."""
        return not self.calls_of(pattern)

    def endings(self, pattern: str) -> list[str]:
        """Return the endings of these leaves' calls: SUCCESS, a failure code, PREEMPTED, RAISED."""
        return [c.code or c.ending for c in self.calls_of(pattern)]

    def before(self, first: str, then: str) -> bool:
        """Return True if both were called, and all calls of the first began before any of the second."""
        order = [id(c) for c in self.calls]
        one, two = ([order.index(id(c)) for c in self.calls_of(p)] for p in (first, then))
        return bool(one) and bool(two) and max(one) < min(two)

    def status_of(self, node: str) -> str:
        """Return the last status of any node by name or path; INVALID if never reached.

        Raises:
            ScriptError: No such node.
        """
        found = [s for p, s in self._statuses.items() if node in (p, p.rsplit("/", 1)[-1])]
        if not found:
            raise ScriptError(f"no node of {self.mission!r} is called {node!r}")
        return found[0]

    def _fitting(self, pattern: str) -> dict[str, NodeSpec]:
        found = casting.fitting(pattern, self._leaves)
        if not found:
            raise ScriptError(f"no leaf of {self.mission!r} is called {pattern!r} "
                              f"(leaves: {', '.join(n.name for n in self._leaves.values())})")  # fmt: skip
        return found

    def __repr__(self) -> str:
        steps = " ".join(c.node + {"SUCCESS": ""}.get(c.ending, f"[{c.code or c.ending}]") for c in self.calls)
        why = "".join(f"\n  {f}" for f in self.chain)
        return f"<{self.mission}: {self.status} after {self.duration_s:g} s: {steps}{why}>"


@dataclass
class _Heard(NullRecord):
    """Record of each node's last status and each key's last value."""

    statuses: dict[str, str]
    max_ticks: int = MAX_TICKS
    keys: dict[str, Any] = field(default_factory=dict)
    blocks: int = 0

    def block(self, observation: Observation, command: Command) -> None:
        self.blocks += 1
        if self.blocks > self.max_ticks:
            raise RunsAway(f"no end after {self.max_ticks} ticks ({observation.now_s:g} s on the robot's clock)")

    def tick(self, stamp_s: float, changes: Sequence[tuple[str, object, object]]) -> None:
        for path, _, new in changes:
            # A composite resets its children to INVALID when it ends.
            if getattr(new, "value", "") != "INVALID":
                self.statuses[path] = str(getattr(new, "value", new))

    def port(self, stamp_s: float, key: str, value: object) -> None:
        self.keys[key] = value


class StillArm:
    """Stand-in for the arm where no leaf moves."""

    not_run: ClassVar[list[str]] = []

    def sync(self, observation: Observation) -> None:
        """Do nothing."""


def run_scripted(
    mission: Mission,
    script: Script | None = None,
    *,
    robot: Robot | None = None,
    timeout_s: float | None = None,
    max_ticks: int = MAX_TICKS,
) -> ScriptedRun:
    """Run a mission with scripted leaves; leaves without a pattern succeed at once. Only a `real()` leaf has an arm.

    Args:
        mission: A checked mission.
        script: Outcomes by node name, skill name, path, or pattern of those.
        robot: An open robot (default: a FakeRobot whose clock skips waiting).
        timeout_s: Longest duration on the robot's clock (default: the mission's).
        max_ticks: Number of ticks after which the mission is aborted with `RunsAway`.

    Raises:
        ScriptError: The script does not fit the mission.
    """
    paths = mission.spec.paths(mission.name)
    parts = casting.cast(mission.spec, mission.name, script or {})
    stage = Stage({paths[path].name: part for path, part in parts.items() if part is not None})
    end_s = mission.timeout_s if timeout_s is None else timeout_s
    if robot is None:
        robot = _robot(mission.spec, end_s, stage, all(p is not None for p in parts.values()))
    stage.begin_s = robot.observe().now_s
    moving = any(p is None for p in parts.values())
    make_arm = default_arm if moving else lambda robot, world: cast("Arm", StillArm())
    guard_limits = PATIENT if isinstance(robot, SkippingRobot) else None
    heard = _Heard(dict.fromkeys(paths, "INVALID"), max_ticks)
    scripted = replace(mission, spec=_played(mission.spec, stage.parts))
    injector = injector_in(robot)
    record: Record = heard if injector is None else ListeningRecord(heard, injector)
    token = STAGE.set(stage)
    try:
        outcome = run_mission(scripted, robot, record, make_arm=make_arm, timeout_s=end_s, guard_limits=guard_limits)
    finally:
        STAGE.reset(token)
    if injector is not None:
        injector.conclude(outcome.status, "", "; ".join(outcome.reasons), outcome.end_s)
    if isinstance(outcome.error, ScriptError | KeyboardInterrupt):
        raise outcome.error
    return ScriptedRun(mission.name, casting.leaves_of(mission.spec, mission.name), heard, stage, outcome)


def _robot(tree: NodeSpec, end_s: float, stage: Stage, still: bool) -> FakeRobot:
    if not still or not may_skip(tree):
        return FakeRobot()
    robot = SkippingRobot(end_s)
    stage.wake = robot.wake
    return robot


def _played(node: NodeSpec, parts: Mapping[str, Part]) -> NodeSpec:
    children = tuple(_played(child, parts) for child in node.children)
    skill: Any = node.skill_type
    if skill is None or node.name not in parts:
        return replace(node, children=children)
    return replace(node, children=children, skill_type=playing(skill))
