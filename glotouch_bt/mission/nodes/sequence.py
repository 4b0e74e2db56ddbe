"""`sequence`: children in order until one fails."""

from __future__ import annotations

import py_trees
from py_trees.behaviour import Behaviour

from glotouch_bt.mission.nodes.base import BuildContext, CompositeKind
from glotouch_bt.mission.spec import NodeSpec


class SequenceKind(CompositeKind):
    """Run the children in order; fail with the first that fails."""

    name = "sequence"
    description = "children in order; fails with the first that fails"
    btcpp, sign = "Sequence", "→"
    continue_on = True

    def build(self, node: NodeSpec, children: list[Behaviour], made: BuildContext) -> Behaviour:
        """Return a sequence that remembers its running child."""
        return py_trees.composites.Sequence(node.name, memory=True, children=children)
