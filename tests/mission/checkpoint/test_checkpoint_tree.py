"""A tree broken off at any skill's end and built anew goes on as if nothing had happened: random trees."""

from __future__ import annotations

import shutil
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from glotouch_bt.mission.checkpoint.store import CheckpointFile
from glotouch_bt.mission.checkpoint.writer import CheckpointWriter, ResumePoint
from glotouch_bt.mission.execution.runner import Outcome, run_mission
from glotouch_bt.mission.load import Mission
from glotouch_bt.mission.nodes import (
    NODES,
    ConditionSettings,
    ForEachSettings,
    NoSettings,
    ParallelSettings,
    RepeatSettings,
    RetrySettings,
    TimeoutSettings,
)
from glotouch_bt.mission.record.run_summary import NullRecord
from glotouch_bt.mission.spec.node import NodeSpec, Wire, number_names
from glotouch_bt.mission.spec.source import Place
from glotouch_bt.robot import HOLD, BadInput, Observation
from glotouch_bt.skill import In, Out, Skill, SkillFailed, SkillParams, SkillRun
from tests.mission.conftest import ClockRobot
from tests.mission.nodes.quorum import QuorumSettings
from tests.support.examples import examples

pytestmark = pytest.mark.usefixtures("quorum")
HERE = Place("m.yaml", 1, 1)


class StepParams(SkillParams):
    script: str = "S"


class Step(Skill):
    """One run plays letters of the script up to an S (success) or F (failure); R is a period more. Counts runs."""

    Params = StepParams
    params: StepParams
    before = In(int, "periods so far", key="count", required=False)
    count = Out(int, "periods so far")
    odd = Out(bool, "the count is odd")
    mark = Out(str, "who wrote last")

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self._left = ""

    def remember(self) -> object:
        return self._left

    def recall(self, remembered: Any) -> None:
        self._left = remembered

    def run(self) -> SkillRun:
        self._left = left = self._left or self.params.script
        while left[:1] == "R":
            left = left[1:]
            yield HOLD
        self._left = left[1:]
        self.count = (self.before or 0) + 1
        self.odd = self.count % 2 == 1
        self.mark = f"{self.name} {self.count}"
        if left[:1] == "F":
            raise SkillFailed("told_to", f"{self.name} fails at {self.count}", count=self.count)


class KeptRobot(ClockRobot):
    """Its whole world is its clock."""

    def snapshot(self) -> dict[str, object]:
        return {"now_s": self.now_s}

    def restore(self, snapshot: Any) -> None:
        self.now_s = snapshot["now_s"]

    def close(self) -> None:
        pass


class KeptArm:
    not_run: list[str] = []  # noqa: RUF012

    pause_signal = SimpleNamespace(requested=False, style="hold", standing=False, stops=False, deferred=False)
    period_s = 0.01

    def __init__(self) -> None:
        self.synced = 0

    def sync(self, observation: Observation) -> None:
        self.synced += 1

    def state(self) -> dict[str, Any]:
        return {"synced": self.synced}

    def restore(self, state: Any) -> None:
        self.synced = state["synced"]


def wire(port: str, key: str | None = None) -> Wire:
    return Wire(port, key or port, HERE)


def leaf(script: str) -> NodeSpec:
    writes = {p: wire(p) for p in ("count", "odd", "mark")}
    reads = {"before": wire("before", "count")}
    params = StepParams(script=script)
    return NodeSpec("skill", "step", HERE, (), None, "step", Step, params, reads, writes)


def condition(port: str, **how: Any) -> NodeSpec:
    found = ConditionSettings(port=port, **how)
    return NodeSpec("condition", "condition", HERE, (), found, reads={"port": wire("port", port)})


def node(kind: str, children: list[NodeSpec], **fields: Any) -> NodeSpec:
    fields.setdefault("settings", NoSettings())
    return NodeSpec(kind, kind, HERE, tuple(children), **fields)


def for_each(child: NodeSpec, go_on: bool) -> NodeSpec:
    how = "continue" if go_on else "stop"
    found = ForEachSettings(items="items", item="item", collect={"mark": "marks"}, on_failure=how)
    reads = {"items": wire("items"), "mark": wire("mark")}
    writes = {"item": wire("item"), "mark": wire("mark", "marks")}
    return node("for_each", [child], settings=found, reads=reads, writes=writes)


def until(child: NodeSpec) -> NodeSpec:
    found = RepeatSettings(until="odd", limit=3)
    return node("repeat", [child], settings=found, reads={"until": wire("until", "odd")})


leaves = st.one_of(
    st.text("RSF", min_size=1, max_size=5).map(leaf),
    st.just("S").map(leaf),
    st.sampled_from([3, 8]).map(lambda n: condition("count", at_least=float(n))),
)


def trees(inner: st.SearchStrategy[NodeSpec]) -> st.SearchStrategy[NodeSpec]:
    several = st.lists(inner, min_size=1, max_size=3)
    return st.one_of(
        several.map(lambda c: node("sequence", c)),
        several.map(lambda c: node("sequence", c)),
        several.map(lambda c: node("selector", c)),
        inner.map(lambda c: node("retry", [c], settings=RetrySettings(attempts=3))),
        st.tuples(inner, st.sampled_from([0.02, 0.05])).map(
            lambda v: node("timeout", [v[0]], settings=TimeoutSettings(seconds=v[1]))
        ),
        inner.map(lambda c: node("repeat", [c], settings=RepeatSettings(times=2))),
        inner.map(until),
        inner.map(lambda c: node("quorum", [c], settings=QuorumSettings(successes=2, of=3))),
        inner.map(lambda c: node("invert", [c])),
        inner.map(lambda c: node("succeed", [c])),
        inner.map(lambda c: node("fail", [c])),
        inner.map(lambda c: node("subtree", [c])),
        st.tuples(inner, st.booleans()).map(lambda v: for_each(*v)),
    )


def with_items(tree: NodeSpec) -> NodeSpec:
    """The tree after a skill that writes what for_each goes through."""
    first = NodeSpec("skill", "items", HERE, (), None, "items", Items, SkillParams(), {}, {"items": wire("items")})
    return node("sequence", [first, tree])


class Items(Skill):
    """Writes three items."""

    items = Out(tuple, "items")

    def run(self) -> SkillRun:
        self.items = ("a", "b", "c")
        yield HOLD


def renamed(spec: NodeSpec) -> NodeSpec:
    """A copy: hypothesis may hand the same node out twice."""
    return NodeSpec(
        *(spec.kind, spec.kind if spec.kind != "skill" else spec.skill, HERE, tuple(renamed(c) for c in spec.children)),
        *(spec.settings, spec.skill, spec.skill_type, spec.params, spec.reads, spec.writes, spec.constants),
    )


@dataclass
class Trace(NullRecord):
    ticks: list[Any] = field(default_factory=list)
    ports: list[Any] = field(default_factory=list)
    events: list[Any] = field(default_factory=list)

    def tick(self, stamp_s: float, changes: Any) -> None:
        self.ticks.append((stamp_s, [(p, old.value, new.value) for p, old, new in changes]))

    def port(self, stamp_s: float, key: str, value: object) -> None:
        self.ports.append((stamp_s, key, value))

    def event(self, kind: str, stamp_s: float, data: Any) -> None:
        self.events.append((kind, stamp_s, data))

    def flush(self) -> int:
        return 0

    def state(self) -> dict[str, Any]:
        return {"ticks": len(self.ticks), "ports": len(self.ports), "events": len(self.events)}


def mission_of(tree: NodeSpec) -> Mission:
    spec = with_items(renamed(tree))
    number_names(spec)
    world = cast(Any, SimpleNamespace())
    return Mission("m", "", world, {}, (), spec, 3.0, Path("m.yaml"), {})


def run(tree: NodeSpec, file: CheckpointFile | None, number: int = 0, **options: Any) -> tuple[Outcome, Trace]:
    trace, robot = Trace(), KeptRobot()
    checkpoints = None if file is None else CheckpointWriter(file, trace, number)
    if "world" in options:
        robot.restore(options.pop("world"))
    make: Any = lambda robot, world: KeptArm()  # noqa: E731
    return run_mission(
        mission_of(tree), cast(Any, robot), trace, make_arm=make, checkpoints=checkpoints, **options
    ), trace


def ending(outcome: Outcome) -> Any:
    return outcome.status, [f.as_dict() for f in outcome.chain], outcome.start_s, outcome.end_s, outcome.ticks


@settings(max_examples=examples(20, 60), deadline=None, suppress_health_check=list(HealthCheck))
@given(st.recursive(leaves, trees, max_leaves=8).flatmap(lambda t: st.tuples(st.just(t), st.integers(0, 50))))
def test_a_resumed_tree_goes_on_as_the_one_that_was_not_broken_off(case: tuple[NodeSpec, int]) -> None:
    """Same status changes, ports, reasons and times, tick by tick; and the checkpoints it writes are the same, too."""
    tree, pick = case
    folder = Path(tempfile.mkdtemp())
    try:
        file = CheckpointFile.create(folder / "checkpoint.sqlite", {})
        whole, trace = run(tree, file)
        plain, _ = run(tree, None)
        assert ending(plain) == ending(whole), "taking checkpoints changes nothing"
        rows = file.rows()
        row = rows[pick % len(rows)]
        state, world = file.state(row.number), file.world(row.number)
        file.begin_again(row.number, [])
        taken = ResumePoint(row.number, state, same_world=True)
        resumed, rest = run(tree, file, row.number + 1, resume_point=taken, world=world)
        assert ending(resumed) == ending(whole)
        done = state["record"]
        assert rest.ticks == trace.ticks[done["ticks"] :]
        assert rest.ports == trace.ports[done["ports"] :]
        assert rest.events == trace.events[done["events"] :]
        assert file.rows() == rows
        file.close()
    finally:
        shutil.rmtree(folder)


def test_every_kind_of_node_is_in_the_random_trees_or_named_here() -> None:
    """A new kind of node must be thought of: does it remember something from tick to tick?"""
    tried = {"sequence", "selector", "retry", "timeout", "repeat", "invert", "succeed", "fail", "for_each", "condition"}
    tried.add("quorum")
    assert set(NODES) - tried - {"subtree"} == {"parallel"}, "parallels have a test of their own"


def parallel(*children: NodeSpec) -> NodeSpec:
    return node("parallel", list(children), settings=ParallelSettings(policy="all"))


def test_what_runs_beside_the_skill_that_ended_starts_from_its_beginning(tmp_path: Path) -> None:
    tree = parallel(leaf("RRS"), leaf("RRRRRRS"), leaf("S"))
    file = CheckpointFile.create(tmp_path / "checkpoint.sqlite", {})
    whole, _ = run(tree, file)
    assert whole.status == "success"
    [row] = [r for r in file.rows() if r.node == "m/sequence/parallel/step"]
    taken = ResumePoint(row.number, file.state(row.number), same_world=True)
    resumed, rest = run(tree, None, resume_point=taken, world=file.world(row.number))
    assert resumed.status == "success"
    assert resumed.ticks == whole.ticks + 2, "the long one lost the periods it had done"
    ended = [(p, new) for _, changes in rest.ticks for p, _, new in changes if "step" in p and new != "RUNNING"]
    assert ended == [("m/sequence/parallel/step", "SUCCESS"), ("m/sequence/parallel/step 2", "SUCCESS")]
    file.close()


def started(tree: NodeSpec, file: CheckpointFile, path: str, number: int) -> tuple[Outcome, list[str]]:
    taken = ResumePoint(number, file.state(number), same_world=True, start=path)
    outcome, rest = run(tree, None, resume_point=taken, world=file.world(number))
    begun = [p.removeprefix("m/sequence/") for _, changes in rest.ticks for p, _, new in changes if new == "RUNNING"]
    ended = [p.removeprefix("m/sequence/") for _, changes in rest.ticks for p, _, new in changes if new == "SUCCESS"]
    return outcome, [p for p in dict.fromkeys((*begun, *ended)) if "step" in p]


def test_a_mission_starts_at_any_node(tmp_path: Path) -> None:
    """In a sequence what comes before is passed over; loops round the node begin, or go on; for_each has its item."""
    tree = node("sequence", [leaf("RS"), node("retry", [leaf("RS")], settings=RetrySettings(attempts=2)), leaf("S")])
    file = CheckpointFile.create(tmp_path / "a.sqlite", {})
    run(tree, file)
    last = file.rows()[-1].number
    outcome, steps = started(tree, file, "m/sequence/sequence 2/retry/step 2", last)
    assert outcome.status == "success"
    assert [s.rsplit("/", 1)[-1] for s in steps] == ["step 2", "step 3"]
    outcome, steps = started(tree, file, "m/sequence/sequence 2", 0)
    assert [s.rsplit("/", 1)[-1] for s in steps] == ["step", "step 2", "step 3"]
    file.close()


def test_a_mission_starts_inside_a_for_each_and_inside_a_selector(tmp_path: Path) -> None:
    inner = node("sequence", [leaf("RS"), leaf("RS")])
    tree = for_each(node("selector", [leaf("RF"), inner]), go_on=False)
    file = CheckpointFile.create(tmp_path / "a.sqlite", {})
    whole, _ = run(tree, file)
    assert whole.status == "success"
    path = "m/sequence/for_each/selector/sequence 2/step 3"
    fresh = next(r.number for r in file.rows() if r.node.endswith("items"))
    taken = ResumePoint(fresh, file.state(fresh), same_world=True, start=path)
    outcome, rest = run(tree, None, resume_point=taken, world=file.world(fresh))
    assert outcome.status == "success"
    items = [value for _, key, value in rest.ports if key == "item"]
    assert items == ["a", "b", "c"]
    first = [
        p.rsplit("/", 1)[-1] for _, changes in rest.ticks for p, _, new in changes if "step" in p and new == "RUNNING"
    ]
    assert first[0] == "step 3"
    midway = [r.number for r in file.rows() if r.node.endswith("step 3")][1]
    taken = ResumePoint(midway, file.state(midway), same_world=True, start=path)
    outcome, rest = run(tree, None, resume_point=taken, world=file.world(midway))
    assert outcome.status == "success"
    marks = [value for _, key, value in rest.ports if key == "marks"]
    assert len(marks[-1]) == 3, "the first item's mark was kept, the loop went on with the second"
    file.close()


def test_a_checkpoint_of_another_tree_is_refused_before_the_first_tick(tmp_path: Path) -> None:
    file = CheckpointFile.create(tmp_path / "a.sqlite", {})
    run(leaf("RS"), file)
    taken = ResumePoint(1, file.state(1), same_world=True)
    with pytest.raises(BadInput, match="another tree"):
        run(node("sequence", [leaf("RS"), leaf("S")]), None, resume_point=taken, world=file.world(1))
    file.close()
