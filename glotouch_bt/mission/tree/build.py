"""A checked tree to py_trees nodes, wired to one run's keys."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import py_trees
from py_trees.behaviour import Behaviour
from py_trees.blackboard import Blackboard
from py_trees.common import ParallelPolicy

from glotouch_bt.mission.spec import (
    ConditionSettings,
    ForEachSettings,
    NodeSpec,
    ParallelSettings,
    RepeatSettings,
    RetrySettings,
    TimeoutSettings,
)
from glotouch_bt.mission.tree.decorators import (
    ClockTimeout,
    ForEach,
    Keys,
    Passage,
    PortCondition,
    RepeatUntil,
    holds,
    in_words,
)
from glotouch_bt.robot import GlotouchError
from glotouch_bt.skill import Context

_runs = 0


@dataclass
class BuiltTree:
    """A tree ready to tick.

    Attributes:
        root: The root node.
        paths: Path in the tree (`retrieve/sequence/squeeze`) by node id.
        keys: Every key in use, as the mission names it.
        namespace: Where the keys live on py_trees' blackboard.
    """

    root: Behaviour
    paths: Mapping[object, str]
    keys: tuple[str, ...]
    namespace: str

    def value(self, key: str) -> object | None:
        """What a key holds now, or None."""
        found: object | None = Blackboard.storage.get(f"{self.namespace}/{key}")
        return found

    def forget(self) -> None:
        """Remove this run's keys from py_trees' (process-wide) blackboard."""
        for key in self.keys:
            Blackboard.storage.pop(f"{self.namespace}/{key}", None)
            Blackboard.metadata.pop(f"{self.namespace}/{key}", None)


def build_tree(spec: NodeSpec, context: Context, title: str) -> BuiltTree:
    """Make the nodes of a checked tree.

    Args:
        spec: A tree without findings.
        context: What skills are lent; `context.observation` is the clock of timeouts.
        title: First word of each node's path.
    """
    # py_trees' blackboard is one dict for the whole process: two runs must not share keys.
    global _runs
    _runs += 1
    namespace = f"/run{_runs}"
    paths: dict[object, str] = {}
    root = _Builder(context, namespace, paths).build(spec, title)
    keys = dict.fromkeys(w.key for n in spec.walk() for w in (*n.reads.values(), *n.writes.values()))
    return BuiltTree(root, paths, tuple(keys), namespace)


class _Builder:
    def __init__(self, context: Context, namespace: str, paths: dict[object, str]) -> None:
        self._context, self._namespace, self._paths = context, namespace, paths

    def build(self, spec: NodeSpec, above: str) -> Behaviour:
        path = f"{above}/{spec.name}"
        children = [self.build(c, path) for c in spec.children]
        make: Callable[[NodeSpec, list[Behaviour]], Behaviour] | None = getattr(self, f"_{spec.kind}", None)
        if make is None:
            raise GlotouchError(f"{spec.place}: node {spec.name!r} of kind {spec.kind!r} cannot be built")
        node = make(spec, children)
        self._paths[node.id] = path
        return node

    def _sequence(self, spec: NodeSpec, children: list[Behaviour]) -> Behaviour:
        return py_trees.composites.Sequence(spec.name, memory=True, children=children)

    def _selector(self, spec: NodeSpec, children: list[Behaviour]) -> Behaviour:
        return py_trees.composites.Selector(spec.name, memory=True, children=children)

    def _parallel(self, spec: NodeSpec, children: list[Behaviour]) -> Behaviour:
        settings = spec.settings
        assert isinstance(settings, ParallelSettings)
        one = settings.policy == "one"
        policy = ParallelPolicy.SuccessOnOne() if one else ParallelPolicy.SuccessOnAll(synchronise=True)
        return py_trees.composites.Parallel(spec.name, policy=policy, children=children)

    def _retry(self, spec: NodeSpec, children: list[Behaviour]) -> Behaviour:
        assert isinstance(spec.settings, RetrySettings)
        return py_trees.decorators.Retry(spec.name, children[0], spec.settings.attempts)

    def _invert(self, spec: NodeSpec, children: list[Behaviour]) -> Behaviour:
        return py_trees.decorators.Inverter(spec.name, children[0])

    def _succeed(self, spec: NodeSpec, children: list[Behaviour]) -> Behaviour:
        return py_trees.decorators.FailureIsSuccess(spec.name, children[0])

    def _fail(self, spec: NodeSpec, children: list[Behaviour]) -> Behaviour:
        return py_trees.decorators.SuccessIsFailure(spec.name, children[0])

    def _subtree(self, spec: NodeSpec, children: list[Behaviour]) -> Behaviour:
        return Passage(spec.name, children[0])

    def _timeout(self, spec: NodeSpec, children: list[Behaviour]) -> Behaviour:
        assert isinstance(spec.settings, TimeoutSettings)
        context = self._context
        return ClockTimeout(spec.name, children[0], spec.settings.seconds, lambda: context.mission_s)

    def _repeat(self, spec: NodeSpec, children: list[Behaviour]) -> Behaviour:
        settings = spec.settings
        assert isinstance(settings, RepeatSettings)
        if settings.times is not None:
            return py_trees.decorators.Repeat(spec.name, children[0], settings.times)
        key = spec.reads["until"].key
        keys = Keys(spec.name, self._namespace, (key,))
        if isinstance(settings.until, ConditionSettings):
            condition, words = settings.until, in_words(settings.until)
        else:
            condition, words = ConditionSettings(port=key, equals=True), str(settings.until)
        return RepeatUntil(spec.name, children[0], lambda: holds(condition, keys.get(key)), settings.limit, words)

    def _for_each(self, spec: NodeSpec, children: list[Behaviour]) -> Behaviour:
        settings = spec.settings
        assert isinstance(settings, ForEachSettings)
        items, item = spec.reads["items"].key, spec.writes["item"].key
        collect = {w.key: spec.writes[p].key for p, w in spec.reads.items() if p != "items"}
        keys = Keys(spec.name, self._namespace, (items, item, *collect, *collect.values()))
        go_on = settings.on_failure == "continue"
        return ForEach(spec.name, children[0], keys, items, item, collect, go_on, settings.least_first)

    def _condition(self, spec: NodeSpec, children: list[Behaviour]) -> Behaviour:
        assert isinstance(spec.settings, ConditionSettings)
        key = spec.reads["port"].key
        return PortCondition(spec.name, Keys(spec.name, self._namespace, (key,)), key, spec.settings)

    def _skill(self, spec: NodeSpec, children: list[Behaviour]) -> Behaviour:
        assert spec.skill_type is not None
        assert spec.params is not None
        try:
            skill = spec.skill_type(spec.name, spec.params, self._context)
        except Exception as e:
            raise GlotouchError(f"skill {spec.name!r} cannot be made: {type(e).__name__}: {e}") from e
        wiring = {p: f"{self._namespace}/{w.key}" for p, w in (*spec.reads.items(), *spec.writes.items())}
        skill.setup_ports(wiring)
        for port, value in spec.constants.items():
            Keys(spec.name, self._namespace, (spec.reads[port].key,)).set(spec.reads[port].key, value)
        return skill
