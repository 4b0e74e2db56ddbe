"""The nodes of a mission as they were read; `mission.nodes` says what each kind means."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from pydantic import BaseModel, ConfigDict

from glotouch_bt.mission.spec.source import Place
from glotouch_bt.skill import Skill, SkillParams


class Settings(BaseModel):
    """Base of the settings of node kinds."""

    model_config = ConfigDict(extra="forbid", frozen=True)


@dataclass(frozen=True)
class Wire:
    """A port wired to a key.

    Attributes:
        port: Port name (of a node that is no skill: the setting's name).
        key: Blackboard key; a subtree's private keys carry its name and a slash.
        place: Where the wiring was written, or the node.
        unit: SI unit of the constant that a condition compares the value with, where the mission gives one.
    """

    port: str
    key: str
    place: Place
    unit: str = ""


@dataclass
class NodeSpec:
    """One checked node.

    Attributes:
        kind: Name of its kind, "skill", or "unknown" (reported; kept so that the rest can be checked).
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

    @property
    def is_unread(self) -> bool:
        """True for a node that could not be read."""
        return self.kind == "unknown"

    def walk(self) -> Iterator[NodeSpec]:
        """Yield this node and all below, parents first."""
        left = [self]
        while left:
            node = left.pop()
            yield node
            left.extend(reversed(node.children))

    def paths(self, above: str) -> dict[str, NodeSpec]:
        """Return this node and all below by path, parents first; `above` is the parent's path."""
        path = f"{above}/{self.name}"
        found = {path: self}
        for child in self.children:
            found |= child.paths(path)
        return found


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
