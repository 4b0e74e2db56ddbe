"""The tick loop: one tick a control period, on the robot's clock. Whatever happens, the arm ends holding."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from glotouch_bt.mission.build import BuiltTree, build_tree
from glotouch_bt.mission.journaled import JournaledRequests
from glotouch_bt.mission.load import Mission
from glotouch_bt.mission.reasons import Failure, ReasonBook
from glotouch_bt.mission.resolution import Rounding
from glotouch_bt.mission.tally import Record, Tally
from glotouch_bt.robot import HOLD, BackendError, Robot, World
from skills.base import Context, Reason, Skill

if TYPE_CHECKING:
    from glotouch_bt.motion import Arm

PROGRESS_EVERY_S = 0.5


@dataclass
class Outcome:
    """How a mission ended.

    Attributes:
        status: success, failure (the tree failed, or time ran out), aborted (stopped from outside or by a fault).
        chain: Why it did not succeed, root cause last.
        error: What was raised, if it was aborted.
        start_s, end_s: Robot clock at the first and the last tick.
        ticks: Ticks done.
        found: Counts and decisions.
    """

    status: Literal["success", "failure", "aborted"]
    found: Tally
    chain: list[Failure] = field(default_factory=list)
    error: BaseException | None = None
    start_s: float = 0.0
    end_s: float = 0.0
    ticks: int = 0

    @property
    def reasons(self) -> list[str]:
        """The chain in words."""
        return [str(f) for f in self.chain]


def default_arm(robot: Robot, world: World) -> Arm:
    """The motion room's arm for a robot."""
    from glotouch_bt.motion import Arm

    return Arm(robot.description, robot.limits, world, robot.period_s)


def run_mission(
    mission: Mission,
    robot: Robot,
    record: Record,
    *,
    make_arm: Callable[[Robot, World], Arm] = default_arm,
    on_progress: Callable[[float, Tally], None] | None = None,
    timeout_s: float | None = None,
) -> Outcome:
    """Tick a mission to its end.

    Never raises for what happens while ticking: a safety stop, a failing backend, a fault in a skill and Ctrl-C all
    give an `aborted` outcome whose `error` says what it was. The arm is held in every case. What goes wrong before the
    first tick (an arm that cannot be planned for) does raise.

    Args:
        mission: A checked mission.
        robot: An open robot.
        record: Where everything sensed, commanded, ticked and decided goes; not closed here.
        make_arm: Makes the motion generators.
        on_progress: Called about twice a second of robot time with (robot time since start, tally).
        timeout_s: Longest duration on the robot's clock (default: the mission's).
    """
    tally = Tally(record)
    arm = make_arm(robot, mission.world)
    observation = robot.observe()
    rounding = Rounding(observation.q.shape[1])
    observation = rounding(observation)
    arm.sync(observation)
    tally.block(observation, HOLD)  # a replay begins where the robot did
    context = Context(
        world=mission.world, arm=arm, requests=robot, journal=tally, observation=observation, command=HOLD
    )
    context.requests = JournaledRequests(robot, tally, lambda: context.observation.now_s)
    tree = build_tree(mission.tree, context, mission.name)
    loop = _Loop(tree, context, robot, tally, rounding, on_progress)
    outcome = Outcome("aborted", tally, start_s=observation.now_s)
    try:
        with deferred_interrupt() as interrupted:
            loop.run(outcome, mission.timeout_s if timeout_s is None else timeout_s, interrupted)
    except (Exception, KeyboardInterrupt) as e:
        _abort(outcome, e, loop.node_of(e))
    finally:
        robot.hold()
        outcome.end_s = context.observation.now_s
        _preempt(tree.root)
        tally.settle()
        tree.forget()
    return outcome


def _preempt(root: Behaviour) -> None:
    """Close what still runs (its `finally` blocks), after the arm holds; a fault in there hides no earlier one."""
    if root.status is Status.RUNNING:
        try:
            root.stop(Status.INVALID)
        except Exception as e:
            root.feedback_message = f"could not be closed: {e}"


class _Loop:
    def __init__(
        self,
        tree: BuiltTree,
        context: Context,
        robot: Robot,
        tally: Tally,
        rounding: Rounding,
        on_progress: Callable[[float, Tally], None] | None,
    ) -> None:
        self._rounding = rounding
        self._tree, self._context, self._robot, self._tally = tree, context, robot, tally
        self._on_progress = on_progress
        self._book = ReasonBook()
        self._nodes = list(tree.root.iterate())
        self._status: dict[object, Status] = {n.id: Status.INVALID for n in self._nodes}
        self._written: dict[str, object] = {}

    def run(self, outcome: Outcome, timeout_s: float, interrupted: Callable[[], bool]) -> None:
        """Tick until the root has decided; fills `outcome`."""
        context, robot, tally, root = self._context, self._robot, self._tally, self._tree.root
        start_s = outcome.start_s
        next_progress_s = start_s
        while True:
            now_s = context.observation.now_s
            if interrupted():
                raise KeyboardInterrupt
            if now_s - start_s >= timeout_s:
                self._time_out(outcome, timeout_s)
                return
            context.command = HOLD
            self._tick(now_s)
            outcome.ticks += 1
            if root.status is not Status.RUNNING:
                self._decide(outcome, root)
                return
            context.observation = observation = self._rounding(robot.cycle(context.command))
            tally.block(observation, context.command)
            if self._on_progress is not None and now_s >= next_progress_s:
                next_progress_s = now_s + PROGRESS_EVERY_S
                self._on_progress(now_s - start_s, tally)

    def running_node(self) -> str:
        """The running leaf, or the root."""
        running = [n for n in self._nodes if n.status is Status.RUNNING and not n.children]
        return self._tree.paths[(running[0] if running else self._tree.root).id]

    def node_of(self, error: BaseException) -> str:
        """The node that raised: the innermost one on the error's traceback; else the running one.

        A node that raises in its first update has no status yet, so that its status cannot tell.
        """
        found: str | None = None
        step = error.__traceback__
        while step is not None:
            raising = step.tb_frame.f_locals.get("self")
            if isinstance(raising, Behaviour):
                found = self._tree.paths.get(raising.id, found)
            step = step.tb_next
        return found or self.running_node()

    def _tick(self, now_s: float) -> None:
        """Tick the tree once and write down what changed. Unchanged RUNNING nodes, nearly all, cost one comparison."""
        changed = False
        status = self._status
        for node in self._tree.root.tick():
            if node.status is Status.RUNNING and status[node.id] is Status.RUNNING:
                continue
            changed = True
            if node.status is Status.FAILURE:
                self._book.note(node)
                if isinstance(node, Skill):
                    self._tally.event("failure", now_s, self._book.of(node).as_dict())
        if changed:
            self._record_changes(now_s)

    def _record_changes(self, now_s: float) -> None:
        changes: list[tuple[str, object, object]] = []
        for node in self._nodes:
            old, new = self._status[node.id], node.status
            if new is old:
                continue
            changes.append((self._tree.paths[node.id], old, new))
            self._status[node.id] = new
            if new is Status.RUNNING and not node.children:
                self._tally.node = self._tree.paths[node.id]
        if changes:
            self._tally.tick(now_s, changes)
        for key in self._tree.keys:
            value = self._tree.value(key)
            if value is not None and value is not self._written.get(key):
                self._written[key] = value
                self._tally.port(now_s, key, value)

    def _decide(self, outcome: Outcome, root: Behaviour) -> None:
        if root.status is Status.SUCCESS:
            outcome.status = "success"
            return
        outcome.status, outcome.chain = "failure", self._book.of(root).chain()

    def _time_out(self, outcome: Outcome, timeout_s: float) -> None:
        node = self.running_node()
        reason = Reason("mission_timeout", f"the mission took longer than {timeout_s:g} s", node=node)
        text = f"was running when the mission's {timeout_s:g} s were over"
        outcome.status, outcome.chain = "failure", [Failure(node, text, reason)]


def _abort(outcome: Outcome, error: BaseException, node: str) -> None:
    outcome.status, outcome.error = "aborted", error
    if isinstance(error, KeyboardInterrupt):
        code, text = "interrupted", "stopped by the operator"
    elif isinstance(error, BackendError):
        code, text = _snake(type(error).__name__), str(error)
    else:
        code, text = "fault", f"{type(error).__name__}: {error}"
    outcome.chain = [Failure(node, text, Reason(code, text, node=node))]


def _snake(name: str) -> str:
    return "".join(f"_{c.lower()}" if c.isupper() and i else c.lower() for i, c in enumerate(name))


@contextmanager
def deferred_interrupt() -> Iterator[Callable[[], bool]]:
    """Ctrl-C sets a flag, so that it takes effect between two cycles; a second Ctrl-C raises at once."""
    pressed: list[bool] = []
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return

    def handler(number: int, frame: object) -> None:
        if pressed:
            raise KeyboardInterrupt
        pressed.append(True)

    before = signal.signal(signal.SIGINT, handler)
    try:
        yield lambda: bool(pressed)
    finally:
        signal.signal(signal.SIGINT, before)
