"""Data-flow analysis: the set of states in which each node of a tree can be entered, over all outcomes of all leaves.

A state gives a value to every key and every resource. A node turns the set of states it is entered in into three: after
its success, after its failure, and at any moment at which it may be preempted. A skill may end in each way in any
state; a comparison succeeds or fails freely on a written key and fails on an unwritten one. The sets are exact for this
model: states that differ are never merged, so a key that is always written together with another one is known to be.
Loops are followed pass by pass until their sets come back. Only the sets of a `parallel` are larger than necessary,
because the interleavings of its children are not followed.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from glotouch_bt.mission.check.requirements import Requirements, verdicts
from glotouch_bt.mission.nodes import (
    ANYTHING,
    EMPTY,
    ConditionSettings,
    ExitStates,
    Requirement,
    StateSets,
    StateVariables,
    ValueSets,
    kind_of,
)
from glotouch_bt.mission.spec import NodeSpec


class DataFlow:
    """One analysis of a tree.

    Args:
        tree: Its root.
        variables: Of the tree.
        requirements: Of its nodes.
        sets: The algebra of sets of states; None: the exact one.
        coarse: An analysis with sets that contain these. It answers for the variables that `sets` does not follow.
        lenient: If no state meets a requirement, go on as if all met it, to analyse what comes after a mistake.
            Otherwise nothing goes on, as in a run.

    Attributes:
        entered: Ids of the nodes that are entered in some state.
        ends: (node id, True: in success) of the nodes that may end so.
        looked: Sets in which each requirement was looked at.
        facts: Results cached by node kinds, by node id; they do not depend on the entry state.
        end: Exit states of the root.
    """

    def __init__(
        self,
        tree: NodeSpec,
        variables: StateVariables,
        requirements: Requirements,
        sets: StateSets | ValueSets | None = None,
        *,
        coarse: DataFlow | None = None,
        lenient: bool = False,
    ) -> None:
        self.tree, self.variables, self.requirements, self.lenient = tree, variables, requirements, lenient
        self.sets = StateSets(variables.sizes) if sets is None else sets
        self._coarse = coarse
        self.has_unknown = any(kind_of(n).is_unknown(n) for n in tree.walk())
        self.entered: set[int] = set()
        self.ends: set[tuple[int, bool]] = set()
        self.looked: dict[Requirement, set[int]] = {}
        self._preemptible = {id(b) for n in tree.walk() if kind_of(n).preempts for b in n.walk()}
        self.facts: dict[int, Any] = {}
        self._known: dict[tuple[int, int], ExitStates] = {}
        self.end = self.run(tree, self.sets.start)

    def run(self, node: NodeSpec, entry: int) -> ExitStates:
        """Return the exit states of a node that is entered in `entry`."""
        if entry == EMPTY:
            return ExitStates()
        key = (id(node), entry)
        if key not in self._known:
            self.entered.add(id(node))
            made = self._known[key] = self._exits(node, entry)
            ways = ((True, made.success), (False, made.failure))
            self.ends.update((id(node), succeeded) for succeeded, states in ways if states != EMPTY)
        return self._known[key]

    def _exits(self, node: NodeSpec, entry: int) -> ExitStates:
        kind = kind_of(node)
        if not kind.is_unknown(node):
            return kind.exits(self, node, entry)
        unknown = self.unknown(entry)
        for child in node.children:  # nothing is claimed of what it holds either
            self.run(child, unknown.success)
        return unknown

    def child(self, node: NodeSpec, entry: int) -> ExitStates:
        """Return the exit states of a node's only child."""
        return self.run(node.children[0], entry) if node.children else self.unknown(entry)

    def unknown(self, entry: int) -> ExitStates:
        """Return the exit states of a node of which nothing is known."""
        lost = self.sets.assign(entry, self.variables.lost, 1)
        return ExitStates(lost, lost, lost)

    def judged(self, requirement: Requirement) -> int:
        """Return the set in which a requirement was looked at, without the states that follow an unknown node."""
        looked = self.sets.union(*self.looked.get(requirement, ()))
        return self.sets.where(looked, self.variables.lost, (0,)) if self.has_unknown else looked

    def values(self, requirement: Requirement) -> frozenset[int]:
        """Return the values of a requirement's variable where it is looked at, also after an unknown node."""
        looked = self.looked.get(requirement, ())
        return frozenset().union(*(self.sets.values(one, requirement.variable) for one in looked))

    def found(self, requirement: Requirement) -> frozenset[int]:
        """Return the values that a requirement's variable may have where it is looked at."""
        if requirement not in self.looked:
            return frozenset()
        if self._coarse is not None and not self.sets.follows(requirement.variable):
            return self._coarse.found(requirement)
        if not self.has_unknown:
            return self.values(requirement)
        return self.sets.values(self.judged(requirement), requirement.variable)

    def note(self, requirements: Sequence[Requirement], entry: int) -> None:
        """Note that requirements are looked at in these states; they are always looked at together."""
        if requirements:
            if requirements[0] not in self.looked:
                together: set[int] = set()
                self.looked.update((requirement, together) for requirement in requirements)
            self.looked[requirements[0]].add(entry)

    def preemptible(self, node: NodeSpec) -> bool:
        """Return True if a node above may preempt this one; otherwise its states while it runs are not needed."""
        return id(node) in self._preemptible

    def look(self, node: NodeSpec, port: str, entry: int) -> Requirement | None:
        """Note that the node reads a port (or resource) in these states; returns the requirement."""
        found = next((r for r in self.requirements[id(node)] if r.port == port), None)
        if found is not None:
            self.note((found,), entry)
        return found

    def where(self, entry: int, variable: int, values: Iterable[int]) -> int:
        """Return the states with such a value, and those that follow an unknown node."""
        found = self.sets.where(entry, variable, values)
        if not self.has_unknown:
            return found
        return self.sets.union(found, self.sets.where(entry, self.variables.lost, (1,)))

    def meeting(self, entry: int, requirement: Requirement) -> int:
        """Return the states that meet a requirement; if none does and the analysis is lenient, as if they all did."""
        met = self.where(entry, requirement.variable, requirement.good)
        if met == EMPTY and self.lenient:
            values = requirement.good if requirement.of_resource else (ANYTHING,)
            met = self.sets.union(*(self.sets.assign(entry, requirement.variable, v) for v in values))
        return met

    def test(self, node: NodeSpec, port: str, settings: ConditionSettings, entry: int) -> tuple[int, int]:
        """Return the states in which a comparison may hold, and those in which it may fail."""
        requirement, key = self.look(node, port, entry), node.reads[port].key
        if requirement is None:
            return entry, entry
        yes, no = verdicts(self.variables, requirement, settings)
        variable = self.variables.keys[key]
        held, failed = self.where(entry, variable, yes), self.where(entry, variable, no)
        if held == EMPTY and self.lenient and settings.is_set is None:
            held = self.sets.assign(entry, variable, ANYTHING)
        return held, failed
