"""`selector`: children in order until one succeeds."""

from __future__ import annotations

import py_trees
from py_trees.behaviour import Behaviour

from glotouch_bt.mission.nodes.base import BuildContext, CompositeKind
from glotouch_bt.mission.spec import NodeSpec


class SelectorKind(CompositeKind):
    """Run the children in order; succeed with the first that succeeds."""

    name = "selector"
    description = "children in order; succeeds with the first that succeeds"
    btcpp, sign = "Fallback", "?"
    continue_on = False

    def build(self, node: NodeSpec, children: list[Behaviour], made: BuildContext) -> Behaviour:
        """Return a selector that remembers its running child."""
        return py_trees.composites.Selector(node.name, memory=True, children=children)

    def no_effect(self, node: NodeSpec, *, fails: bool, succeeds: bool) -> str:
        """One child is no alternative."""
        return "it has one child" if len(node.children) == 1 and not node.children[0].is_unread else ""

    def catches_failure(self, node: NodeSpec) -> bool:
        """The next child may succeed."""
        return True
