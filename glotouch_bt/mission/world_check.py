"""Before a resumed mission goes on in a world that went on without it: is that world as the ports say?"""

from __future__ import annotations

from glotouch_bt.mission.build import BuiltTree
from glotouch_bt.robot import GlotouchError
from skills.base import Context, Reason, Skill
from skills.recheck import Recheck

NAME = "recheck"


class WorldChanged(GlotouchError):
    """It is not; the reason says what to do before the next attempt."""

    def __init__(self, reason: Reason) -> None:
        super().__init__(f"{reason.code}: {reason.message}" + (f" ({reason.advice})" if reason.advice else ""))
        self.reason = reason


def world_check(tree: BuiltTree, context: Context, start: str = "") -> Recheck:
    """The skill that looks; its inputs are the mission's keys of the usual names, as far as they are written.

    Where a person says at which node to `start`, that node's skill says whether the probe is in the hand now (it may
    have been put back), and no candidate is touched: that they have moved may be why it starts there.
    """
    if start and not _needs_probe(tree, start):
        context.arm.scene.hold_tool(False)
    skill = Recheck(NAME, Recheck.Params(touch=not start), context)
    skill.setup_ports({port: f"{tree.namespace}/{key}" for port, key in Recheck.default_keys().items()})
    return skill


def _needs_probe(tree: BuiltTree, path: str) -> bool:
    """The first skill at a node may begin with the probe in the hand."""
    for node in tree.root.iterate():
        if isinstance(node, Skill) and (tree.paths[node.id] + "/").startswith(path + "/"):
            return "probe" in node.NEEDS.get("hand", frozenset({"probe"}))
    return True
