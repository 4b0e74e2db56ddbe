"""The tick loop: one tick per control period, on the robot clock. However a mission ends, the arm is held."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from glotouch_bt.mission.checkpoint import CheckpointHooks, CheckpointWriter, ResumePoint, RunState, WorldChanged
from glotouch_bt.mission.execution.abort_reason import abort_failure
from glotouch_bt.mission.execution.control import Control, Preempted
from glotouch_bt.mission.execution.pause_gate import PauseGate
from glotouch_bt.mission.execution.safe_stop import stop_safely
from glotouch_bt.mission.execution.watchdog import STUCK_S, SkillHung, Watchdog, deferred_interrupt
from glotouch_bt.mission.load import Mission
from glotouch_bt.mission.record import Record, RecordedRequests, Rounding, RunSummary
from glotouch_bt.mission.tree import NodeFailure, ReasonBook, RunningSkill, build_tree, sensed
from glotouch_bt.robot import HOLD, BackendError, Command, GlotouchError, GuardTripped, Observation, Robot, World
from glotouch_bt.robot.supervision import GuardFinding, SupervisionLimits, Supervisor
from glotouch_bt.skill import Context, Reason, Skill

if TYPE_CHECKING:
    from glotouch_bt.motion import Arm

PROGRESS_EVERY_S = 0.5
"""Robot time between two progress reports."""
ROUNDING_S = 1e-6
"""Upper bound of the rounding error of a stamp."""


@dataclass
class Outcome:
    """Result of a mission.

    Attributes:
        status: success; failure (the tree failed or time ran out); aborted (stopped from outside or by a fault).
        summary: Counts and decisions.
        chain: Why it did not succeed, root cause last.
        error: The error that aborted it.
        start_s, end_s: Robot clock at the first and the last tick.
        ticks: Ticks done.
        paused_s: Robot time in which it was paused.
        guards: Findings of the supervision, by guard.
        safe_stop: What the arm did after a stop was requested, in words.
    """

    status: Literal["success", "failure", "aborted"]
    summary: RunSummary
    chain: list[NodeFailure] = field(default_factory=list)
    error: BaseException | None = None
    start_s: float = 0.0
    end_s: float = 0.0
    ticks: int = 0
    paused_s: float = 0.0
    guards: dict[str, int] = field(default_factory=dict)
    safe_stop: str = ""

    @property
    def reasons(self) -> list[str]:
        """The chain in words."""
        return [str(f) for f in self.chain]

    def abort(self, error: BaseException, node: str) -> None:
        """Set the outcome to aborted by an error raised at a node."""
        self.status, self.error, self.chain = "aborted", error, [abort_failure(error, node)]


def default_arm(robot: Robot, world: World) -> Arm:
    """Return the motion generators for a robot in a world."""
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
    guard_limits: SupervisionLimits | None = None,
    stuck_s: float = STUCK_S,
    on_unresponsive: Callable[[SkillHung, Outcome], None] | None = None,
    checkpoints: CheckpointWriter | None = None,
    resume_point: ResumePoint | None = None,
) -> Outcome:
    """Tick a mission to its end.

    Errors while ticking (a guard, a safety stop, a backend or skill error, a hanging skill, a requested stop, Ctrl-C)
    give an `aborted` outcome with the error in `error`; the arm is held in every case. Errors before the first tick,
    for example an arm that cannot be planned for, are raised.

    Args:
        mission: A checked mission.
        robot: An open robot; supervised (`robot.supervision`) from the first cycle on.
        record: Receives everything sensed, commanded, ticked and decided; not closed here.
        make_arm: Makes the motion generators.
        on_progress: Called about twice a second of robot time with (robot time since start, summary).
        timeout_s: Longest duration on the robot clock, without pauses (default: the mission's).
        control: Source of pause and stop requests.
        guard_limits: Limits of the guards.
        stuck_s: Longest wall time of one tick and its cycle.
        on_unresponsive: Called from another thread when a tick neither returns nor can be interrupted. It should save
            what it can and end the process.
        checkpoints: Writes a checkpoint whenever a skill has ended.
        resume_point: Checkpoint to continue from; with `same_world` the robot has been restored to it already.
    """
    summary = RunSummary(record)
    with _device_errors():
        supervisor = Supervisor(robot, guard_limits)
    supervisor.on_finding = lambda finding: _record_finding(summary, finding)
    arm = make_arm(supervisor, mission.world)
    with _device_errors():
        observation = supervisor.observe()
    rounding = Rounding(observation.q.shape[1])
    observation = rounding(observation)
    arm.sync(observation)
    if resume_point is None or not resume_point.same_world:
        summary.block(observation, HOLD)  # the first block of a replay
    context = Context(
        world=mission.world, arm=arm, requests=supervisor, journal=summary, observation=observation, command=HOLD
    )
    context.requests = requests = RecordedRequests(supervisor, summary, lambda: context.observation.now_s)
    tree = build_tree(mission.spec, context, mission.name)
    outcome = Outcome("aborted", summary, start_s=observation.now_s)
    status = {node.id: Status.INVALID for node in tree.root.iterate()}
    state = RunState(tree, context, robot, summary, ReasonBook(), requests, status, {}, supervisor.counts)
    state.start_s = outcome.start_s
    hooks = CheckpointHooks(checkpoints, resume_point)
    loop = _TickLoop(state, supervisor, rounding, outcome, control or Control(), hooks, on_progress)
    loop.begin()

    def unresponsive(stuck: SkillHung) -> None:
        if on_unresponsive is not None:
            outcome.end_s, outcome.paused_s = context.observation.now_s, context.paused_s
            outcome.abort(stuck, stuck.node)
            on_unresponsive(stuck, outcome)

    watchdog = loop.watchdog = Watchdog(supervisor, lambda: summary.node or mission.name, stuck_s, unresponsive)
    with deferred_interrupt(watchdog) as interrupted:
        try:
            with watchdog:
                try:
                    loop.run(mission.timeout_s if timeout_s is None else timeout_s, interrupted)
                except Preempted as e:
                    outcome.abort(e, loop.node_of(e))
                    loop.stop_safely(interrupted)
        except BaseException as e:  # also SystemExit, a cancelled task, or a panic of compiled code
            interrupted.raising = False
            loop.abort(e)
        finally:
            interrupted.raising = False
            supervisor.hold()
            outcome.end_s, outcome.paused_s = context.observation.now_s, context.paused_s
            outcome.guards = dict(supervisor.counts)
            interrupted.raising = True  # closing a skill may hang
            _close_running(tree.root)
            interrupted.raising = False
            summary.flush()
            tree.forget()
    return outcome


@contextmanager
def _device_errors() -> Iterator[None]:
    """Turn an undocumented error of the device into a `BackendError`; nothing can be aborted before the first tick."""
    try:
        yield
    except GlotouchError:
        raise
    except Exception as e:
        raise BackendError(f"the robot failed before the first tick: {type(e).__name__}: {e}") from e


def _record_finding(summary: RunSummary, finding: GuardFinding) -> None:
    data = {"guard": finding.guard, "what": finding.what, "value": finding.value, "limit": finding.limit}
    summary.event("guard", finding.stamp_s, {**data, "node": summary.node, "fatal": finding.fatal})


def _close_running(root: Behaviour) -> None:
    """Close running nodes (their `finally` blocks) after the arm holds; an error there hides no earlier one."""
    if root.status is Status.RUNNING:
        try:
            root.stop(Status.INVALID)
        except BaseException as e:
            root.feedback_message = f"could not be closed: {e}"


class _TickLoop:
    """Tick the tree, send its commands, and record what changes.

    Attributes:
        watchdog: Told of every completed cycle.
    """

    def __init__(
        self,
        state: RunState,
        supervisor: Supervisor,
        rounding: Rounding,
        outcome: Outcome,
        control: Control,
        hooks: CheckpointHooks,
        on_progress: Callable[[float, RunSummary], None] | None,
    ) -> None:
        self._state, self._tree, self._context, self._summary = state, state.tree, state.context, state.summary
        self._supervisor, self._rounding, self._outcome = supervisor, rounding, outcome
        self._control, self._hooks, self._on_progress = control, hooks, on_progress
        self._gate = PauseGate(control, state.context, self._cycle, paced=supervisor.paced)
        self._next_progress_s = outcome.start_s
        self._interrupted: Callable[[], bool] = lambda: False
        self._nodes = list(state.tree.root.iterate())
        self._running = RunningSkill(state.tree.root)
        self.watchdog: Watchdog | None = None

    def begin(self) -> None:
        """Restore the resume point, or write the first checkpoint.

        Raises:
            BadInput: The checkpoint is of another mission.
        """
        self._hooks.begin(self._state)
        self._outcome.start_s, self._outcome.ticks = self._state.start_s, self._state.ticks

    def run(self, timeout_s: float, interrupted: Callable[[], bool]) -> None:
        """Tick until the root has a result, and fill the outcome.

        Raises:
            Preempted: A stop was requested.
        """
        context, root, outcome, gate = self._context, self._tree.root, self._outcome, self._gate
        self._interrupted = interrupted
        if self._hooks.world_check is not None:
            self._check_world(self._hooks.world_check)
        while True:
            self._raise_if_stopped()
            if context.mission_s - outcome.start_s >= timeout_s - ROUNDING_S:
                self._time_out(timeout_s)
                return
            gate.update(outcome.ticks)
            context.command = HOLD
            self._tick(context.observation.now_s)
            outcome.ticks += 1
            if root.status is Status.SUCCESS:
                outcome.status = "success"
                return
            if root.status is not Status.RUNNING:
                outcome.status, outcome.chain = "failure", self._state.book.of(root).chain()
                return
            gate.send(context.command, outcome.ticks)

    def _check_world(self, skill: Skill) -> None:
        """Run the world check of a resumed mission.

        Raises:
            WorldChanged: The world differs from the checkpoint.
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

    def abort(self, error: BaseException) -> None:
        """Set the outcome to aborted by an error raised inside the loop."""
        stuck = None if self.watchdog is None else self.watchdog.stuck
        cause = stuck or error
        if isinstance(cause, GuardTripped):
            self._supervisor.trip_by(cause)
        self._outcome.abort(cause, cause.node if isinstance(cause, SkillHung) else self.node_of(error))
        if isinstance(cause, SkillHung):
            now_s = self._context.observation.now_s
            self._summary.event("stuck", now_s, {"node": cause.node, "stack": cause.stack})

    def stop_safely(self, interrupted: Callable[[], bool]) -> None:
        """Close the running nodes, bring the arm to rest, and raise it if it is free."""
        _close_running(self._tree.root)
        self._gate.pause_signal.requested = False
        motion = stop_safely(self._context)
        try:
            command = next(motion)
            while not interrupted():
                command = motion.send(self._cycle(command, stoppable=False))
        except StopIteration as end:
            self._outcome.safe_stop = end.value
        except Exception as e:
            self._outcome.safe_stop = f"held where it was: {type(e).__name__}: {e}"
        self._summary.event("ending", self._context.observation.now_s, {"done": self._outcome.safe_stop})

    def _raise_if_stopped(self) -> None:
        if self._interrupted():
            raise KeyboardInterrupt
        if self._control.stopped is not None:
            raise Preempted(self._control.stopped)

    def _cycle(self, command: Command, *, stoppable: bool = True) -> Observation:
        """Do one control period."""
        context, now_s = self._context, self._context.observation.now_s
        observation = self._rounding(self._supervisor.cycle(command))
        context.observation = observation
        self._summary.block(observation, command)
        if self.watchdog is not None:
            self.watchdog.beat()
        if self._on_progress is not None and now_s >= self._next_progress_s:
            self._next_progress_s = now_s + PROGRESS_EVERY_S
            self._on_progress(now_s - self._outcome.start_s, self._summary)
        if stoppable:
            self._raise_if_stopped()
        return observation

    def running_node(self) -> str:
        """Return the path of the running leaf, or of the root."""
        running = [n for n in self._nodes if n.status is Status.RUNNING and not n.children]
        return self._tree.paths[(running[0] if running else self._tree.root).id]

    def node_of(self, error: BaseException) -> str:
        """Return the path of the innermost node on the error's traceback, else of the running node.

        A node that raises in its first update has no status yet, so the status alone is not enough.
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
        """Tick the tree once and record changes."""
        if self._running.keeps_running():
            return
        changed = False
        status, book, hooks = self._state.status, self._state.book, self._hooks
        for node in self._tree.root.tick():
            if node.status is Status.RUNNING and status[node.id] is Status.RUNNING:
                continue
            changed = True
            again = hooks.replays_end(node)
            if node.status is Status.FAILURE:
                book.note(node, sensed(self._context.observation))
                if isinstance(node, Skill) and not again:
                    self._summary.event("failure", now_s, book.of(node).as_dict())
            if node.status is not Status.RUNNING:
                hooks.on_node_ended(node, self._outcome.ticks)
        if changed:
            hooks.on_tick_done()
            self._record_changes(now_s)
            self._running.find()

    def _record_changes(self, now_s: float) -> None:
        changes: list[tuple[str, object, object]] = []
        for node in self._nodes:
            old, new = self._state.status[node.id], node.status
            if new is old:
                continue
            changes.append((self._tree.paths[node.id], old, new))
            self._state.status[node.id] = new
            if new is Status.RUNNING and not node.children:
                self._summary.node = self._tree.paths[node.id]
                self._summary.skill = self._tree.skills.get(node.id, "")
                if isinstance(node, Skill):
                    self._gate.pause_signal.style = node.PAUSE
        if changes:
            self._summary.tick(now_s, changes)
            self._hooks.on_nodes_started([path for path, _, new in changes if new is Status.RUNNING])
        for key in self._tree.keys:
            value = self._tree.value(key)
            if value is not None and value is not self._state.written.get(key):
                self._state.written[key] = value
                self._summary.port(now_s, key, value)

    def _time_out(self, timeout_s: float) -> None:
        node = self.running_node()
        reason = Reason("mission_timeout", f"the mission took longer than {timeout_s:g} s", node=node)
        text = f"was running when the mission's {timeout_s:g} s were over"
        self._outcome.status, self._outcome.chain = "failure", [NodeFailure(node, text, reason)]
