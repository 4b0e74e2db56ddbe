"""Taking checkpoints while a mission runs, and taking one up in a new run.

All that a mission is between two skills: the tree, the ports, what skills remember, the arm's setpoint and scene, the
counts and reasons so far, how much of the record was written, and in simulation the world.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from py_trees.behaviour import Behaviour
from py_trees.blackboard import Blackboard
from py_trees.common import Status

from glotouch_bt.mission.checkpoint.codec import CannotKeep, encode, encode_parts
from glotouch_bt.mission.checkpoint.store import CheckpointFile, Row
from glotouch_bt.mission.checkpoint.tree_state import TreeState, start_at, tree_state
from glotouch_bt.mission.checkpoint.world_check import world_check
from glotouch_bt.mission.record import RecordedRequests, RunSummary
from glotouch_bt.mission.tree import BuiltTree, ReasonBook
from glotouch_bt.robot import BadInput, Robot
from glotouch_bt.skill import Context, Skill


class Flushed(Protocol):
    """The part of a record that a checkpoint needs."""

    def flush(self) -> int:
        """Write all that is pending; the length of the file."""
        ...

    def state(self) -> dict[str, Any]:
        """What a record that goes on from here must know."""
        ...


@dataclass
class RunState:
    """A mission at work: what the loop holds, as checkpoints see it. All of it is the loop's own.

    Attributes:
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
    """A checkpoint to go on from.

    Attributes:
        number: Which.
        state: Its content.
        same_world: The robot was put back to the state it had then; else it is where it is, and so is the world.
        start: Path of the node to begin with, whatever came next at the checkpoint; empty: go on.
    """

    number: int
    state: Mapping[str, Any]
    same_world: bool
    start: str = ""


class CheckpointWriter:
    """Writes a checkpoint whenever a skill has ended.

    Args:
        file: Where to.
        record: Flushed before each checkpoint, so that it reaches as far.
        number: Of the next checkpoint.

    Attributes:
        lacking: What could not be kept at the last checkpoint, and why.
        seconds: Wall time spent; set by who measures it.
    """

    def __init__(self, file: CheckpointFile, record: Flushed | None = None, number: int = 0) -> None:
        self._file, self._record, self._number = file, record, number
        self._begun: dict[str, None] = {}
        self.lacking: dict[str, str] = {}

    def began(self, paths: Sequence[str]) -> None:
        """These nodes run from now on."""
        self._begun.update(dict.fromkeys(paths))

    def keep(self, work: RunState, finished: Sequence[Behaviour]) -> None:
        """Write a checkpoint; the last of `finished` has just ended, none: before the first tick.

        Raises:
            GlotouchError: The disk refused.
        """
        state = self._encoded(work, finished)
        snapshot = work.robot.snapshot()
        world: bytes | None = None
        if snapshot is not None:
            try:
                world = encode(snapshot)
            except CannotKeep as e:
                self.lacking["world"] = str(e)
        size = None if self._record is None else self._record.flush()
        node, status = ("", "") if not finished else (work.tree.paths[finished[-1].id], finished[-1].status.value)
        row = Row(
            self._number,
            work.context.observation.now_s,
            node,
            status,
            tuple(self._begun),
            self.lacking,
            size,
            world is not None,
        )
        self._file.add(row, state, world)
        self._begun.clear()
        self._number += 1

    def _encoded(self, work: RunState, finished: Sequence[Behaviour]) -> bytes:
        work.summary.settle()
        paths, storage, space = work.tree.paths, Blackboard.storage, work.tree.namespace
        values = {k: storage[f"{space}/{k}"] for k in work.tree.keys if f"{space}/{k}" in storage}
        parts: dict[str, object] = {f"port {key}": value for key, value in values.items()}
        recorded = tuple(k for k, v in values.items() if work.written.get(k) is v)
        parts |= {f"recorded {k}": v for k, v in work.written.items() if k not in recorded}
        parts |= {
            "recorded": recorded,
            "tree": tree_state(work.tree, finished),
            "arm": work.context.arm.state(),
            "preempted": work.context.preempted,
            "paused_s": work.context.paused_s,
            "summary": work.summary.state(),
            "reasons": {paths[i]: failure for i, failure in work.book.noted().items()},
            "status": {paths[i]: status.value for i, status in work.status.items()},
            "ticks": work.ticks,
            "guards": dict(work.guards),
            "requests": work.requests.count,
            "elapsed": (work.start_s, work.context.observation.now_s),
            "record": None if self._record is None else self._record.state(),
        }
        encoded, self.lacking = encode_parts(parts)
        return encoded


class CheckpointHooks:
    """What a run's loop tells of itself, and what it is told, so that it can be kept and gone on with.

    Args:
        checkpoints: Writes checkpoints; None: nobody does.
        resume_point: A checkpoint to go on from, or None.

    Attributes:
        look_first: A skill to be run before the mission goes on, or None.
    """

    def __init__(self, checkpoints: CheckpointWriter | None = None, resume_point: ResumePoint | None = None) -> None:
        self._keeper, self._taken_up = checkpoints, resume_point
        self._work: RunState | None = None
        self._resumed: TreeState | None = None
        self._finished: list[Behaviour] = []
        self.look_first: Skill | None = None

    def begin(self, work: RunState) -> None:
        """Before the first tick: take up the checkpoint, or write the first one.

        Raises:
            BadInput: The checkpoint is of another mission.
        """
        self._work, kept = work, self._taken_up
        if kept is not None:
            self._resumed = take_up(work, kept)
            if not kept.same_world:
                self.look_first = world_check(work.tree, work.context, kept.start)
        elif self._keeper is not None:
            self._keeper.keep(work, [])

    def hands_up_again(self, node: Behaviour) -> bool:
        """The node's end is not a new one: a resumed tree hands it up once more."""
        return self._resumed is not None and self._resumed.replays(node)

    def ended(self, node: Behaviour, ticks: int) -> None:
        """A node has ended, and nothing above has reacted to that yet; `ticks` are done before this one."""
        if self._keeper is None or self._work is None:
            return
        self._finished.append(node)
        if isinstance(node, Skill) and not self.hands_up_again(node):
            self._work.ticks = ticks
            self._keeper.keep(self._work, self._finished)

    def tick_over(self) -> None:
        """A tick in which something changed is over."""
        self._finished = []
        if self._resumed is not None:
            self._resumed.done()
            self._resumed = None

    def began(self, paths: Sequence[str]) -> None:
        """These nodes run from now on."""
        if self._keeper is not None:
            self._keeper.began(paths)


def take_up(work: RunState, kept: ResumePoint) -> TreeState | None:
    """Bring a mission that is about to begin to a checkpoint; returns what must be told when its first tick is over.

    Raises:
        BadInput: The checkpoint is of another tree, or lacks what the tree needs.
    """
    state, tree, context = kept.state, work.tree, work.context
    for name in ("tree", "arm", "summary", "reasons", "status", "elapsed"):
        if name not in state:
            raise BadInput(f"checkpoint {kept.number} lacks the state of the {name}: it could not be kept")
    for name, value in state.items():
        what, _, key = name.partition(" ")
        if what == "port":
            Blackboard.storage[f"{tree.namespace}/{key}"] = value
        if (what == "port" and key in state["recorded"]) or (what == "recorded" and key):
            work.written[key] = value
    context.arm.restore(state["arm"])
    if not kept.same_world:
        context.arm.sync(context.observation)
    context.preempted, context.paused_s = state["preempted"], state["paused_s"]
    start_s, then_s = state["elapsed"]
    work.start_s = start_s + (context.observation.now_s - then_s)
    work.ticks, work.requests.count = state["ticks"], state["requests"]
    ids = {path: number for number, path in tree.paths.items()}
    odd = [p for p in (*state["status"], *state["reasons"]) if p not in ids]
    if odd:
        raise BadInput(f"checkpoint {kept.number} is of another tree (it knows {odd[0]})")
    work.guards.update(state["guards"])
    work.book.take_up({ids[p]: failure for p, failure in state["reasons"].items()})
    work.summary.take_up(state["summary"])
    resumed: TreeState | None = None
    if kept.start:
        start_at(tree, state["tree"], kept.start)
    else:
        resumed = TreeState(tree, state["tree"])
    for path, status in state["status"].items():
        work.status[ids[path]] = Status(status)
    return resumed
