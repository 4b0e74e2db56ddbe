"""What a node asks of the configuration in which it looks at a key or a resource: which values are good enough."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from glotouch_bt.mission.check.state_variables import UNSET, Kind, Variables
from glotouch_bt.mission.spec import UNITS, ConditionSettings, NodeSpec, Place, RepeatSettings, unit_of_name
from glotouch_bt.mission.tree import holds


@dataclass(frozen=True, eq=False)
class Demand:
    """One look at one variable.

    Attributes:
        node: Who looks.
        port: Port, setting, or the resource's name.
        key: Key or resource.
        variable: Its variable.
        place: Where the mission says so.
        good: Values of the variable with which the node works.
        unset: What it means that nobody has written the key: a mistake, a mistake if nobody can have, or nothing.
        wanted: Type it must have, or the states a resource must be in.
        element: Type its items must have, if it is a tuple; `object`: any.
        unit: Unit the port's name carries, or empty.
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
        """It looks at a resource, not at a key."""
        return isinstance(self.wanted, frozenset)

    @property
    def stops(self) -> bool:
        """Without a good value the node cannot even run (a condition would only fail)."""
        return self.unset == "never" or self.of_resource


def fits(kind: Kind, wanted: Any, unit: str = "", element: type = object) -> bool:
    """A value of a kind passes py_trees' run-time check of `wanted`, has such items, and is in the same unit.

    Unknown types pass, and so do names without a unit.
    """
    if kind.unit and unit and kind.unit != unit:
        return False
    if object not in (kind.element, element) and not issubclass(kind.element, element):
        return False
    given = kind.data_type
    if given is object or wanted is object:
        return True
    options = getattr(wanted, "__args__", None) if not isinstance(wanted, type) else (wanted,)
    plain = [o for o in options or () if isinstance(o, type)]
    if not plain:
        return True
    if given is bool and bool not in plain:
        return False
    return any(issubclass(given, o) for o in plain)


Demands = Mapping[int, tuple[Demand, ...]]
"""By node id."""


def all_demands(tree: NodeSpec, variables: Variables) -> Demands:
    """What every node of a tree asks."""
    return {id(n): tuple(demands_of(n, variables)) for n in tree.walk()}


def demands_of(node: NodeSpec, variables: Variables) -> Iterator[Demand]:
    """Everything a node asks: keys in the order of its ports, then resources."""

    def look(
        port: str,
        unset: Literal["never", "not always", "allowed"],
        wanted: Any,
        unit: str = "",
        element: type = object,
    ) -> Demand:
        key, place = node.reads[port].key, node.reads[port].place
        good = {v for v in variables.written(key) if fits(variables.kind(key, v), wanted, unit, element)}
        if unset != "never":
            good.add(UNSET)
        return Demand(node, port, key, variables.keys[key], place, frozenset(good), unset, wanted, unit, element)

    if node.skill_type is not None:
        skill = node.skill_type
        for port, wire in node.reads.items():
            if port in node.constants:
                continue
            info = skill.INPUT_PORTS[port]
            # An optional input may stay unwritten, unless the mission wired it on purpose.
            optional: Literal["not always", "allowed"] = "allowed" if wire.place == node.place else "not always"
            element = getattr(getattr(skill, port, None), "element", None) or object
            yield look(port, "never" if info.required else optional, info.data_type, unit_of_name(port), element)
        for resource, states in skill.PRECONDITIONS.items():
            good = frozenset(variables.state(resource, s) for s in states)
            yield Demand(
                node, resource, resource, variables.resources[resource], node.place, good, "allowed", frozenset(states)
            )
    elif node.kind == "condition" and "port" in node.reads:
        if isinstance(node.settings, ConditionSettings):
            unset: Literal["not always", "allowed"] = "not always" if node.settings.is_set is None else "allowed"
            yield look("port", unset, compared_type(node.settings), node.reads["port"].unit)
    elif node.kind == "repeat" and "until" in node.reads:
        if isinstance(node.settings, RepeatSettings):
            condition = until_condition(node.settings)
            unset = "not always" if condition.is_set is None else "allowed"
            yield look("until", unset, compared_type(condition), node.reads["until"].unit)
    elif node.kind == "for_each":
        for port in node.reads:
            yield look(port, "not always", tuple if port == "items" else object)


def until_condition(settings: RepeatSettings) -> ConditionSettings:
    """What a repeat tests after each pass; a bare key must be true."""
    if isinstance(settings.until, ConditionSettings):
        return settings.until
    return ConditionSettings(port=str(settings.until), equals=True)


def verdicts(variables: Variables, demand: Demand, settings: ConditionSettings) -> tuple[set[int], set[int]]:
    """Values of a demand's variable with which a comparison may hold, and with which it may fail."""
    holding, failing = set(), set()
    for value in {UNSET, *demand.good}:
        said = None if value == UNSET else variables.kind(demand.key, value).value
        free = value != UNSET and said is None and settings.is_set is None
        # Whatever is written is not None: any other value does for `is_set`.
        held = holds(settings, None if value == UNSET else True if said is None else said)
        if free or held:
            holding.add(value)
        if free or not held:
            failing.add(value)
    return holding, failing


def compared_type(settings: ConditionSettings) -> Any:
    """The type a condition's port must have."""
    if settings.at_least is not None or settings.at_most is not None:
        return int | float
    if settings.equals is None:
        return object
    number = isinstance(settings.equals, (int, float)) and not isinstance(settings.equals, bool)
    return int | float if number else type(settings.equals)


def same_quantity(unit: str, other: str) -> bool:
    """Two units measure the same thing, so that only the factor is wrong."""
    return unit in UNITS and other in UNITS and UNITS[unit][0] == UNITS[other][0]
