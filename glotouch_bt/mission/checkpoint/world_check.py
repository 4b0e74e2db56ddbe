"""Before a resumed mission goes on in a world that went on without it: is that world as the ports say?"""

from __future__ import annotations

from glotouch_bt.mission.tree import BuiltTree
from glotouch_bt.robot import GlotouchError
from glotouch_bt.skill import Context, Reason, Skill
from glotouch_skills.common import Recheck

NAME = "recheck"


class WorldChanged(GlotouchError):
    """It is not; the reason says what to do before the next attempt."""

    def __init__(self, reason: Reason) -> None:
        super().__init__(f"{reason.code}: {reason.message}" + (f" ({reason.advice})" if reason.advice else ""))
        self.reason = reason


def world_check(tree: BuiltTree, context: Context, start: str = "") -> Recheck:
    """The skill that looks; its inputs are the mission's keys of the usual names, as far as they are written.

    Where a person says at which node to `start`, that node's skill says whether the probe may be out of the hand by
    now (it may have been put back), and no candidate is touched: that they have moved may be why it starts there.
    """
    hand = _hand_at(tree, start) if start else None
    if hand is not None and "probe" not in hand:
        context.arm.scene.hold_tool(False)
    params = Recheck.Params(touch=not start, may_be_gone=hand is not None and "empty" in hand)
    skill = Recheck(NAME, params, context)
    skill.setup_ports({port: f"{tree.namespace}/{key}" for port, key in Recheck.default_keys().items()})
    return skill


def _hand_at(tree: BuiltTree, path: str) -> frozenset[str] | None:
    """What may be in the hand when the first skill at a node begins; None: it does not say."""
    for node in tree.root.iterate():
        if isinstance(node, Skill) and (tree.paths[node.id] + "/").startswith(path + "/"):
            return node.PRECONDITIONS.get("hand")
    return None
