"""The running skill of a tree, updated without a tick of the nodes above it for as long as it keeps running.

Sequences and selectors with memory, and decorators, do nothing in a tick in which their child keeps running, except
that a decorator may end it (a timeout). Such a tick is a walk down to the skill and back, which costs more than most
skills; here only the skill and those decorators are updated.
"""

from __future__ import annotations

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Selector, Sequence
from py_trees.decorators import Decorator

from glotouch_bt.mission.nodes import ForEach, MissionDecorator
from glotouch_bt.skill import Skill

DECORATOR_TICKS = (Decorator.tick, ForEach.tick)
"""Methods `tick` that with a running child only tick it and call `update`."""


class RunningSkill:
    """The one running skill of a tree.

    Args:
        root: Root of the tree.
    """

    def __init__(self, root: Behaviour) -> None:
        self._root = root
        self._skill: Skill | None = None
        self._decorators: list[MissionDecorator] = []

    def find(self) -> None:
        """Find it after a whole tick; there is none if several run, or if a node above it does more in a tick."""
        self._skill, self._decorators = None, []
        node = self._root
        while node.children:
            if isinstance(node, MissionDecorator) and type(node).tick in DECORATOR_TICKS:
                self._decorators.insert(0, node)
            elif type(node) not in (Sequence, Selector) or not getattr(node, "memory", False):
                return
            running = [child for child in node.children if child.status is Status.RUNNING]
            if len(running) != 1:
                return
            node = running[0]
        if isinstance(node, Skill) and type(node).tick is Behaviour.tick and node.status is Status.RUNNING:
            self._skill = node

    def keeps_running(self) -> bool:
        """Update it and the decorators above it; return True if they keep running, as after a tick of the whole tree.

        Else the whole tree must be ticked; the skill then reports the result of this update.
        """
        skill = self._skill
        if skill is None or skill.status is not Status.RUNNING:
            return False
        if skill.update_ahead() is not Status.RUNNING:
            return False
        for node in self._decorators:
            if node.update() is not Status.RUNNING:
                return False
        skill.forget_update()
        return True
