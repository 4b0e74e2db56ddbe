"""Build the py_trees nodes of a checked tree, wired to one run's keys."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from py_trees.behaviour import Behaviour
from py_trees.blackboard import Blackboard

from glotouch_bt.mission.nodes import BuildContext, kind_of
from glotouch_bt.mission.spec import NodeSpec
from glotouch_bt.skill import Context

_runs = 0


@dataclass
class BuiltTree:
    """A tree ready to tick.

    Attributes:
        root: The root node.
        paths: Path in the tree (`retrieve/sequence/squeeze`) by node id.
        skills: Name of the skill by node id, of the nodes that are one.
        keys: All keys, as the mission names them.
        namespace: Where the keys live on py_trees' blackboard.
    """

    root: Behaviour
    paths: Mapping[object, str]
    skills: Mapping[object, str]
    keys: tuple[str, ...]
    namespace: str

    def value(self, key: str) -> object | None:
        """Return the value of a key, or None."""
        found: object | None = Blackboard.storage.get(f"{self.namespace}/{key}")
        return found

    def forget(self) -> None:
        """Remove this run's keys from py_trees' (process-wide) blackboard."""
        for key in self.keys:
            Blackboard.storage.pop(f"{self.namespace}/{key}", None)
            Blackboard.metadata.pop(f"{self.namespace}/{key}", None)


def build_tree(spec: NodeSpec, context: Context, title: str) -> BuiltTree:
    """Build the nodes of a checked tree.

    Args:
        spec: A tree without findings.
        context: What skills are lent; `context.mission_s` is the clock of timeouts.
        title: First word of each node's path.
    """
    # py_trees' blackboard is one dict for the whole process: two runs must not share keys.
    global _runs
    _runs += 1
    namespace = f"/run{_runs}"
    paths: dict[object, str] = {}
    skills: dict[object, str] = {}
    root = _build(spec, title, BuildContext(context, namespace), paths, skills)
    keys = dict.fromkeys(w.key for n in spec.walk() for w in (*n.reads.values(), *n.writes.values()))
    return BuiltTree(root, paths, skills, tuple(keys), namespace)


def _build(
    spec: NodeSpec, above: str, made: BuildContext, paths: dict[object, str], skills: dict[object, str]
) -> Behaviour:
    path = f"{above}/{spec.name}"
    children = [_build(c, path, made, paths, skills) for c in spec.children]
    node = kind_of(spec).build(spec, children, made)
    paths[node.id] = path
    if spec.skill:
        skills[node.id] = spec.skill
    return node
