"""Prepare the check of a resumed mission's world: is it still as the ports say?"""

from __future__ import annotations

from glotouch_bt.mission.read import RESUME_CHECK_GROUP, SkillRegistry
from glotouch_bt.mission.tree import BuiltTree
from glotouch_bt.robot import GlotouchError
from glotouch_bt.skill import Context, Reason, Skill


class WorldChanged(GlotouchError):
    """The world is not as the ports say; the reason says what to do before the next attempt."""

    def __init__(self, reason: Reason) -> None:
        super().__init__(f"{reason.code}: {reason.message}" + (f" ({reason.advice})" if reason.advice else ""))
        self.reason = reason


def world_check(tree: BuiltTree, context: Context, start: str = "") -> Skill | None:
    """Return the installed resume check, its inputs wired to the mission's keys of the usual names.

    None, with a note in the record, if no resume check is installed. If a person named the node to `start` at, the
    check touches no candidate (they may have moved, which may be why), and the preconditions of that node's first skill
    say whether the probe may have been put back.
    """
    installed = SkillRegistry(RESUME_CHECK_GROUP)
    name = min(installed, default="")
    if not name:
        text = f"no skill is installed under {RESUME_CHECK_GROUP}: the mission goes on without checking its world"
        context.journal.event("note", context.observation.now_s, {"text": text})
        return None
    kind = installed[name]
    hand = _hand_at(tree, start) if start else None
    if hand is not None and "probe" not in hand:
        context.arm.scene.hold_tool(False)
    values = {"touch": not start, "may_be_gone": hand is not None and "empty" in hand}
    skill = kind(name, kind.Params.model_validate(values), context)
    skill.setup_ports({port: f"{tree.namespace}/{key}" for port, key in kind.default_keys().items()})
    return skill


def _hand_at(tree: BuiltTree, path: str) -> frozenset[str] | None:
    """Return what may be in the hand when the first skill at a node begins; None if that skill does not say."""
    for node in tree.root.iterate():
        if isinstance(node, Skill) and (tree.paths[node.id] + "/").startswith(path + "/"):
            return node.PRECONDITIONS.get("hand")
    return None
