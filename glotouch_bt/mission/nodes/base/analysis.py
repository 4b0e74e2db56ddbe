"""Values and protocols between a node kind and the checker. The checker's own classes fulfil the protocols."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

from glotouch_bt.mission.nodes.base.comparison import ConditionSettings
from glotouch_bt.mission.nodes.base.state_sets import EMPTY, StateSets
from glotouch_bt.mission.nodes.base.state_variables import StateVariables
from glotouch_bt.mission.nodes.base.value_sets import ValueSets
from glotouch_bt.mission.spec import NodeSpec, Place

Values = tuple[int, ...]
"""The values of the variables that a path search follows."""
Stack = tuple[tuple[int, Any], ...]
"""The nodes that are running, outermost first: (node number, what the node remembers)."""


@dataclass(frozen=True, eq=False)
class Requirement:
    """One read of one variable, and the values with which the node works.

    Attributes:
        node: The node that reads.
        port: Port, setting, or the resource's name.
        key: Key or resource.
        variable: Its variable.
        place: Where the mission says so.
        good: Values of the variable with which the node works.
        unset: Meaning of an unwritten key: a mistake ("never"), a mistake if nothing can have written it ("not
            always"), or nothing ("allowed").
        wanted: Type it must have, or the states a resource must be in.
        unit: Unit the port's name carries, or empty.
        element: Type its items must have, if it is a tuple; `object`: any.
    """

    node: NodeSpec
    port: str
    key: str
    variable: int
    place: Place
    good: frozenset[int]
    unset: Literal["never", "not always", "allowed"]
    wanted: Any
    unit: str = ""
    element: type = object

    @property
    def of_resource(self) -> bool:
        """True for a resource, False for a key."""
        return isinstance(self.wanted, frozenset)

    @property
    def stops(self) -> bool:
        """True if the node cannot run without a good value (a condition would only fail)."""
        return self.unset == "never" or self.of_resource


@dataclass(frozen=True)
class ExitStates:
    """Sets of states after a node.

    Attributes:
        success, failure: States in which it may have ended so.
        running: States in which it may be preempted.
    """

    success: int = EMPTY
    failure: int = EMPTY
    running: int = EMPTY


class DataFlowAnalysis(Protocol):
    """The data-flow analysis of one tree, as a node kind uses it to compute its exit states."""

    @property
    def sets(self) -> StateSets | ValueSets:
        """The algebra of sets of states."""

    @property
    def variables(self) -> StateVariables:
        """The variables of the tree."""

    @property
    def requirements(self) -> Mapping[int, tuple[Requirement, ...]]:
        """Those of each node, by node id."""

    @property
    def lenient(self) -> bool:
        """True to go on after a mistake as if the requirement had been met."""

    @property
    def has_unknown(self) -> bool:
        """True if the tree has a node that could not be read."""

    @property
    def facts(self) -> dict[int, Any]:
        """Results cached by node kinds, by node id; they do not depend on the entry state."""

    def run(self, node: NodeSpec, entry: int) -> ExitStates:
        """Return the exit states of a node that is entered in `entry`."""

    def child(self, node: NodeSpec, entry: int) -> ExitStates:
        """Return the exit states of a node's only child."""

    def unknown(self, entry: int) -> ExitStates:
        """Return the exit states of a node of which nothing is known."""

    def note(self, requirements: Sequence[Requirement], entry: int) -> None:
        """Note that requirements are looked at in these states; they are always looked at together."""

    def preemptible(self, node: NodeSpec) -> bool:
        """Return True if a node above may preempt this one; otherwise its states while it runs are not needed."""

    def look(self, node: NodeSpec, port: str, entry: int) -> Requirement | None:
        """Note that the node reads a port (or resource) in these states; returns the requirement."""

    def where(self, entry: int, variable: int, values: Iterable[int]) -> int:
        """Return the states with such a value, and those that follow an unknown node."""

    def meeting(self, entry: int, requirement: Requirement) -> int:
        """Return the states that meet a requirement."""

    def test(self, node: NodeSpec, port: str, comparison: ConditionSettings, entry: int) -> tuple[int, int]:
        """Return the states in which a comparison may hold, and those in which it may fail."""


@dataclass(frozen=True)
class Position:
    """A place in an execution of the tree.

    Attributes:
        stack: The running nodes; the last one is a leaf.
        values: Values of the variables that are followed.
        done: "goal" or "end" once either is reached.
        said: What happened on the way here besides the leaf's outcome.
    """

    stack: Stack
    values: Values
    done: str = ""
    said: str = field(default="", compare=False)


class PathSearch(Protocol):
    """The search for the shortest run to a mistake, as a node kind uses it to yield the next positions."""

    @property
    def variables(self) -> StateVariables:
        """The variables of the tree."""

    def enter(self, node: NodeSpec, stack: Stack, values: Values) -> Iterator[Position]:
        """Enter a node below `stack`."""

    def leave(self, stack: Stack, succeeded: bool, values: Values) -> Iterator[Position]:
        """Continue in the innermost node of `stack`, whose child has just ended."""

    def push(self, stack: Stack, node: NodeSpec, memory: Any) -> Stack:
        """Return the stack with a node and what it remembers on top."""

    def reached(self, node: NodeSpec, port: str, values: Values) -> bool:
        """True if this read of a port is the goal."""

    def verdicts(self, node: NodeSpec, port: str, comparison: ConditionSettings, values: Values) -> list[bool]:
        """Return the possible results of a comparison."""

    def may_hold(self, node: NodeSpec, port: str, values: Values) -> set[int]:
        """Return the values that a port may hold: the one followed, or all that the analysis knows."""

    def followed(self, values: Values, variable: int) -> int | None:
        """Return the value of a variable; None if the search does not follow it."""

    def follows(self, variable: int) -> bool:
        """True if the search follows a variable."""

    def assign(self, values: Values, variable: int, value: int) -> Values:
        """Return the values with a variable set, if it is followed."""

    def meets(self, node: NodeSpec, values: Values) -> bool:
        """True if no variable that is followed breaks a requirement of a node."""

    def interrupters(self, stack: Stack) -> Iterator[tuple[Stack, NodeSpec]]:
        """Yield (stack above it, node) of every running node that may preempt its child at any moment."""
