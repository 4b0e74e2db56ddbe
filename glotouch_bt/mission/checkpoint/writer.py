"""Write checkpoints while a mission runs, and restore one in a new run.

A checkpoint holds the tree, the ports, the skills' memory, the arm's setpoint and clearance scene, counts, reasons, the
length of the record, and in simulation the world.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.blackboard import Blackboard
from py_trees.common import Status

from glotouch_bt.mission.checkpoint.codec import NotEncodable, encode, encode_parts
from glotouch_bt.mission.checkpoint.store import CheckpointFile, CheckpointRow
from glotouch_bt.mission.checkpoint.tree_state import RestoredTree, start_at, tree_state
from glotouch_bt.mission.checkpoint.world_check import world_check
from glotouch_bt.mission.record import RecordedRequests, Recorder, RunSummary
from glotouch_bt.mission.tree import BuiltTree, NodeFailure, ReasonBook
from glotouch_bt.robot import BadInput, GlotouchError, Robot
from glotouch_bt.skill import Context, Skill
from glotouch_bt.untrusted import require_type

STATE = {
    "tree": dict[str, Any], "arm": dict[str, Any], "summary": dict[str, Any], "reasons": dict[str, NodeFailure],
    "status": dict[str, str], "elapsed": tuple[float, float], "recorded": tuple[str, ...], "preempted": bool,
    "paused_s": float, "ticks": int, "guards": dict[str, int], "requests": int,
}  # fmt: skip
"""Types of the values of a checkpoint that every run needs."""
UNFIT = (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, AssertionError, RecursionError)
"""Errors that values of a damaged checkpoint can raise."""


@dataclass
class RunState:
    """The state of a running mission, shared by the tick loop and the checkpoints.

    Attributes:
        tree: The built tree.
        context: Context of its skills.
        robot: The device, without supervision.
        summary: Counts and decisions.
        book: Failures noted so far.
        requests: Slow requests to the robot.
        status: Status of each node as last recorded, by node id.
        written: Value of each key as last recorded.
        guards: Findings of the supervision so far, by guard.
        start_s: Robot clock at the first tick of the first run.
        ticks: Ticks done, over all runs.
    """

    tree: BuiltTree
    context: Context
    robot: Robot
    summary: RunSummary
    book: ReasonBook
    requests: RecordedRequests
    status: dict[object, Status]
    written: dict[str, object] = field(default_factory=dict)
    guards: dict[str, int] = field(default_factory=dict)
    start_s: float = 0.0
    ticks: int = 0


@dataclass(frozen=True)
class ResumePoint:
    """A checkpoint to continue from.

    Attributes:
        number: Number of the checkpoint.
        state: Its content.
        same_world: The robot was restored to the state it had then; otherwise robot and world are where they are.
        start: Path of the node to start at instead of the next one, or empty.
        on_restored: Called when mission and tree are restored, before anything else happens.
    """

    number: int
    state: Mapping[str, Any]
    same_world: bool
    start: str = ""
    on_restored: Callable[[], None] = lambda: None


class CheckpointWriter:
    """Writes a checkpoint whenever a skill has ended.

    Args:
        file: The checkpoint file.
        record: Flushed before each checkpoint, so that it reaches as far.
        number: Number of the next checkpoint.

    Attributes:
        lacking: Values that the last checkpoint could not hold, with the reason.
    """

    def __init__(self, file: CheckpointFile, record: Recorder | None = None, number: int = 0) -> None:
        self._file, self._record, self._number = file, record, number
        self._started: dict[str, None] = {}
        self.lacking: dict[str, str] = {}

    def on_nodes_started(self, paths: Sequence[str]) -> None:
        """Note nodes that have started, for the next checkpoint."""
        self._started.update(dict.fromkeys(paths))

    def save(self, run: RunState, finished: Sequence[Behaviour]) -> None:
        """Write a checkpoint; the last of `finished` has just ended. Before the first tick it is empty.

        Raises:
            GlotouchError: The file cannot be written.
        """
        state = self._encode_state(run, finished)
        snapshot = run.robot.snapshot()
        world: bytes | None = None
        if snapshot is not None:
            try:
                world = encode(snapshot)
            except NotEncodable as e:
                self.lacking["world"] = str(e)
        row = CheckpointRow(
            number=self._number,
            stamp_s=run.context.observation.now_s,
            node=run.tree.paths[finished[-1].id] if finished else "",
            status=finished[-1].status.value if finished else "",
            begun=tuple(self._started),
            lacking=self.lacking,
            record_bytes=None if self._record is None else self._record.flush(),
            has_world=world is not None,
        )
        self._file.add(row, state, world)
        self._started.clear()
        self._number += 1

    def _encode_state(self, run: RunState, finished: Sequence[Behaviour]) -> bytes:
        run.summary.flush()
        paths, storage, space = run.tree.paths, Blackboard.storage, run.tree.namespace
        values = {k: storage[f"{space}/{k}"] for k in run.tree.keys if f"{space}/{k}" in storage}
        parts: dict[str, object] = {f"port {key}": value for key, value in values.items()}
        recorded = tuple(k for k, v in values.items() if run.written.get(k) is v)
        parts |= {f"recorded {k}": v for k, v in run.written.items() if k not in recorded}
        parts |= {
            "recorded": recorded,
            "tree": tree_state(run.tree, finished),
            "arm": run.context.arm.state(),
            "preempted": run.context.preempted,
            "paused_s": run.context.paused_s,
            "summary": run.summary.state(),
            "reasons": {paths[i]: failure for i, failure in run.book.last.items()},
            "status": {paths[i]: status.value for i, status in run.status.items()},
            "ticks": run.ticks,
            "guards": dict(run.guards),
            "requests": run.requests.count,
            "elapsed": (run.start_s, run.context.observation.now_s),
            "record": None if self._record is None else self._record.state(),
        }
        encoded, self.lacking = encode_parts(parts)
        return encoded


class CheckpointHooks:
    """Called by the tick loop; writes checkpoints and restores a resume point.

    Args:
        writer: Writes checkpoints, or None.
        resume_point: Checkpoint to continue from, or None.

    Attributes:
        world_check: Skill to run before the mission continues, or None.
    """

    def __init__(self, writer: CheckpointWriter | None = None, resume_point: ResumePoint | None = None) -> None:
        self._writer, self._resume_point = writer, resume_point
        self._run: RunState | None = None
        self._restored: RestoredTree | None = None
        self._finished: list[Behaviour] = []
        self.world_check: Skill | None = None

    def begin(self, run: RunState) -> None:
        """Restore the resume point, or write the first checkpoint; call before the first tick.

        Raises:
            BadInput: The checkpoint is damaged or of another mission.
        """
        self._run, point = run, self._resume_point
        if point is not None:
            try:
                self._restored = restore(run, point)
            except (GlotouchError, *UNFIT) as e:
                why = str(e) if isinstance(e, BadInput) else f"{type(e).__name__}: {e}"
                raise BadInput(f"checkpoint {point.number} cannot be restored ({why}); run the mission again") from e
            point.on_restored()
            if not point.same_world:
                self.world_check = world_check(run.tree, run.context, point.start)
        elif self._writer is not None:
            self._writer.save(run, [])

    def replays_end(self, node: Behaviour) -> bool:
        """Return True if a restored tree reports an end that was recorded before the checkpoint."""
        return self._restored is not None and self._restored.replays(node)

    def on_node_ended(self, node: Behaviour, ticks: int) -> None:
        """Handle the end of a node before its parent reacts; `ticks` were done before this one."""
        if self._writer is None or self._run is None:
            return
        self._finished.append(node)
        if isinstance(node, Skill) and not self.replays_end(node):
            self._run.ticks = ticks
            self._writer.save(self._run, self._finished)

    def on_tick_done(self) -> None:
        """Handle the end of a tick in which something changed."""
        self._finished = []
        if self._restored is not None:
            self._restored.done()
            self._restored = None

    def on_nodes_started(self, paths: Sequence[str]) -> None:
        """Note nodes that have started."""
        if self._writer is not None:
            self._writer.on_nodes_started(paths)


def restore(run: RunState, point: ResumePoint) -> RestoredTree | None:
    """Restore a mission that is about to start to a checkpoint; return the restored tree unless it starts at a node.

    Raises:
        BadInput: The checkpoint is of another tree, or lacks what the tree needs, or a value is of a wrong type.
        GlotouchError, and the errors in `UNFIT`: A value inside does not fit.
    """
    state, tree, context = point.state, run.tree, run.context
    for name, hint in STATE.items():
        if name not in state:
            raise BadInput(f"checkpoint {point.number} lacks the state of the {name}: it could not be saved")
        require_type(state[name], hint, f"checkpoint {point.number}: {name}")
    if not all(math.isfinite(s) for s in (*state["elapsed"], state["paused_s"])):
        raise BadInput(f"checkpoint {point.number} is damaged: its times are not finite")
    for name, value in state.items():
        what, _, key = name.partition(" ")
        if what == "port":
            Blackboard.storage[f"{tree.namespace}/{key}"] = value
        if (what == "port" and key in state["recorded"]) or (what == "recorded" and key):
            run.written[key] = value
    context.arm.restore(state["arm"])
    if not point.same_world:
        context.arm.sync(context.observation)
    context.preempted, context.paused_s = state["preempted"], state["paused_s"]
    start_s, then_s = state["elapsed"]
    run.start_s = start_s + (context.observation.now_s - then_s)
    run.ticks, run.requests.count = state["ticks"], state["requests"]
    ids = {path: number for number, path in tree.paths.items()}
    unknown = [p for p in (*state["status"], *state["reasons"]) if p not in ids]
    if unknown:
        raise BadInput(f"checkpoint {point.number} is of another tree (its node {unknown[0]} is not in this one)")
    run.guards.update(state["guards"])
    run.book.last.update({ids[p]: failure for p, failure in state["reasons"].items()})
    run.summary.restore(state["summary"])
    restored: RestoredTree | None = None
    if point.start:
        start_at(tree, state["tree"], point.start)
    else:
        restored = RestoredTree(tree, state["tree"])
    for path, status in state["status"].items():
        run.status[ids[path]] = Status(status)
    return restored
