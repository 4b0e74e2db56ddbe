"""The nodes a mission is made of: composites, decorators, conditions, subtrees, skills."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field
from pydantic.config import JsonDict

from glotouch_bt.mission.spec.source import Place
from glotouch_bt.skill import Skill, SkillParams, param

ANY_UNIT: JsonDict = {"any_unit": True}
"""Of a number that may be written in any unit: it is compared with what is in that of the key."""


class Settings(BaseModel):
    """Base of the settings of the nodes that come with the executive."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Plain(Settings):
    """Nothing to set."""


class ParallelSettings(Settings):
    """Tick all children in every period."""

    policy: Literal["all", "one"] = Field(default="all", description="succeed when all have, or when one has")


class RetrySettings(Settings):
    """Try again after a failure."""

    attempts: int = Field(description="how often in all", ge=1, le=10_000)


class TimeoutSettings(Settings):
    """Fail a child that takes too long on the robot's clock."""

    seconds: float = param("longest time, robot clock", unit="s", gt=0.0, le=86_400.0)


class ConditionSettings(Settings):
    """Compare a port's value; a port that nobody has written yet fails every comparison but `is_set: false`."""

    port: str = Field(description="key to look at")
    equals: bool | int | float | str | None = Field(default=None, description="succeed if equal")
    at_least: float | None = Field(
        default=None, description="succeed if the number is at least this", json_schema_extra=ANY_UNIT
    )
    at_most: float | None = Field(
        default=None, description="succeed if the number is at most this", json_schema_extra=ANY_UNIT
    )
    is_set: bool | None = Field(default=None, description="succeed if somebody wrote it (false: nobody)")


class RepeatSettings(Settings):
    """Do the child again while it succeeds, a number of times or until a condition holds (tested after each pass)."""

    times: int | None = Field(default=None, description="number of passes", ge=1, le=1_000_000)
    until: str | ConditionSettings | None = Field(default=None, description="a boolean key, or a condition")
    limit: int = Field(default=1000, description="with until: passes after which it fails", ge=1, le=1_000_000)


class ForEachSettings(Settings):
    """Do the child for each item of a tuple."""

    items: str = Field(description="key holding the tuple")
    item: str = Field(description="key each item is written to")
    collect: dict[str, str] = Field(default_factory=dict, description="child's key: key of the tuple it is gathered in")
    on_failure: Literal["continue", "stop"] = Field(default="stop", description="what a failing item does")
    least_first: str | None = Field(default=None, description="field of the items: those with the least of it first")


class SubtreeSettings(Settings):
    """Another file's tree with parameters and ports of its own."""

    file: str = Field(description="path of the subtree's file, relative to this one")
    parameters: dict[str, bool | int | float | str] = Field(
        default_factory=dict, description="values of its parameters"
    )
    ports: dict[str, str] = Field(default_factory=dict, description="its key: our key; all its other keys are private")


@dataclass(frozen=True)
class Kind:
    """A node that comes with the executive.

    Attributes:
        settings: What may be set.
        children: How many children: none, one (`do`), or a list.
        description: One line for people.
        btcpp: What BehaviorTree.CPP calls it; empty: it has none like it.
    """

    settings: type[Settings]
    children: Literal["none", "one", "many"]
    description: str
    btcpp: str = ""


KINDS: dict[str, Kind] = {
    "sequence": Kind(Plain, "many", "children in order; fails with the first that fails", "Sequence"),
    "selector": Kind(Plain, "many", "children in order; succeeds with the first that succeeds", "Fallback"),
    "parallel": Kind(ParallelSettings, "many", "all children at once; fails with the first that fails", "Parallel"),
    "retry": Kind(RetrySettings, "one", "try the child again when it fails", "RetryUntilSuccessful"),
    "timeout": Kind(TimeoutSettings, "one", "fail if the child takes longer, robot clock", "Timeout"),
    "repeat": Kind(RepeatSettings, "one", "do the child again and again", "Repeat"),
    "for_each": Kind(ForEachSettings, "one", "do the child for every item of a tuple", "ForEach"),
    "invert": Kind(Plain, "one", "success and failure exchanged", "Inverter"),
    "succeed": Kind(Plain, "one", "success whatever the child says", "ForceSuccess"),
    "fail": Kind(Plain, "one", "failure whatever the child says", "ForceFailure"),
    "condition": Kind(ConditionSettings, "none", "test a port"),
    "subtree": Kind(SubtreeSettings, "none", "a tree from another file", "SubTree"),
}


@dataclass(frozen=True)
class Wire:
    """A port wired to a key.

    Attributes:
        port: Port name (for our own nodes: the setting's name).
        key: Blackboard key; a subtree's private keys carry its name and a slash.
        place: Where the wiring was written, or the node.
        unit: SI unit of what a condition compares the value with, where the mission says one.
    """

    port: str
    key: str
    place: Place
    unit: str = ""


@dataclass
class NodeSpec:
    """One checked node.

    Attributes:
        kind: A key of `KINDS`, or "skill", or "unknown" (reported; kept so that the rest can be checked).
        name: Shown name, unique in the tree once numbered.
        place: Where it stands.
        children: Nodes below.
        settings: Its settings; None if they were faulty.
        skill: The skill's name and class, for kind "skill".
        params: The skill's parameters; None if they were faulty.
        reads, writes: Wired ports by port name.
        constants: Input ports whose value stands in the mission.
    """

    kind: str
    name: str
    place: Place
    children: tuple[NodeSpec, ...] = ()
    settings: Settings | None = None
    skill: str = ""
    skill_type: type[Skill] | None = None
    params: SkillParams | None = None
    reads: Mapping[str, Wire] = field(default_factory=dict)
    writes: Mapping[str, Wire] = field(default_factory=dict)
    constants: Mapping[str, object] = field(default_factory=dict)

    def walk(self) -> Iterator[NodeSpec]:
        """This node and all below, parents first."""
        yield self
        for child in self.children:
            yield from child.walk()


def number_names(root: NodeSpec) -> None:
    """Make names unique: the second `squeeze` becomes `squeeze 2`."""
    taken = {n.name for n in root.walk()}
    seen: set[str] = set()
    for node in root.walk():
        name, n = node.name, 2
        while node.name in seen:
            candidate = f"{name} {n}"
            n += 1
            if candidate not in taken:
                node.name = candidate
        seen.add(node.name)
        taken.add(node.name)
