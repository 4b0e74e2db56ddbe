"""The tick loop: one tick a control period, on the robot's clock. Whatever happens, the arm ends holding."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from glotouch_bt.mission.checkpoint import CheckpointHooks, CheckpointWriter, ResumePoint, RunState, WorldChanged
from glotouch_bt.mission.execution.abort_reason import why_aborted
from glotouch_bt.mission.execution.control import Control, Preempted
from glotouch_bt.mission.execution.pause_gate import PauseGate
from glotouch_bt.mission.execution.safe_stop import end_high
from glotouch_bt.mission.execution.watchdog import STUCK_S, SkillHung, Stuck, Watchdog, deferred_interrupt
from glotouch_bt.mission.load import Mission
from glotouch_bt.mission.record import Record, RecordedRequests, Rounding, RunSummary
from glotouch_bt.mission.tree import BuiltTree, Failure, ReasonBook, build_tree, sensed
from glotouch_bt.robot import HOLD, Command, GuardTripped, Observation, Robot, World
from glotouch_bt.robot.supervision import GuardFinding, SupervisionLimits, Supervisor
from glotouch_bt.skill import Context, Reason, Skill

if TYPE_CHECKING:
    from glotouch_bt.motion import Arm

PROGRESS_EVERY_S = 0.5
ROUNDING_S = 1e-6
"""Stamps are rounded to less than this."""


@dataclass
class Outcome:
    """How a mission ended.

    Attributes:
        status: success, failure (the tree failed, or time ran out), aborted (stopped from outside or by a fault).
        chain: Why it did not succeed, root cause last.
        error: What was raised, if it was aborted.
        start_s, end_s: Robot clock at the first and the last tick.
        ticks: Ticks done.
        paused_s: Robot time in which it was paused.
        guards: How often each guard of the supervision found something.
        ending: What was done after a stop was asked for, in words.
        found: Counts and decisions.
    """

    status: Literal["success", "failure", "aborted"]
    found: RunSummary
    chain: list[Failure] = field(default_factory=list)
    error: BaseException | None = None
    start_s: float = 0.0
    end_s: float = 0.0
    ticks: int = 0
    paused_s: float = 0.0
    guards: dict[str, int] = field(default_factory=dict)
    ending: str = ""

    @property
    def reasons(self) -> list[str]:
        """The chain in words."""
        return [str(f) for f in self.chain]

    def abort(self, error: BaseException, node: str) -> None:
        """It ended by what was raised at a node."""
        self.status, self.error, self.chain = "aborted", error, [why_aborted(error, node)]


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
    on_progress: Callable[[float, RunSummary], None] | None = None,
    timeout_s: float | None = None,
    control: Control | None = None,
    supervision: SupervisionLimits | None = None,
    stuck_s: float = STUCK_S,
    on_lost: Callable[[Stuck, Outcome], None] | None = None,
    checkpoints: CheckpointWriter | None = None,
    resume_point: ResumePoint | None = None,
) -> Outcome:
    """Tick a mission to its end.

    Never raises for what happens while ticking: a guard, a safety stop, a failing backend, a fault in a skill, one that
    hangs, a stop from outside and Ctrl-C all give an `aborted` outcome whose `error` says what it was. The arm is held
    in every case. What goes wrong before the first tick (an arm that cannot be planned for) does raise.

    Args:
        mission: A checked mission.
        robot: An open robot; it is supervised (`robot.supervision`) from the first cycle on.
        record: Where everything sensed, commanded, ticked and decided goes; not closed here.
        make_arm: Makes the motion generators.
        on_progress: Called about twice a second of robot time with (robot time since start, summary).
        timeout_s: Longest duration on the robot's clock, without pauses (default: the mission's).
        control: Who may pause and stop it.
        supervision: What the guards tolerate.
        stuck_s: Longest wall time of one tick and its cycle.
        on_lost: Called, from another thread, when a tick does not come back and cannot be broken off; it should write
            what it can and end the process.
        checkpoints: Writes a checkpoint whenever a skill has ended.
        resume_point: A checkpoint to go on from; where it says so, the robot has been put back to it already.
    """
    summary, device = RunSummary(record), robot
    robot = supervisor = Supervisor(robot, supervision)
    supervisor.on_finding = lambda finding: _note_finding(summary, finding)
    arm = make_arm(robot, mission.world)
    observation = robot.observe()
    rounding = Rounding(observation.q.shape[1])
    observation = rounding(observation)
    arm.sync(observation)
    if resume_point is None or not resume_point.same_world:
        summary.block(observation, HOLD)  # a replay begins where the robot did
    context = Context(
        world=mission.world, arm=arm, requests=robot, journal=summary, observation=observation, command=HOLD
    )
    context.requests = requests = RecordedRequests(robot, summary, lambda: context.observation.now_s)
    tree = build_tree(mission.spec, context, mission.name)
    outcome = Outcome("aborted", summary, start_s=observation.now_s)
    loop = _Loop(tree, context, robot, summary, rounding, on_progress, control or Control(), outcome)
    loop.begin(device, requests, supervisor.counts, CheckpointHooks(checkpoints, resume_point))

    def lost(stuck: Stuck) -> None:
        if on_lost is not None:
            outcome.end_s, outcome.paused_s = context.observation.now_s, context.paused_s
            outcome.abort(stuck.error(), stuck.node)
            on_lost(stuck, outcome)

    watchdog = loop.watchdog = Watchdog(robot, lambda: summary.node or mission.name, stuck_s, lost)
    with deferred_interrupt(watchdog) as interrupted:
        try:
            with watchdog:
                try:
                    loop.run(mission.timeout_s if timeout_s is None else timeout_s, interrupted)
                except Preempted as e:
                    outcome.abort(e, loop.node_of(e))
                    loop.end(interrupted)
        except BaseException as e:  # a skill may raise what is no Exception: SystemExit, a cancelled task, a panic
            interrupted.raising = False
            error = watchdog.stuck.error() if watchdog.stuck is not None else e
            if isinstance(error, GuardTripped):
                supervisor.trip_by(error)
            outcome.abort(error, error.node if isinstance(error, SkillHung) else loop.node_of(e))
            if isinstance(error, SkillHung):
                summary.event("stuck", context.observation.now_s, {"node": error.node, "stack": error.stack})
        finally:
            interrupted.raising = False
            robot.hold()
            outcome.end_s, outcome.paused_s = context.observation.now_s, context.paused_s
            outcome.guards = dict(supervisor.counts)
            interrupted.raising = True  # what a skill does when it is closed may take for ever
            _preempt(tree.root)
            interrupted.raising = False
            summary.settle()
            tree.forget()
    return outcome


def _note_finding(summary: RunSummary, finding: GuardFinding) -> None:
    data = {"guard": finding.guard, "what": finding.what, "value": finding.value, "limit": finding.limit}
    summary.event("guard", finding.stamp_s, {**data, "node": summary.node, "fatal": finding.fatal})


def _preempt(root: Behaviour) -> None:
    """Close what still runs (its `finally` blocks), after the arm holds; a fault in there hides no earlier one."""
    if root.status is Status.RUNNING:
        try:
            root.stop(Status.INVALID)
        except BaseException as e:
            root.feedback_message = f"could not be closed: {e}"


class _Loop:
    def __init__(
        self,
        tree: BuiltTree,
        context: Context,
        robot: Robot,
        summary: RunSummary,
        rounding: Rounding,
        on_progress: Callable[[float, RunSummary], None] | None,
        control: Control,
        outcome: Outcome,
    ) -> None:
        self._rounding, self._control, self._outcome = rounding, control, outcome
        self._gate = PauseGate(control, context, self._cycle, paced=robot.paced)
        self._next_progress_s = outcome.start_s
        self._interrupted: Callable[[], bool] = lambda: False
        self.watchdog: Watchdog | None = None
        self._tree, self._context, self._robot, self._summary = tree, context, robot, summary
        self._on_progress = on_progress
        self._book = ReasonBook()
        self._nodes = list(tree.root.iterate())
        self._status: dict[object, Status] = {n.id: Status.INVALID for n in self._nodes}
        self._written: dict[str, object] = {}
        self._keeping = CheckpointHooks()

    def begin(
        self, device: Robot, requests: RecordedRequests, guards: dict[str, int], keeping: CheckpointHooks
    ) -> None:
        """Take up a checkpoint, or write the first one.

        Raises:
            BadInput: The checkpoint is not of this mission.
        """
        self._keeping, outcome = keeping, self._outcome
        held = (self._tree, self._context, device, self._summary, self._book, requests, self._status, self._written)
        work = RunState(*held, guards=guards, start_s=outcome.start_s)
        keeping.begin(work)
        outcome.start_s, outcome.ticks = work.start_s, work.ticks

    def run(self, timeout_s: float, interrupted: Callable[[], bool]) -> None:
        """Tick until the root has decided; fills the outcome.

        Raises:
            Preempted: A stop was asked for.
        """
        context, root, outcome, gate = self._context, self._tree.root, self._outcome, self._gate
        self._interrupted = interrupted
        if self._keeping.look_first is not None:
            self._look_first(self._keeping.look_first)
        while True:
            self._heed()
            if context.mission_s - outcome.start_s >= timeout_s - ROUNDING_S:
                self._time_out(outcome, timeout_s)
                return
            gate.look(outcome.ticks)
            context.command = HOLD
            self._tick(context.observation.now_s)
            outcome.ticks += 1
            if root.status is not Status.RUNNING:
                self._decide(outcome, root)
                return
            gate.send(context.command, outcome.ticks)

    def _look_first(self, skill: Skill) -> None:
        """A resumed mission looks at its world before it goes on.

        Raises:
            WorldChanged: It is not as it was.
        """
        context = self._context
        self._summary.node = skill.name
        while True:
            context.command = HOLD
            skill.tick_once()
            if skill.status is Status.SUCCESS:
                return
            if skill.status is not Status.RUNNING:
                raise WorldChanged(skill.reason or Reason("world_changed", skill.feedback_message, node=skill.name))
            self._gate.send(context.command, self._outcome.ticks)

    def end(self, interrupted: Callable[[], bool]) -> None:
        """After a stop: close what runs, bring the arm to rest, raise it if it is free."""
        _preempt(self._tree.root)
        self._gate.pause_signal.requested = False
        ending = end_high(self._context)
        try:
            command = next(ending)
            while not interrupted():
                command = ending.send(self._cycle(command, heed=False))
        except StopIteration as end:
            self._outcome.ending = end.value
        except Exception as e:
            self._outcome.ending = f"held where it was: {type(e).__name__}: {e}"
        self._summary.event("ending", self._context.observation.now_s, {"done": self._outcome.ending})

    def _heed(self) -> None:
        """Someone may have asked for an end."""
        if self._interrupted():
            raise KeyboardInterrupt
        if self._control.stopped is not None:
            raise Preempted(self._control.stopped)

    def _cycle(self, command: Command, *, heed: bool = True) -> Observation:
        """One control period."""
        context, now_s = self._context, self._context.observation.now_s
        observation = self._rounding(self._robot.cycle(command))
        context.observation = observation
        self._summary.block(observation, command)
        if self.watchdog is not None:
            self.watchdog.beat()
        if self._on_progress is not None and now_s >= self._next_progress_s:
            self._next_progress_s = now_s + PROGRESS_EVERY_S
            self._on_progress(now_s - self._outcome.start_s, self._summary)
        if heed:
            self._heed()
        return observation

    def running_node(self) -> str:
        """The running leaf, or the root."""
        running = [n for n in self._nodes if n.status is Status.RUNNING and not n.children]
        return self._tree.paths[(running[0] if running else self._tree.root).id]

    def node_of(self, error: BaseException) -> str:
        """The node that raised: the innermost one on the error's traceback; else the running one.

        A node that raises in its first update has no status yet, so that its status cannot tell.
        """
        found: str | None = None
        cause: BaseException | None = error
        while cause is not None:  # a StopIteration in a node becomes the RuntimeError of the generator that ticks it
            step = cause.__traceback__
            while step is not None:
                raising = step.tb_frame.f_locals.get("self")
                if isinstance(raising, Behaviour):
                    found = self._tree.paths.get(raising.id, found)
                step = step.tb_next
            cause = cause.__cause__
        return found or self.running_node()

    def _tick(self, now_s: float) -> None:
        """Tick the tree once and write down what changed. Unchanged RUNNING nodes, nearly all, cost one comparison."""
        changed = False
        status = self._status
        for node in self._tree.root.tick():
            if node.status is Status.RUNNING and status[node.id] is Status.RUNNING:
                continue
            changed = True
            again = self._keeping.hands_up_again(node)
            if node.status is Status.FAILURE:
                self._book.note(node, sensed(self._context.observation))
                if isinstance(node, Skill) and not again:
                    self._summary.event("failure", now_s, self._book.of(node).as_dict())
            if node.status is not Status.RUNNING:
                self._keeping.ended(node, self._outcome.ticks)
        if changed:
            self._keeping.tick_over()
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
                self._summary.node = self._tree.paths[node.id]
                if isinstance(node, Skill):
                    self._gate.begins(node.PAUSE)
        if changes:
            self._summary.tick(now_s, changes)
            self._keeping.began([path for path, _, new in changes if new is Status.RUNNING])
        for key in self._tree.keys:
            value = self._tree.value(key)
            if value is not None and value is not self._written.get(key):
                self._written[key] = value
                self._summary.port(now_s, key, value)

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
