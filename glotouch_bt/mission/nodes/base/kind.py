"""The base class of node kinds, with the defaults of a decorator that passes its child's result on; the registry."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, ClassVar, Literal, Protocol

from py_trees.behaviour import Behaviour
from pydantic import BaseModel

from glotouch_bt.mission.nodes.base.analysis import (
    DataFlowAnalysis,
    ExitStates,
    PathSearch,
    Position,
    Requirement,
    Stack,
    Values,
)
from glotouch_bt.mission.nodes.base.behaviours import BuildContext, OutcomeDecorator
from glotouch_bt.mission.nodes.base.btcpp import BtcppForm, btcpp_value
from glotouch_bt.mission.nodes.base.comparison import ConditionSettings
from glotouch_bt.mission.nodes.base.requirements import comparison_requirement
from glotouch_bt.mission.nodes.base.run_count import RunCount
from glotouch_bt.mission.nodes.base.state_sets import EMPTY
from glotouch_bt.mission.nodes.base.state_variables import StateVariables, ValueKind
from glotouch_bt.mission.spec import Findings, Map, Node, NodeSpec, Place, Scalar, Settings, Wire


class NoSettings(Settings):
    """Nothing to set."""


class NodeReader(Protocol):
    """The reader of mission files, as a node kind uses it."""

    @property
    def findings(self) -> Findings:
        """Collection of the findings."""

    def wire(self, port: str, key: str, place: Place) -> Wire | None:
        """Return a port wired to a key; None (and a finding) if that is not a key."""


class NodeKind:
    """One kind of node. A subclass says what differs; the defaults are those of a transparent decorator.

    Attributes:
        name: Its name in mission files.
        description: One line for people.
        Settings: What may be set.
        children: Number of children: none, one (`do`), or a list.
        btcpp: Name in BehaviorTree.CPP; empty: it has no such node.
        sign: Its sign in drawings.
        fill: Its colour in drawings.
        concurrent: Its children run at the same time; each may be preempted when another one ends.
        interrupts: It may preempt its child at any moment, and then fails.
        revisits: It may enter a child again after having left it.
        continue_on: The result of a child after which the next one runs: True for success.
        needs_settings: With faulty settings nothing can be said of what it does.
        branches_on_unset: It behaves differently when a key it reads is not written.
    """

    name: ClassVar[str]
    description: ClassVar[str]
    Settings: ClassVar[type[Settings]] = NoSettings
    children: ClassVar[Literal["none", "one", "many"]] = "one"
    btcpp: ClassVar[str] = ""
    sign: ClassVar[str] = "◆"
    fill: ClassVar[str] = "#ffffff"
    concurrent: ClassVar[bool] = False
    interrupts: ClassVar[bool] = False
    revisits: ClassVar[bool] = False
    continue_on: ClassVar[bool] = True
    needs_settings: ClassVar[bool] = False
    branches_on_unset: ClassVar[bool] = False

    @property
    def preempts(self) -> bool:
        """True if it may preempt what runs below it."""
        return self.concurrent or self.interrupts

    def outcome(self, succeeded: bool) -> bool:
        """Return True if the node succeeds, given whether its child did."""
        return succeeded

    # -- reading -----------------------------------------------------------------------------------------------------

    def convert_units(self, given: Map, findings: Findings) -> tuple[Map, str]:
        """Return the settings with comparisons in SI units, and the unit of what is compared."""
        return given, ""

    def default_name(self, node: NodeSpec) -> str:
        """Return the shown name of a node that the mission does not name."""
        return self.name

    def wire(self, node: NodeSpec, given: Map, unit: str, reader: NodeReader) -> None:
        """Set the keys that a node reads and writes, and check what pydantic cannot.

        Args:
            node: The node; `reads` and `writes` are set.
            given: Its settings as written.
            unit: From `convert_units`.
            reader: Checks keys and gathers findings.
        """

    def is_unknown(self, node: NodeSpec) -> bool:
        """True if the node is so faulty that nothing can be said of what it does."""
        return self.needs_settings and node.settings is None

    # -- what it reads and writes ------------------------------------------------------------------------------------

    def requirements(self, node: NodeSpec, variables: StateVariables) -> Iterator[Requirement]:
        """Yield every read of a key or resource: keys in the order of its ports, then resources."""
        if found := self.comparison(node):
            yield comparison_requirement(node, variables, *found)

    def comparison(self, node: NodeSpec) -> tuple[str, ConditionSettings] | None:
        """Return the port that the node compares with a constant, and the comparison; None if it does not."""
        return None

    def written_kinds(self, node: NodeSpec, port: str, held: Callable[[str], list[ValueKind]]) -> list[ValueKind]:
        """Return the kinds of values that the node may write to a port, given the kinds that keys may hold."""
        return held(node.writes[port].key)

    def derived_kinds(self, node: NodeSpec, held: Callable[[str], list[ValueKind]]) -> list[tuple[str, ValueKind]]:
        """Return the kinds that the node writes because of what other keys may hold, each with its key."""
        return []

    def effects(self, node: NodeSpec, variables: StateVariables) -> Iterator[tuple[int, set[int]]]:
        """Yield each variable that the node itself may change, and to which values."""
        for wire in node.writes.values():
            yield variables.keys[wire.key], set(variables.written(wire.key))

    def gathers(self, node: NodeSpec) -> Mapping[str, tuple[str, str]]:
        """Return (source key, target key) of each port that gathers the values of one key in a tuple."""
        return {}

    def ordered_by(self, node: NodeSpec) -> tuple[str, str] | None:
        """Return the key of a tuple, and the field of its items by which the node orders them; None: it does not."""
        return None

    def required_keys(self, node: NodeSpec) -> list[str]:
        """Return the keys without which the node cannot begin."""
        return []

    # -- what it does, for the checker ---------------------------------------------------------------------------------

    def exits(self, flow: DataFlowAnalysis, node: NodeSpec, entry: int) -> ExitStates:
        """Return the exit states of a node that is entered in `entry`, a set of states."""
        after = flow.child(node, entry)
        ends = {True: EMPTY, False: after.running if self.interrupts else EMPTY}
        for succeeded, states in ((True, after.success), (False, after.failure)):
            result = self.outcome(succeeded)
            ends[result] = flow.sets.union(ends[result], states)
        return ExitStates(ends[True], ends[False], after.running)

    def enter(self, search: PathSearch, node: NodeSpec, stack: Stack, values: Values) -> Iterator[Position]:
        """Yield the positions of the leaves at which the node may begin."""
        if node.children:
            yield from search.enter(node.children[0], search.push(stack, node, self.memory(values)), values)
        else:
            yield Position(search.push(stack, node, None), values)

    def memory(self, values: Values) -> Any:
        """Return what the node remembers while its first child runs, in a path search."""

    def leave(
        self, search: PathSearch, node: NodeSpec, stack: Stack, succeeded: bool, values: Values, memory: Any
    ) -> Iterator[Position]:
        """Yield the next positions after a child of the node has ended; `stack` holds the nodes above it."""
        yield from search.leave(stack, self.outcome(succeeded), values)

    def step(
        self, search: PathSearch, node: NodeSpec, stack: Stack, values: Values, memory: Any
    ) -> Iterator[tuple[str, Position]]:
        """Yield (words, next position) for every outcome of a leaf; nothing if they are not known."""
        yield from ()

    def max_runs(self, node: NodeSpec) -> RunCount:
        """Return the largest number of skill runs, with every loop made to its limit."""
        return sum((kind_of(c).max_runs(c) for c in node.children), RunCount())

    # -- what is probably not meant ------------------------------------------------------------------------------------

    def no_effect(self, node: NodeSpec, *, fails: bool, succeeds: bool) -> str:
        """Return why the node changes nothing, given how its first child may end; empty if it does something."""
        return ""

    def loses_gathered(self, node: NodeSpec) -> bool:
        """Return True if a failure of its child loses what it gathered, and the mission does not say that it may."""
        return False

    def time_limit_s(self, node: NodeSpec) -> float | None:
        """Return the longest time its child may take, robot clock (s); None: no limit of its own."""
        return None

    def catches_failure(self, node: NodeSpec) -> bool:
        """True if a failure below the node need not end the mission."""
        return self.outcome(False)

    # -- building and showing ------------------------------------------------------------------------------------------

    def build(self, node: NodeSpec, children: list[Behaviour], made: BuildContext) -> Behaviour:
        """Return the py_trees node."""
        return OutcomeDecorator(node.name, children[0], self.outcome)

    def label(self, node: NodeSpec) -> str:
        """Return what the node is, for people."""
        return self.name

    def details(self, node: NodeSpec) -> list[str]:
        """Return what is set on the node and differs from the defaults."""
        return set_values(node.settings)

    def btcpp_form(self, node: NodeSpec) -> BtcppForm | None:
        """Return the node in BehaviorTree.CPP's XML; None if its children stand in its place."""
        if self.btcpp:
            return BtcppForm(self.btcpp)
        given = {} if node.settings is None else node.settings.model_dump(exclude_none=True)
        tag = "".join(word.capitalize() for word in self.name.split("_"))
        return BtcppForm(tag, {n: btcpp_value(v) for n, v in given.items()}, self.Settings.model_fields)


class _UnknownKind(NodeKind):
    """A node that could not be read; it stands in the tree so that the rest can be checked."""

    name, description, children = "unknown", "could not be read", "none"
    needs_settings = True


NODES: dict[str, NodeKind] = {}
"""The node kinds that a mission file can name, by that name."""
_OTHERS: dict[str, NodeKind] = {"unknown": _UnknownKind()}


def register(kind: NodeKind, *, named: bool = True) -> None:
    """Make a node kind known.

    Args:
        kind: The kind.
        named: A mission file writes its name; a skill is written by its own.
    """
    (NODES if named else _OTHERS)[kind.name] = kind


def kind_of(node: NodeSpec) -> NodeKind:
    """Return the kind of a node."""
    return NODES.get(node.kind) or _OTHERS[node.kind]


def wire_setting(port: str, given: Map, reader: NodeReader, *path: str) -> Wire | None:
    """Return a port wired to the key that stands in a setting, at `path` (default: of the port's name)."""
    node: Node | None = given
    for step in path or (port,):
        node = node.get(step) if isinstance(node, Map) else None
    if not isinstance(node, Scalar) or not isinstance(node.value, str) or node.poisoned:
        return None
    return reader.wire(port, node.value, node.place)


def set_values(model: BaseModel | None) -> list[str]:
    """Return `name=value` for every field of a model that was set and differs from its default."""
    parts: list[str] = []
    if model is None:
        return parts
    for name, described in type(model).model_fields.items():
        value = getattr(model, name)
        if name in model.model_fields_set and value != described.default and not hasattr(value, "model_fields"):
            parts.append(f"{name}={_shown(value)}")
    return parts


def _shown(value: object) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{k}→{v}" for k, v in value.items())
    return f"{value:g}" if isinstance(value, float) else str(value)
