"""The checker against the executive itself: every outcome of every leaf of small random trees, ticked, none guessed.

The trees are built and ticked as missions are; leaves take their outcomes from an oracle that is led through all
choices in turn. What was found missing, and where, must be what `check` says, to the node, port and state.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import pytest
from hypothesis import HealthCheck, assume, example, given, settings
from hypothesis import strategies as st
from py_trees.common import Status

from glotouch_bt.mission.check import rules as judge
from glotouch_bt.mission.check.counterexample import Goal, shortest_path
from glotouch_bt.mission.check.data_flow import DataFlow
from glotouch_bt.mission.check.requirements import all_requirements
from glotouch_bt.mission.check.rules import projected
from glotouch_bt.mission.check.variables_of import variables_of
from glotouch_bt.mission.nodes import ConditionSettings, condition, repeat
from glotouch_bt.mission.nodes.base import EMPTY
from glotouch_bt.mission.nodes.timeout import ClockTimeout
from glotouch_bt.mission.read.parse import parse_tree
from glotouch_bt.mission.read.scope import Scope
from glotouch_bt.mission.read.yaml_source import parse_yaml
from glotouch_bt.mission.spec import Findings, NodeSpec, number_names
from glotouch_bt.mission.tree.build import build_tree
from glotouch_bt.skill import UNCHANGED, Context, In, Out, Skill, SkillFailed, SkillRun
from tests.support.examples import examples

pytestmark = pytest.mark.usefixtures("quorum")
MAX_RUNS, MAX_STEPS, ITEMS = 600, 16, 2


class Oracle:
    """Leads through all sequences of choices: the first run takes 0 everywhere, the next run the next branch."""

    def __init__(self) -> None:
        self.trail: list[list[int]] = []  # [taken, of how many]
        self.at = 0

    def choose(self, among: int) -> int:
        if self.at == len(self.trail):
            self.trail.append([0, among])
        self.at += 1
        assert self.trail[self.at - 1][1] == among, "the tree is not deterministic"
        return self.trail[self.at - 1][0]

    def next(self) -> bool:
        """Set up the next run; False after the last."""
        self.at = 0
        while self.trail and self.trail[-1][0] + 1 == self.trail[-1][1]:
            self.trail.pop()
        if not self.trail:
            return False
        self.trail[-1][0] += 1
        return True


class TooLong(Exception):
    """A run that the oracle does not follow to its end."""


class World:
    """What the leaves share in one run."""

    oracle: Oracle
    hand: str
    steps: int
    looks: int  # leaves that have ended, conditions included
    seen: dict[tuple[str, str, str], int]  # fewest of them before each wrong look
    hanging: bool  # a leaf waits to be broken off
    timeouts: ClassVar[dict[str, bool]] = {}


def wrong(*look: str) -> None:
    """A wrong look; in a run nothing follows it."""
    World.seen[look] = min(World.looks, World.seen.get(look, World.looks))  # type: ignore[index]
    raise TooLong


class Leaf(Skill):
    """A skill whose outcome the oracle chooses."""

    def run(self) -> SkillRun:
        for port, info in self.INPUT_PORTS.items():
            if info.required and not self.blackboard_client.exists(port):
                wrong(self.name, port, "unset")
        if "hand" in self.PRECONDITIONS and World.hand not in self.PRECONDITIONS["hand"]:
            wrong(self.name, "hand", World.hand)
        World.steps += 1
        World.looks += 1
        if World.steps > MAX_STEPS:
            raise TooLong
        how = World.oracle.choose(3 if World.timeouts.get(self.name) else 2)
        for port in self.OUTPUT_PORTS:
            sure = how == 0 or (how == 1 and getattr(type(self), port).always)
            if sure or World.oracle.choose(2):
                self.write_port(port, self.value(port))
        if "hand" in {*self.POSTCONDITIONS, *self.FAILURE_STATES}:
            left = self.POSTCONDITIONS.get("hand", UNCHANGED)
            after = sorted(self.FAILURE_STATES.get("hand", {UNCHANGED, left}))
            states = [left] if how == 0 else after if how == 1 else sorted({*after, UNCHANGED, left})
            state = states[World.oracle.choose(len(states))]
            World.hand = World.hand if state == UNCHANGED else state
        if how == 2:
            World.hanging = True
            while True:
                yield self.context.command  # until it is broken off
        if how == 1:
            raise SkillFailed("told", "to fail")
        return
        yield  # a generator all the same

    def value(self, port: str) -> object:
        if port == "list":
            return tuple(range(World.oracle.choose(ITEMS + 1)))
        return 1


class A(Leaf):
    """Writes a."""

    a = Out(int, "a")


class B(Leaf):
    """Reads a, writes b whatever happens."""

    a = In(int, "a")
    b = Out(int, "b", always=True)


class C(Leaf):
    """Reads b."""

    b = In(int, "b")


class Lister(Leaf):
    """Writes a tuple."""

    list = Out(tuple, "a tuple")


class Take(Leaf):
    """Takes the tool."""

    PRECONDITIONS: ClassVar = {"hand": frozenset({"empty", "tool"})}
    POSTCONDITIONS: ClassVar = {"hand": "tool"}
    FAILURE_STATES: ClassVar = {"hand": frozenset({UNCHANGED, "tool"})}


class Use(Leaf):
    """Needs the tool."""

    PRECONDITIONS: ClassVar = {"hand": frozenset({"tool"})}
    a = Out(int, "a")


class Give(Leaf):
    """Puts the tool back."""

    PRECONDITIONS: ClassVar = {"hand": frozenset({"tool"})}
    POSTCONDITIONS: ClassVar = {"hand": "empty"}


SKILLS: dict[str, type[Skill]] = {"a": A, "b": B, "c": C, "lister": Lister, "take": Take, "use": Use, "give": Give}
LEAVES_ = st.sampled_from(list(SKILLS)) | st.sampled_from(
    [
        {"condition": {"port": "a", "at_least": 1}},
        {"condition": {"port": "b", "is_set": True}},
        {"condition": {"port": "a", "is_set": False}},
    ]
)


def decorated(inner: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    many = st.lists(inner, min_size=1, max_size=3)
    return st.one_of(
        many.map(lambda c: {"sequence": c}),
        many.map(lambda c: {"selector": c}),
        inner.map(lambda c: {"succeed": {"do": c}}),
        inner.map(lambda c: {"fail": {"do": c}}),
        inner.map(lambda c: {"invert": {"do": c}}),
        inner.map(lambda c: {"timeout": {"seconds": 1.0, "do": c}}),
        inner.map(lambda c: {"retry": {"attempts": 2, "do": c}}),
        inner.map(lambda c: {"repeat": {"times": 2, "do": c}}),
        st.tuples(inner, st.sampled_from([(1, 2), (2, 2), (2, 3)])).map(
            lambda c: {"quorum": {"successes": c[1][0], "of": c[1][1], "do": c[0]}}
        ),
        inner.map(lambda c: {"repeat": {"until": {"port": "b", "at_least": 1}, "limit": 2, "do": c}}),
        st.tuples(inner, st.sampled_from(["stop", "continue"])).map(
            lambda c: {"for_each": {"items": "list", "item": "a", "on_failure": c[1], "do": c[0]}}
        ),
    )


TREES = st.recursive(LEAVES_, decorated, max_leaves=5)


def read(tree: Any) -> NodeSpec:
    findings = Findings()
    scope = Scope(SKILLS, findings, Path("m.yaml"))
    spec = parse_tree(parse_yaml(json.dumps(tree).encode(), "m.yaml"), scope)
    assert not findings.sorted(), [str(f) for f in findings.sorted()]
    number_names(spec)
    return spec


def broken_off(self: ClockTimeout) -> Status:
    """What runs is broken off when the oracle wants: how long anything takes is not the checker's business."""
    if self.decorated.status is Status.RUNNING and World.oracle.choose(2):
        World.hanging = False
        return Status.FAILURE
    return self.decorated.status


@contextmanager
def free_comparisons() -> Iterator[None]:
    """A comparison of what is written says what the oracle wants."""
    true = condition.holds

    def chosen(settings: ConditionSettings, value: Any) -> bool:
        if value is None or settings.is_set is not None:
            return true(settings, value)
        World.steps += 1
        if World.steps > MAX_STEPS:
            raise TooLong
        return World.oracle.choose(2) == 0

    def counted(settings: ConditionSettings, value: Any) -> bool:
        World.looks += 1
        return chosen(settings, value)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(condition, "holds", counted)
        patch.setattr(ClockTimeout, "update", broken_off)
        patch.setattr(repeat, "holds", chosen)
        yield


class Standing(Context):
    """The arm stands at once, also when a skill was broken off in the very tick the next one begins."""

    def __setattr__(self, name: str, value: object) -> None:
        super().__setattr__(name, False if name == "preempted" else value)


def by_ticking(spec: NodeSpec) -> tuple[dict[tuple[str, str, str], int], set[tuple[Status, str, bool, bool]], bool]:
    """What is found wrong in some run, how runs end (status, hand, a set, b set), and whether all runs were made."""
    from glotouch_bt.robot import HOLD

    World.oracle, World.seen = Oracle(), {}
    World.timeouts = {
        below.name: True for n in spec.walk() if n.kind == "timeout" for below in n.walk() if below.kind == "skill"
    }
    ends: set[tuple[Status, str, bool, bool]] = set()
    whole = True
    for _ in range(MAX_RUNS):
        World.hand, World.steps, World.looks, World.hanging = "empty", 0, 0, False
        context = Standing(None, SimpleNamespace(not_run=[]), None, None, None)  # type: ignore[arg-type]
        context.observation = type("Seen", (), {"now_s": 0.0})()
        context.command = HOLD
        built = build_tree(spec, context, "m")
        try:
            for _ in range(60):
                built.root.tick_once()
                if built.root.status is not Status.RUNNING:
                    break
                if World.hanging:  # it may be broken off at once as well as later
                    raise TooLong
            else:
                whole = False
            if built.root.status is not Status.RUNNING:
                ends.add((built.root.status, World.hand, *(built.value(key) is not None for key in "ab")))
        except TooLong:
            whole = whole and World.steps <= MAX_STEPS
        finally:
            built.root.stop(Status.INVALID)
            built.forget()
        if not World.oracle.next():
            return World.seen, ends, whole
    return World.seen, ends, False


def by_sets(spec: NodeSpec) -> tuple[DataFlow, set[tuple[str, str, str]], set[tuple[Status, str, bool, bool]]]:
    variables = variables_of(spec)
    flow = DataFlow(spec, variables, all_requirements(spec, variables))
    wrong: set[tuple[str, str, str]] = set()
    for requirement in flow.looked:
        if not requirement.stops:
            continue
        for value in flow.values(requirement) - requirement.good:
            state = variables.state_names("hand")[value] if requirement.of_resource else "unset"
            wrong.add((requirement.node.name, requirement.port, state))
    ends = set()
    for status, end in ((Status.SUCCESS, flow.end.success), (Status.FAILURE, flow.end.failure)):
        for state in variables.state_names("hand") if "hand" in variables.resources else ["empty"]:
            for a in (False, True):
                for b in (False, True):
                    kept = end
                    if "hand" in variables.resources:
                        kept = flow.sets.where(kept, variables.resources["hand"], (variables.state("hand", state),))
                    for key, is_set in (("a", a), ("b", b)):
                        if key in variables.keys:
                            values = variables.written(key) if is_set else (0,)
                            kept = flow.sets.where(kept, variables.keys[key], values)
                        elif is_set:
                            kept = EMPTY
                    if kept != EMPTY:
                        ends.add((status, state, a, b))
    return flow, wrong, ends


@settings(max_examples=examples(120, 400), deadline=None, suppress_health_check=list(HealthCheck))
@given(tree=TREES)
@example(tree={"fail": {"do": {"selector": [{"timeout": {"seconds": 1.0, "do": "a"}}, "a"]}}})
def test_what_is_found_is_what_can_happen(tree: Any) -> None:
    """Same wrong looks, same ends: nothing is missed, nothing is made up."""
    spec = read(tree)
    with free_comparisons():
        seen, ends, whole = by_ticking(spec)
    _, wrong, possible = by_sets(spec)
    assert set(seen) <= wrong
    assert ends <= possible
    assume(whole)
    if not any(n.kind == "for_each" for n in spec.walk()):  # more items than were tried may show more
        assert wrong == set(seen)
        assert possible == ends


@settings(max_examples=examples(120, 400), deadline=None, suppress_health_check=list(HealthCheck))
@given(tree=TREES)
def test_the_path_shown_is_the_shortest_there_is(tree: Any) -> None:
    """It ends at the node that looks, after as few outcomes of leaves as any run that was ticked."""
    spec = read(tree)
    with free_comparisons():
        seen, _, whole = by_ticking(spec)
    flow, _, _ = by_sets(spec)
    variables = flow.variables
    loops = any(n.kind == "for_each" for n in spec.walk())
    for requirement in flow.looked:
        for value in flow.values(requirement) - requirement.good if requirement.stops else ():
            path = shortest_path(
                flow, Goal(requirement.node, requirement.port, requirement.variable, frozenset({value}))
            )
            assert path, (requirement.node.name, requirement.port)
            assert path[-1] == requirement.node.name
            state = variables.state_names("hand")[value] if requirement.of_resource else "unset"
            if whole and not loops:
                assert len(path) - 1 == seen[requirement.node.name, requirement.port, state], path


@settings(max_examples=examples(120, 400), deadline=None, suppress_health_check=list(HealthCheck))
@given(tree=TREES)
def test_variables_that_decide_nothing_need_not_be_followed(tree: Any) -> None:
    """The same nodes are entered and end alike, and a tree has findings with all variables only if it has some here."""
    spec = read(tree)
    variables = variables_of(spec)
    requirements = all_requirements(spec, variables)
    exact, quick = DataFlow(spec, variables, requirements), projected(spec, variables, requirements)
    assert quick.entered == exact.entered
    assert quick.ends == exact.ends
    for requirement in exact.looked:
        found, other = exact.found(requirement), quick.found(requirement)
        assert found == other or (found < other and not quick.sets.follows(requirement.variable))
    shown, everything = Findings(), Findings()
    judge.check_flow(spec, SKILLS, shown, {}, 60.0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(judge, "projected", DataFlow)
        judge.check_flow(spec, SKILLS, everything, {}, 60.0)
    assert shown.sorted() == everything.sorted()
